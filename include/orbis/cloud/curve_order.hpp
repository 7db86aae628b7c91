// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Points along a space-filling curve: neighbours in space become neighbours in memory.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// The position along a Hilbert curve through a cube of 2^20 cells a side.
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004.
/// @pre every coordinate < 2^20
[[nodiscard]] constexpr std::uint64_t hilbert_key(std::array<std::uint32_t, 3> cell) noexcept {
  constexpr std::uint32_t bits = 20;
  for (std::uint32_t level = bits - 1; level > 0; --level) {
    const std::uint32_t below = (1U << level) - 1;
    for (std::uint32_t& c : cell) {
      if (((c >> level) & 1U) != 0) {
        cell[0] ^= below;
      } else {
        const std::uint32_t exchanged = (cell[0] ^ c) & below;
        cell[0] ^= exchanged;
        c ^= exchanged;
      }
    }
  }
  cell[1] ^= cell[0];
  cell[2] ^= cell[1];
  std::uint32_t flip = 0;
  for (std::uint32_t level = bits - 1; level > 0; --level) {
    if (((cell[2] >> level) & 1U) != 0) flip ^= (1U << level) - 1;
  }
  std::uint64_t key = 0;
  for (std::uint32_t level = bits; level-- > 0;) {
    for (const std::uint32_t c : cell) key = key << 1U | (((c ^ flip) >> level) & 1U);
  }
  return key;
}

/// A cloud copied for a pass over all its points: finite points only, as float, along the curve,
/// identical points once.
struct ordered_cloud {
  std::vector<std::array<float, 3>> positions;  ///< distinct
  std::vector<std::uint32_t> multiplicity;      ///< how many input points lie at each position
  std::vector<std::uint32_t> members;           ///< input indices, position by position
  std::size_t finite = 0;                       ///< number of finite input points

  /// Calls `f(position, input_index)` for every finite input point.
  template <class F>
  void for_each_member(F&& f) const {
    auto member = members.begin();
    for (std::size_t p = 0; p != positions.size(); ++p) {
      for (std::uint32_t i = 0; i != multiplicity[p]; ++i) f(p, *member++);
    }
  }
};

/// Orders a cloud along the Hilbert curve through its bounding cube. O(n log n); the same result
/// for every policy. @pre fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] ordered_cloud order_along_curve(const Policy& policy, const Points& points) {
  struct entry {
    std::uint64_t key;
    std::array<float, 3> position;
    std::uint32_t index;
  };
  const auto count = static_cast<std::uint32_t>(std::ranges::size(points));
  const auto first = std::ranges::begin(points);
  std::vector<entry> entries;
  entries.reserve(count);
  constexpr float inf = std::numeric_limits<float>::infinity();
  std::array<float, 3> low{inf, inf, inf};
  std::array<float, 3> high{-inf, -inf, -inf};
  for (std::uint32_t i = 0; i != count; ++i) {
    const auto p = coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
    if (!is_finite(p)) continue;
    for (std::size_t a = 0; a != 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
    entries.push_back({0, p, i});
  }
  double extent = 0;
  for (std::size_t a = 0; a != 3; ++a) extent = std::max(extent, double{high[a]} - double{low[a]});
  const double scale = extent > 0 ? ((1U << 20U) - 1) / extent : 0.0;
  for_each_index(policy, entries.size(), 4096, [&](std::size_t i) {
    std::array<std::uint32_t, 3> cell{};
    for (std::size_t a = 0; a != 3; ++a) {
      cell[a] = static_cast<std::uint32_t>((double{entries[i].position[a]} - double{low[a]}) * scale);
    }
    entries[i].key = hilbert_key(cell);
  });
  std::sort(entries.begin(), entries.end(), [](const entry& a, const entry& b) {
    if (a.key != b.key) return a.key < b.key;
    if (a.position != b.position) return a.position < b.position;
    return a.index < b.index;
  });

  ordered_cloud out;
  out.finite = entries.size();
  out.positions.reserve(entries.size());
  out.multiplicity.reserve(entries.size());
  out.members.reserve(entries.size());
  for (const entry& e : entries) {
    if (out.positions.empty() || out.positions.back() != e.position) {
      out.positions.push_back(e.position);
      out.multiplicity.push_back(0);
    }
    ++out.multiplicity.back();
    out.members.push_back(e.index);
  }
  return out;
}

}  // namespace orbis::cloud
