// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A depth_store that compresses beside its caller: tracking does not wait for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <optional>
#include <utility>

#include <orbis/mapping/depth_store.hpp>

#include "background.hpp"
#include "priority.hpp"

namespace app {

class kept_depths {
 public:
  /// Without `in_background` images are compressed in the caller's thread.
  kept_depths(orbis::mapping::depth_store_options options, bool in_background)
      : store_{std::move(options)}, background_{in_background} {}
  kept_depths(const kept_depths&) = delete;
  kept_depths& operator=(const kept_depths&) = delete;
  ~kept_depths() {
    if (ahead_.valid()) ahead_.wait();
  }

  /// Copies the image, and waits where the one before it is not compressed yet.
  void put(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    finish();
    if (background_) {
      ahead_ = start_in_background([this, frame, copy = depth] {
        lower_priority(compression_niceness);
        keep(frame, copy);
      });
    }
    if (!ahead_.valid()) keep(frame, depth);
  }
  /// Waits for the last image, so that the others below may be called. Throws what compressing it has thrown.
  void finish() {
    if (ahead_.valid()) ahead_.get();
  }

  /// See depth_store. @pre finished, as for those below
  [[nodiscard]] orbis::result<void> get(std::uint64_t frame, orbis::image<std::uint16_t>& out) const {
    return store_.get(frame, out);
  }
  void erase(std::uint64_t frame) { store_.erase(frame); }
  void free_buffers() { store_.free_buffers(); }
  /// Why images that should be in the spill file are in memory instead, if so.
  [[nodiscard]] const std::optional<orbis::error>& unspilled() const { return unspilled_; }

 private:
  void keep(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    if (auto kept = store_.put(frame, depth); !kept) unspilled_ = kept.error();
  }

  orbis::mapping::depth_store store_;
  std::optional<orbis::error> unspilled_;
  bool background_;
  std::future<void> ahead_;
};

}  // namespace app
