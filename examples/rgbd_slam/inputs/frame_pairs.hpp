// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Synchronisation of the frames of two streams.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <iterator>
#include <optional>
#include <utility>

namespace app {

/// The two streams.
enum class stream : std::size_t { color, depth };

/// Pairs colour and depth frames with the same time. Either stream may be some frames ahead of the other, and either
/// may lose frames.
template <class Frame>
class frame_pairs {
 public:
  struct pair {
    Frame color, depth;
  };

  /// `interval`: time between frames of a stream, seconds. Paired frames are less than half an interval apart, and at
  /// most 20 ms, which is also the limit for recordings.
  explicit frame_pairs(double interval = 1.0 / 30.0) : most_apart_{std::min(0.020, 0.49 * interval)} {}

  /// Adds the next frame of a stream with its time in seconds; returns the pair that it completes, if any.
  std::optional<pair> add(stream of, Frame frame, double time) {
    auto& own = waiting_[static_cast<std::size_t>(of)];
    auto& others = waiting_[static_cast<std::size_t>(of == stream::color ? stream::depth : stream::color)];
    const auto apart = [&](const timed& other) { return std::abs(other.time - time); };
    const auto partner = std::ranges::min_element(others, {}, apart);
    if (partner == others.end() || apart(*partner) > most_apart_) {
      own.push_back({std::move(frame), time});
      if (own.size() > most_waiting) own.pop_front();
      return std::nullopt;
    }
    Frame other = std::move(partner->frame);
    others.erase(others.begin(), std::next(partner));  // earlier ones have no partner
    own.clear();
    if (of == stream::color) return pair{std::move(frame), std::move(other)};
    return pair{std::move(other), std::move(frame)};
  }

  /// Discards the waiting frames.
  void clear() noexcept {
    for (auto& frames : waiting_) frames.clear();
  }

 private:
  static constexpr std::size_t most_waiting = 16;
  struct timed {
    Frame frame;
    double time;
  };
  double most_apart_;
  std::array<std::deque<timed>, 2> waiting_;
};

}  // namespace app
