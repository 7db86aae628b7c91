// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sets of frames as ranges of consecutive frames.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace app {

/// Consecutive frames.
struct frame_range {
  std::size_t first = 0, count = 0;
  friend bool operator==(const frame_range&, const frame_range&) = default;
};

class frame_ranges {
 public:
  /// Adds a frame. @pre all frames added before precede it
  void add(std::size_t frame) {
    if (ranges_.empty() || ranges_.back().first + ranges_.back().count != frame) ranges_.push_back({frame, 0});
    ++ranges_.back().count;
  }
  /// Removes a frame if it is in the set.
  void remove(std::size_t frame) {
    const auto at = std::find_if(ranges_.begin(), ranges_.end(),
                                 [&](const frame_range& r) { return r.first <= frame && frame < r.first + r.count; });
    if (at == ranges_.end()) return;
    const frame_range after{frame + 1, at->first + at->count - frame - 1};
    at->count = frame - at->first;
    const auto next = at->count == 0 ? ranges_.erase(at) : at + 1;
    if (after.count != 0) ranges_.insert(next, after);
  }
  /// The ranges in ascending order.
  [[nodiscard]] std::span<const frame_range> ranges() const noexcept { return ranges_; }

 private:
  std::vector<frame_range> ranges_;
};

}  // namespace app
