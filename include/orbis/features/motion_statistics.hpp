// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The stage that keeps matches whose neighbours move alike.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/match.hpp>

namespace orbis::features {

/// Grid motion statistics: keeps a candidate if enough of those around it, in cells of a grid, go to
/// the cells around where it goes. True matches have neighbours that move alike, false ones are
/// alone: so many candidates survive without a strict ratio test. O(candidates + cells^2) time, O(cells^4) memory.
///
/// Of each cell of the query image the cell of the train image is judged that most of its candidates go
/// to (the lowest on ties): the sum over the nine cells around both must exceed
/// `strictness * sqrt(n)`, n being the mean number of candidates in these nine. The query grid is laid four times,
/// shifted by half a cell; a candidate stays that is kept once.
///
/// Source: Bian, Lin, Matsushita, Yeung, Nguyen, Cheng, "GMS: grid-based motion statistics for fast,
/// ultra-robust feature correspondence", CVPR 2017.
struct motion_statistics {
  static constexpr search_needs needs{.keypoints = true};

  float query_width = 640.0F, query_height = 480.0F;  ///< of the image, pixels
  float train_width = 640.0F, train_height = 480.0F;
  float strictness = 6.0F;
  int cells = 20;          ///< of the grid, in each direction
  bool rotations = false;  ///< try eight turns of the images against each other, and keep the one that keeps most
  bool scales = false;     ///< likewise five ratios of scale: 1, 1/2, 1/sqrt 2, sqrt 2, 2

  struct workspace {
    std::vector<std::uint32_t> query_cell, train_cell;  ///< by candidate
    std::vector<std::uint32_t> moves;                   ///< from cell to cell
    std::vector<std::uint32_t> count, to;               ///< by cell of the query image
    std::vector<char> kept, best;                       ///< by candidate
  };

  /// @pre one keypoint for each descriptor on both sides; cells > 0; sizes > 0
  void operator()(std::vector<candidate>& candidates, std::span<const keypoint> queries,
                  std::span<const keypoint> trains, workspace& memory) const {
    assert(cells > 0 && query_width > 0.0F && query_height > 0.0F && train_width > 0.0F && train_height > 0.0F);
    static constexpr std::array<float, 5> ratios{1.0F, 0.5F, 0.70710678F, 1.41421356F, 2.0F};
    std::size_t most = 0;
    memory.best.assign(candidates.size(), 0);
    for (std::size_t scale = 0; scale != (scales ? ratios.size() : 1); ++scale) {
      const int train_cells = std::max(1, static_cast<int>(std::lround(static_cast<float>(cells) * ratios[scale])));
      for (int turn = 0; turn != (rotations ? 8 : 1); ++turn) {
        memory.kept.assign(candidates.size(), 0);
        for (int shift = 0; shift != 4; ++shift)
          keep_in_grid(candidates, queries, trains, 0.5F * static_cast<float>(shift % 2),
                       0.5F * static_cast<float>(shift / 2), train_cells, turn, memory);
        const auto kept = static_cast<std::size_t>(std::count(memory.kept.begin(), memory.kept.end(), 1));
        if (kept <= most) continue;
        most = kept;
        std::swap(memory.best, memory.kept);
      }
    }
    std::size_t i = 0;
    std::erase_if(candidates, [&](const candidate&) { return memory.best[i++] == 0; });
  }
  void operator()(std::vector<candidate>& candidates, std::span<const keypoint> queries,
                  std::span<const keypoint> trains) const {
    workspace memory;
    (*this)(candidates, queries, trains, memory);
  }

 private:
  /// The cell of a position, `none` outside the grid.
  [[nodiscard]] static std::uint32_t cell_of(float x, float y, float width, float height, float shift_x, float shift_y,
                                             int columns) noexcept {
    const float column = std::floor(x / width * static_cast<float>(columns) + shift_x);
    const float row = std::floor(y / height * static_cast<float>(columns) + shift_y);
    const auto end = static_cast<float>(columns);
    if (!(column >= 0.0F && row >= 0.0F && column < end && row < end)) return none;
    return static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(columns) + static_cast<std::uint32_t>(column);
  }

  /// The cell `i` steps clockwise on the ring around `cell`, `none` outside the grid.
  [[nodiscard]] static std::uint32_t around(std::uint32_t cell, int i, int columns) noexcept {
    static constexpr std::array<int, 8> step_x{-1, 0, 1, 1, 1, 0, -1, -1};
    static constexpr std::array<int, 8> step_y{-1, -1, -1, 0, 1, 1, 1, 0};
    const auto at = static_cast<std::size_t>(i % 8);
    const int x = static_cast<int>(cell) % columns + step_x[at];
    const int y = static_cast<int>(cell) / columns + step_y[at];
    return x < 0 || y < 0 || x >= columns || y >= columns ? none : static_cast<std::uint32_t>(y * columns + x);
  }

  void keep_in_grid(std::span<const candidate> candidates, std::span<const keypoint> queries,
                    std::span<const keypoint> trains, float shift_x, float shift_y, int train_cells, int turn,
                    workspace& memory) const {
    const auto query_count = static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells);
    const auto train_count = static_cast<std::size_t>(train_cells) * static_cast<std::size_t>(train_cells);
    auto& [query_cell, train_cell, moves, count, to, kept, best] = memory;
    query_cell.resize(candidates.size());
    train_cell.resize(candidates.size());
    if (moves.size() < query_count * train_count) moves.assign(query_count * train_count, 0);
    count.assign(query_count, 0);
    to.assign(query_count, none);
    const auto moved = [&moves = moves, train_count](std::uint32_t from, std::uint32_t where) -> std::uint32_t& {
      return moves[from * train_count + where];
    };
    for (std::size_t i = 0; i != candidates.size(); ++i) {
      const keypoint& q = queries[candidates[i].query];
      const keypoint& t = trains[candidates[i].train];
      query_cell[i] = cell_of(q.x, q.y, query_width, query_height, shift_x, shift_y, cells);
      train_cell[i] = cell_of(t.x, t.y, train_width, train_height, 0.0F, 0.0F, train_cells);
      if (query_cell[i] == none || train_cell[i] == none) continue;
      ++count[query_cell[i]];
      ++moved(query_cell[i], train_cell[i]);
    }
    for (std::size_t i = 0; i != candidates.size(); ++i) {
      const std::uint32_t from = query_cell[i], where = train_cell[i];
      if (from == none || where == none) continue;
      if (to[from] == none || moved(from, where) > moved(from, to[from]) ||
          (moved(from, where) == moved(from, to[from]) && where < to[from]))
        to[from] = where;
    }
    for (std::uint32_t from = 0; from != query_count; ++from) {
      if (to[from] == none) continue;
      std::uint32_t alike = moved(from, to[from]);
      std::uint32_t all = count[from];
      std::uint32_t regions = 1;
      for (int i = 0; i != 8; ++i) {
        const std::uint32_t near = around(from, i, cells);
        const std::uint32_t near_to = around(to[from], i + turn, train_cells);
        if (near == none || near_to == none) continue;
        alike += moved(near, near_to);
        all += count[near];
        ++regions;
      }
      const float mean = static_cast<float>(all) / static_cast<float>(regions);
      if (!(static_cast<float>(alike) > strictness * std::sqrt(mean))) to[from] = none;
    }
    for (std::size_t i = 0; i != candidates.size(); ++i) {
      const std::uint32_t from = query_cell[i], where = train_cell[i];
      if (from == none || where == none) continue;
      if (to[from] == where) kept[i] = 1;
      moved(from, where) = 0;  // for the next grid
    }
  }
};
static_assert(match_filter<motion_statistics>);

}  // namespace orbis::features
