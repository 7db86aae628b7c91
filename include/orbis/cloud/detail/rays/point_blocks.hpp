// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A cloud in blocks of neighbouring points with bounding boxes, for passes that can skip whole blocks.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

/// The finite points of a cloud, along a space-filling curve, axis by axis; `block_size` consecutive
/// ones make a block, `group_size` blocks a group. The last block is filled up with NaN.
struct point_blocks {
  static constexpr std::size_t block_size = 128;
  static constexpr std::size_t group_size = 16;

  struct box {
    std::array<float, 3> low;
    std::array<float, 3> high;
  };

  std::array<std::vector<float>, 3> axis{};  ///< metres
  std::vector<std::uint32_t> index{};        ///< which point of the cloud; as many as finite points
  std::vector<box> blocks{};
  std::vector<box> groups{};
};

struct keyed_index {
  std::uint32_t key;
  std::uint32_t index;
};

/// Stable, by the lowest 30 bits of the keys. O(n).
inline void sort_by_key(std::vector<keyed_index>& entries) {
  constexpr std::uint32_t digit = 10;
  constexpr std::uint32_t digits = 3;
  std::array<std::array<std::uint32_t, 1U << digit>, digits> first{};
  for (const keyed_index& e : entries) {
    for (std::uint32_t d = 0; d != digits; ++d) ++first[d][(e.key >> (digit * d)) & ((1U << digit) - 1)];
  }
  std::vector<keyed_index> other(entries.size());
  for (std::uint32_t d = 0; d != digits; ++d) {
    std::uint32_t sum = 0;
    for (std::uint32_t& f : first[d]) sum += std::exchange(f, sum);
    for (const keyed_index& e : entries) other[first[d][(e.key >> (digit * d)) & ((1U << digit) - 1)]++] = e;
    entries.swap(other);
  }
}

/// @pre boxes is not empty
[[nodiscard]] inline point_blocks::box hull_of(std::span<const point_blocks::box> boxes) {
  point_blocks::box hull = boxes.front();
  for (const point_blocks::box& b : boxes) {
    for (std::size_t a = 0; a != 3; ++a) {
      hull.low[a] = std::min(hull.low[a], b.low[a]);
      hull.high[a] = std::max(hull.high[a], b.high[a]);
    }
  }
  return hull;
}

/// O(n), 20 bytes for each point while at work and 16 afterwards; the same for every policy.
/// Coordinates are taken as float. @pre fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] point_blocks make_point_blocks(const Policy& policy, const Points& points) {
  constexpr std::size_t size = point_blocks::block_size;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const auto at = [&](std::size_t i) { return coordinates<float>(point_at(points, i)); };
  std::vector<keyed_index> entries;
  entries.reserve(std::ranges::size(points));
  constexpr float inf = std::numeric_limits<float>::infinity();
  std::array<float, 3> low{inf, inf, inf};
  std::array<float, 3> high{-inf, -inf, -inf};
  for (std::size_t i = 0; i != std::ranges::size(points); ++i) {
    const auto p = at(i);
    if (!is_finite(p)) continue;
    for (std::size_t a = 0; a != 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
    entries.push_back({0, static_cast<std::uint32_t>(i)});
  }
  point_blocks out;
  if (entries.empty()) return out;

  // Morton order: a coarse one will do. Wild points far away would make it coarser still, so it runs
  // through the cube that holds most of some sample, and clamps what lies outside.
  double extent = 0;
  std::array<double, 3> start{};
  for (std::size_t a = 0; a != 3; ++a) {
    constexpr std::size_t sample = 1024;
    std::vector<float> some;
    for (std::size_t i = 0; i < entries.size(); i += entries.size() / sample + 1)
      some.push_back(at(entries[i].index)[a]);
    std::ranges::sort(some);
    const double from = some[some.size() / 16];
    const double to = some[some.size() - 1 - some.size() / 16];
    start[a] = std::max(double{low[a]}, from - (to - from));
    extent = std::max(extent, std::min(double{high[a]}, to + (to - from)) - start[a]);
  }
  const double scale = extent > 0 ? 1023.0 / extent : 0.0;
  for_each_index(policy, entries.size(), 16384, [&](std::size_t i) {
    const auto p = at(entries[i].index);
    std::uint32_t key = 0;
    for (std::size_t a = 0; a != 3; ++a) {
      const double cell = std::clamp((double{p[a]} - start[a]) * scale, 0.0, 1023.0);
      key |= spread_ten_bits(static_cast<std::uint32_t>(cell)) << a;
    }
    entries[i].key = key;
  });
  sort_by_key(entries);

  const std::size_t count = (entries.size() + size - 1) / size;
  for (auto& axis : out.axis) axis.resize(count * size, nan);
  out.index.resize(entries.size());
  out.blocks.resize(count);
  for_each_index(policy, count, 32, [&](std::size_t b) {
    point_blocks::box box{{inf, inf, inf}, {-inf, -inf, -inf}};
    for (std::size_t i = b * size; i != std::min(entries.size(), (b + 1) * size); ++i) {
      out.index[i] = entries[i].index;
      const auto p = at(entries[i].index);
      for (std::size_t a = 0; a != 3; ++a) {
        out.axis[a][i] = p[a];
        box.low[a] = std::min(box.low[a], p[a]);
        box.high[a] = std::max(box.high[a], p[a]);
      }
    }
    out.blocks[b] = box;
  });
  for (std::size_t b = 0; b < count; b += point_blocks::group_size) {
    const std::size_t end = std::min(count, b + point_blocks::group_size);
    out.groups.push_back(hull_of(std::span{out.blocks}.subspan(b, end - b)));
  }
  return out;
}

}  // namespace orbis::cloud::detail
