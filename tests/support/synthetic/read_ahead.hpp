// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Makes the next frames of a sequence while the last one is still being worked on.
#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <utility>

#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/result.hpp>

#include "support/synthetic/sequence.hpp"

namespace orbis::test {

/// The frames of a sequence, one after the other; up to `depth` of them are being made in the background. The frames
/// are the same as without.
///
/// @code
///   read_ahead frames{loop};
///   while (auto frame = frames.next()) slam.track(frame->value());
/// @endcode
template <frame_sequence S>
class read_ahead {
 public:
  /// @pre depth > 0
  explicit read_ahead(S frames, std::size_t depth = 1) : frames_{std::make_shared<const S>(std::move(frames))} {
    for (std::size_t i = 0; i != depth; ++i) start();
  }

  /// The next frame; empty after the last one.
  [[nodiscard]] std::optional<result<camera::rgbd_frame>> next() {
    if (coming_.empty()) return std::nullopt;
    std::optional<result<camera::rgbd_frame>> frame{coming_.front().get()};
    coming_.pop_front();
    start();
    return frame;
  }

 private:
  void start() {
    if (at_ == frames_->size()) return;
    coming_.push_back(std::async(std::launch::async, [all = frames_, i = at_++] { return all->frame(i); }));
  }

  std::shared_ptr<const S> frames_;
  std::size_t at_ = 0;
  std::deque<std::future<result<camera::rgbd_frame>>> coming_;
};

}  // namespace orbis::test
