// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The order of the observations in bundle adjustment, and the blocks of its reduced system.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/optimize/detail/sparse/block_ordering.hpp>

namespace orbis::optimize::detail {

/// Observations in two orders. By camera, in tiles of eight (the last may have empty places), for arithmetic that is
/// the same for each observation. By point, cameras ascending, for the elimination of the points. Points with the same
/// first camera are neighbours, so that their elimination touches one part of the reduced system. Keeps its memory.
///
/// O(observations + pairs of observations of one point + pairs of cameras that may move); one bit for each of the last.
class bundle_structure {
 public:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t tile = 8;

  // By camera. Camera c has `count[c]` observations at the places [8 * first_tile[c], ...).
  std::vector<std::size_t> first_tile;
  std::vector<std::uint32_t> count;
  std::vector<std::uint32_t> source;                    ///< index of the caller's observation at a place
  std::vector<std::uint32_t> point;                     ///< of each place; that of the first place where it is empty
  std::vector<std::uint32_t> by_point, mixed_by_point;  ///< of each place, its number in the orders by point

  // By point. Number p is the caller's `point_source[p]`.
  std::vector<std::uint32_t> point_source;
  std::vector<std::uint32_t> first, first_mixed;  ///< of each point: all observations; those by cameras that may move
  std::vector<std::uint32_t> mixed_unknown;       ///< of each observation by a camera that may move, which one
  std::vector<std::uint32_t> pair_slot;           ///< slots of all pairs a >= b of those of a point, a ascending
  std::vector<std::size_t> first_pair;            ///< of each point

  // Cameras that may move, and blocks of the reduced system: lower triangle with diagonal, row by row.
  std::vector<std::uint32_t> unknown, camera;  ///< of each camera, its number or `none`; and back
  std::vector<block_place> slots;

  [[nodiscard]] std::size_t unknowns() const { return camera.size(); }
  [[nodiscard]] std::size_t points() const { return point_source.size(); }
  [[nodiscard]] std::size_t tiles() const { return first_tile.empty() ? 0 : first_tile.back(); }
  [[nodiscard]] std::size_t longest() const { return longest_; }  ///< most observations of a point

  /// Orders the observations for which `is_usable(index)`. Cameras without any do not move. With `hold_first` the first
  /// camera with observations does not move either, unless another is fixed.
  /// @pre their indices are in range, `fixed` is empty or has one entry for each camera
  template <class Observation, class Usable>
  void build(std::size_t cameras, std::size_t points, std::span<const Observation> observations,
             std::span<const std::uint8_t> fixed, bool hold_first, const Usable& is_usable) {
    sort(cameras, points, observations, is_usable);
    number_cameras(cameras, fixed, hold_first);
    order_points(points, observations);
    lay_out(cameras, observations);
    find_blocks();
  }

 private:
  /// By camera, then by point: `sorted_` has the observations of each point by ascending camera.
  template <class Observation, class Usable>
  void sort(std::size_t cameras, std::size_t points, std::span<const Observation> observations,
            const Usable& is_usable) {
    count.assign(cameras, 0);
    of_point_.assign(points + 1, 0);
    usable_.clear();
    usable_.reserve(observations.size());
    for (std::uint32_t k = 0; k != observations.size(); ++k)
      if (is_usable(k)) {
        usable_.push_back(k);
        ++count[observations[k].pose];
        ++of_point_[observations[k].point + 1];
      }
    cursor_.assign(cameras + 1, 0);
    for (std::size_t c = 0; c != cameras; ++c) cursor_[c + 1] = cursor_[c] + count[c];
    by_camera_.resize(usable_.size());
    for (const std::uint32_t k : usable_) by_camera_[cursor_[observations[k].pose]++] = k;
    for (std::size_t p = 0; p != points; ++p) of_point_[p + 1] += of_point_[p];
    cursor_.assign(of_point_.begin(), of_point_.end());
    sorted_.resize(usable_.size());
    for (const std::uint32_t k : by_camera_) sorted_[cursor_[observations[k].point]++] = k;
  }

  void number_cameras(std::size_t cameras, std::span<const std::uint8_t> fixed, bool hold_first) {
    unknown.assign(cameras, none);
    camera.clear();
    std::uint32_t held = none;
    for (std::uint32_t c = 0; c != cameras && hold_first; ++c) {
      if (count[c] == 0) continue;
      if (held == none) held = c;
      hold_first = fixed.empty() || fixed[c] == 0;
    }
    if (!hold_first) held = none;
    for (std::uint32_t c = 0; c != cameras; ++c)
      if (count[c] != 0 && c != held && (fixed.empty() || fixed[c] == 0)) {
        unknown[c] = static_cast<std::uint32_t>(camera.size());
        camera.push_back(c);
      }
  }

  /// By their first camera that may move.
  template <class Observation>
  void order_points(std::size_t points, std::span<const Observation> observations) {
    const std::size_t keys = camera.size() + 1;
    key_.assign(points, 0);
    cursor_.assign(keys + 1, 0);
    for (std::size_t p = 0; p != points; ++p) {
      if (of_point_[p] == of_point_[p + 1]) continue;
      std::size_t key = keys - 1;
      for (std::uint32_t at = of_point_[p]; at != of_point_[p + 1] && key == keys - 1; ++at)
        key = std::min<std::size_t>(key, unknown[observations[sorted_[at]].pose]);
      key_[p] = static_cast<std::uint32_t>(key);
      ++cursor_[key + 1];
    }
    for (std::size_t k = 0; k != keys; ++k) cursor_[k + 1] += cursor_[k];
    point_source.resize(cursor_[keys]);
    for (std::uint32_t p = 0; p != points; ++p)
      if (of_point_[p] != of_point_[p + 1]) point_source[cursor_[key_[p]]++] = p;
  }

  template <class Observation>
  void lay_out(std::size_t cameras, std::span<const Observation> observations) {
    first_tile.assign(cameras + 1, 0);
    for (std::size_t c = 0; c != cameras; ++c) first_tile[c + 1] = first_tile[c] + (count[c] + tile - 1) / tile;
    source.assign(tile * first_tile.back(), none);
    point.assign(source.size(), 0);
    by_point.assign(source.size(), none);
    mixed_by_point.assign(source.size(), none);
    next_place_.resize(cameras);
    for (std::size_t c = 0; c != cameras; ++c) next_place_[c] = tile * first_tile[c];

    first.assign(1, 0);
    first_mixed.assign(1, 0);
    first_pair.assign(1, 0);
    mixed_unknown.clear();
    longest_ = 0;
    for (std::uint32_t p = 0; p != point_source.size(); ++p) {
      const std::uint32_t begin = of_point_[point_source[p]], end = of_point_[point_source[p] + 1];
      for (std::uint32_t at = begin; at != end; ++at) {
        const std::uint32_t c = observations[sorted_[at]].pose;
        const std::size_t place = next_place_[c]++;
        source[place] = sorted_[at];
        point[place] = p;
        by_point[place] = first.back() + (at - begin);
        if (unknown[c] == none) continue;
        mixed_by_point[place] = static_cast<std::uint32_t>(mixed_unknown.size());
        mixed_unknown.push_back(unknown[c]);
      }
      first.push_back(first.back() + (end - begin));
      const std::size_t seen = mixed_unknown.size() - first_mixed.back();
      longest_ = std::max(longest_, seen);
      first_mixed.push_back(static_cast<std::uint32_t>(mixed_unknown.size()));
      first_pair.push_back(first_pair.back() + seen * (seen + 1) / 2);
    }
    for (std::size_t c = 0; c != cameras; ++c)
      if (count[c] != 0)
        for (std::size_t place = next_place_[c]; place != tile * first_tile[c + 1]; ++place)
          point[place] = point[tile * first_tile[c]];
  }

  /// Calls `f(row * (row + 1) / 2 + column)` for every pair of observations of a point.
  template <class F>
  void for_each_pair(const F& f) const {
    for (std::size_t p = 0; p != points(); ++p)
      for (std::uint32_t a = first_mixed[p]; a != first_mixed[p + 1]; ++a) {
        const std::size_t row = mixed_unknown[a];
        for (std::uint32_t b = first_mixed[p]; b <= a; ++b) f(row * (row + 1) / 2 + mixed_unknown[b]);
      }
  }

  void find_blocks() {
    const std::size_t n = unknowns();
    present_.assign((n * (n + 1) / 2 + 63) / 64, 0);
    const auto bit = [](std::size_t at) { return std::uint64_t{1} << (at % 64); };
    for (std::size_t i = 0; i != n; ++i) present_[i * (i + 3) / 2 / 64] |= bit(i * (i + 3) / 2);
    for_each_pair([&](std::size_t at) { present_[at / 64] |= bit(at); });
    rank_.resize(present_.size());
    std::uint32_t total = 0;
    for (std::size_t w = 0; w != present_.size(); ++w) {
      rank_[w] = total;
      total += static_cast<std::uint32_t>(std::popcount(present_[w]));
    }
    const auto slot_of = [&](std::size_t at) {
      return rank_[at / 64] + static_cast<std::uint32_t>(std::popcount(present_[at / 64] & (bit(at) - 1)));
    };
    slots.clear();
    slots.reserve(total);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i != n; ++i)
      for (std::uint32_t j = 0; j <= i; ++j, ++at)
        if ((present_[at / 64] & bit(at)) != 0) slots.push_back({i, j});
    pair_slot.clear();
    pair_slot.reserve(first_pair.back());
    for_each_pair([&](std::size_t pair) { pair_slot.push_back(slot_of(pair)); });
  }

  std::size_t longest_ = 0;
  std::vector<std::uint32_t> usable_, by_camera_, sorted_, of_point_, cursor_, key_;
  std::vector<std::size_t> next_place_;
  std::vector<std::uint64_t> present_;
  std::vector<std::uint32_t> rank_;
};

}  // namespace orbis::optimize::detail
