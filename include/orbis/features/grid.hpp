// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A spatial index of keypoints.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// Finds the keypoints near a pixel, in time proportional to their number. Stores a copy of the positions; concurrent
/// queries are allowed.
class keypoint_grid {
 public:
  keypoint_grid() = default;

  /// Builds the grid. Keypoints with non-finite positions are never found. O(n).
  /// @pre cell_size > 0 (pixels)
  explicit keypoint_grid(std::span<const keypoint> keypoints, float cell_size = 20.0F) { assign(keypoints, cell_size); }

  /// Rebuilds the grid, reusing its memory. O(n).
  /// @pre cell_size > 0 (pixels)
  void assign(std::span<const keypoint> keypoints, float cell_size = 20.0F) {
    assert(cell_size > 0.0F);
    entries_.clear();
    first_.clear();
    columns_ = rows_ = 0;
    left_ = top_ = 0.0F;
    float right = 0.0F;
    float bottom = 0.0F;
    std::size_t finite = 0;
    for (const keypoint& k : keypoints) {
      if (!is_finite(k)) continue;
      left_ = finite == 0 ? k.x : std::min(left_, k.x);
      top_ = finite == 0 ? k.y : std::min(top_, k.y);
      right = finite == 0 ? k.x : std::max(right, k.x);
      bottom = finite == 0 ? k.y : std::max(bottom, k.y);
      ++finite;
    }
    if (finite == 0) return;
    // Distant outliers coarsen the grid instead of exhausting the memory.
    const double most_cells = 4096.0 + 4.0 * static_cast<double>(finite);
    const double width = static_cast<double>(right) - static_cast<double>(left_);
    const double height = static_cast<double>(bottom) - static_cast<double>(top_);
    double cell = static_cast<double>(cell_size);
    while ((std::floor(width / cell) + 1.0) * (std::floor(height / cell) + 1.0) > most_cells) cell *= 2.0;
    inverse_cell_ = 1.0 / cell;
    columns_ = static_cast<int>(std::floor(width * inverse_cell_)) + 1;
    rows_ = static_cast<int>(std::floor(height * inverse_cell_)) + 1;

    // Counting sort by cell, from the back: first_[c] is the end of cell c, and finally its beginning in entries_.
    first_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
    for (const keypoint& k : keypoints)
      if (is_finite(k)) ++first_[cell_of(k)];
    for (std::size_t c = 1; c != first_.size(); ++c) first_[c] += first_[c - 1];
    entries_.resize(finite);
    for (std::size_t i = keypoints.size(); i-- != 0;) {
      const keypoint& k = keypoints[i];
      if (is_finite(k)) entries_[--first_[cell_of(k)]] = {k.x, k.y, static_cast<std::uint32_t>(i), k.octave};
    }
  }

  /// Calls `visit(index)` for every keypoint within `radius` pixels (inclusive) of `(x, y)` whose octave is in
  /// `[min_octave, max_octave]`, in an order that depends only on the keypoints.
  template <std::invocable<std::uint32_t> Visit>
  void for_each_near(float x, float y, float radius, int min_octave, int max_octave, Visit&& visit) const {
    if (entries_.empty() || !(radius >= 0.0F) || !std::isfinite(x) || !std::isfinite(y)) return;
    const int first_column = column_at(x - radius);
    const int last_column = column_at(x + radius);
    const int first_row = row_at(y - radius);
    const int last_row = row_at(y + radius);
    for (int row = first_row; row <= last_row; ++row) {
      const std::size_t line = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_);
      const std::uint32_t end = first_[line + static_cast<std::size_t>(last_column) + 1];
      for (std::uint32_t i = first_[line + static_cast<std::size_t>(first_column)]; i != end; ++i) {
        const entry& e = entries_[i];
        const float dx = e.x - x;
        const float dy = e.y - y;
        if (dx * dx + dy * dy <= radius * radius && e.octave >= min_octave && e.octave <= max_octave) visit(e.index);
      }
    }
  }

 private:
  struct entry {
    float x, y;
    std::uint32_t index;
    int octave;
  };

  [[nodiscard]] static bool is_finite(const keypoint& k) noexcept { return std::isfinite(k.x) && std::isfinite(k.y); }
  [[nodiscard]] int column_at(float x) const noexcept { return index_at(x, left_, columns_); }
  [[nodiscard]] int row_at(float y) const noexcept { return index_at(y, top_, rows_); }
  [[nodiscard]] int index_at(float at, float origin, int count) const noexcept {
    const double cell = (static_cast<double>(at) - static_cast<double>(origin)) * inverse_cell_;
    return static_cast<int>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));  // not negative: equal to floor
  }
  [[nodiscard]] std::size_t cell_of(const keypoint& k) const noexcept {
    return static_cast<std::size_t>(row_at(k.y)) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column_at(k.x));
  }

  float left_ = 0.0F, top_ = 0.0F;
  double inverse_cell_ = 1.0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;
  std::vector<entry> entries_;
};

}  // namespace orbis::features
