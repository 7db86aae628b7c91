// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Frames of two streams that belong together.
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

/// Which of the two streams.
enum class stream : std::size_t { color, depth };

/// Finds the frames of colour and depth that were taken at one time. Either stream may be some frames ahead of the
/// other one, and either may lose frames.
template <class Frame>
class frame_pairs {
 public:
  struct pair {
    Frame color, depth;
  };

  /// `interval`: of the frames of a stream, seconds. Frames belong together where they are less than half of it apart,
  /// and at most 20 ms, as in recordings.
  explicit frame_pairs(double interval = 1.0 / 30.0) : most_apart_{std::min(0.020, 0.49 * interval)} {}

  /// The next frame of a stream, with its time in seconds. The pair that it completes, if it does.
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
    others.erase(others.begin(), std::next(partner));  // those before wait in vain
    own.clear();
    if (of == stream::color) return pair{std::move(frame), std::move(other)};
    return pair{std::move(other), std::move(frame)};
  }

  /// Forgets the frames that wait.
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
