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

/// `x`'s lowest 21 bits, two zeros after each.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t x) noexcept {
  x &= 0x1fffff;
  x = (x | x << 32U) & 0x001f00000000ffffULL;
  x = (x | x << 16U) & 0x001f0000ff0000ffULL;
  x = (x | x << 8U) & 0x100f00f00f00f00fULL;
  x = (x | x << 4U) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2U) & 0x1249249249249249ULL;
}

/// Cells along a side of the curve's cube: 2^curve_bits.
inline constexpr std::uint32_t curve_bits = 16;

/// The position along a Hilbert curve through a cube of 2^curve_bits cells a side.
/// Source: J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004; here
/// without branches.
/// @pre every coordinate < 2^curve_bits
[[nodiscard]] constexpr std::uint64_t hilbert_key(std::array<std::uint32_t, 3> cell) noexcept {
  for (std::uint32_t level = curve_bits - 1; level > 0; --level) {
    const std::uint32_t below = (1U << level) - 1;
    for (std::uint32_t& c : cell) {
      const std::uint32_t set = 0U - ((c >> level) & 1U);  // all ones where the bit is set
      const std::uint32_t exchanged = (cell[0] ^ c) & below & ~set;
      cell[0] ^= (below & set) | exchanged;
      c ^= exchanged;
    }
  }
  cell[1] ^= cell[0];
  cell[2] ^= cell[1];
  // Bit i of `flip` is the parity of the bits of cell[2] above i.
  std::uint32_t flip = cell[2] >> 1U;
  for (std::uint32_t shift = 1; shift < curve_bits; shift *= 2) flip ^= flip >> shift;
  return spread_bits(cell[0] ^ flip) << 2U | spread_bits(cell[1] ^ flip) << 1U | spread_bits(cell[2] ^ flip);
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
  const double scale = extent > 0 ? ((1U << curve_bits) - 1) / extent : 0.0;
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
