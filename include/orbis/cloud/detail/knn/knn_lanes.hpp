// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of `knn_kernels.hpp`, four distances at a time, in the compiler's own vectors: SSE2,
/// NEON, or whatever the processor is known to have.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/rank_bracket.hpp>

#if defined(__clang__) || (defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__)))
#define ORBIS_HAS_LANES 1

namespace orbis::cloud::detail {

using float_lanes [[gnu::vector_size(16)]] = float;
using mask_lanes [[gnu::vector_size(16)]] = std::int32_t;
inline constexpr std::size_t rows_of_lanes = leaf_width / 4;

[[gnu::always_inline]] inline float_lanes load_lanes(const float* from) noexcept {
  float_lanes v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
[[gnu::always_inline]] inline float_lanes lanes_of(float x) noexcept { return float_lanes{x, x, x, x}; }

/// `squared_distance` in lanes.
[[gnu::always_inline]] inline float_lanes sum_of_squares_lanes(float_lanes x, float_lanes y, float_lanes z) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
#endif
  float_lanes xx = x * x;
  float_lanes yy = y * y;
  float_lanes zz = z * z;
#if !defined(__clang__) && defined(__x86_64__)
  asm("" : "+x"(xx), "+x"(yy), "+x"(zz));  // or else they become halves of fused multiply-adds
#elif !defined(__clang__)
  asm("" : "+w"(xx), "+w"(yy), "+w"(zz));
#endif
  return (xx + yy) + zz;
}

/// The larger one in each lane.
[[gnu::always_inline]] inline float_lanes larger_lanes(float_lanes a, float_lanes b) noexcept {
  const mask_lanes first = a > b;
  return reinterpret_cast<float_lanes>((reinterpret_cast<mask_lanes>(a) & first) |
                                       (reinterpret_cast<mask_lanes>(b) & ~first));
}

/// Sixteen truths as bits.
[[gnu::always_inline]] inline std::uint32_t bits_of_lanes(const mask_lanes* truth) noexcept {
  const mask_lanes bits = (truth[0] & mask_lanes{1, 2, 4, 8}) | (truth[1] & mask_lanes{16, 32, 64, 128}) |
                          (truth[2] & mask_lanes{256, 512, 1024, 2048}) |
                          (truth[3] & mask_lanes{4096, 8192, 16384, 32768});
  return static_cast<std::uint32_t>((bits[0] | bits[1]) | (bits[2] | bits[3]));
}

/// Writes the values with bits in `mask` one after the other, and returns their number; may write all sixteen.
[[gnu::always_inline]] inline std::size_t keep_lanes(const float* values, std::uint32_t mask, float* kept) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    kept[count] = values[i];
    count += mask >> i & 1U;
  }
  return count;
}

inline std::uint32_t near_boxes_lanes(const box_row& boxes, const box3& query, float bound, float* distance) {
  mask_lanes within[rows_of_lanes];
  for (std::size_t r = 0; r != rows_of_lanes; ++r) {
    float_lanes gap[3];
    for (std::size_t a = 0; a != 3; ++a) {
      const float_lanes below = load_lanes(boxes.low[a].data() + 4 * r) - lanes_of(query.high[a]);
      const float_lanes above = lanes_of(query.low[a]) - load_lanes(boxes.high[a].data() + 4 * r);
      gap[a] = larger_lanes(larger_lanes(below, above), float_lanes{});
    }
    const float_lanes d = sum_of_squares_lanes(gap[0], gap[1], gap[2]);
    std::memcpy(distance + 4 * r, &d, sizeof d);
    within[r] = d <= lanes_of(bound);
  }
  return bits_of_lanes(within);
}

[[gnu::always_inline]] inline std::uint32_t leaf_distances(const point_row& leaf, const float_lanes* query,
                                                           float_lanes bound, float* distance) noexcept {
  mask_lanes within[rows_of_lanes];
  for (std::size_t r = 0; r != rows_of_lanes; ++r) {
    const float_lanes d = sum_of_squares_lanes(query[0] - load_lanes(leaf.axis[0].data() + 4 * r),
                                               query[1] - load_lanes(leaf.axis[1].data() + 4 * r),
                                               query[2] - load_lanes(leaf.axis[2].data() + 4 * r));
    std::memcpy(distance + 4 * r, &d, sizeof d);
    within[r] = d <= bound;
  }
  return bits_of_lanes(within);
}

inline std::uint32_t distances_lanes(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                     float* distance) {
  const float_lanes q[3] = {lanes_of(query[0]), lanes_of(query[1]), lanes_of(query[2])};
  return leaf_distances(leaf, q, lanes_of(bound), distance);
}

inline std::size_t in_leaf_lanes(const point_row& leaf, const std::array<float, 3>& query, float bound, float* found) {
  std::array<float, leaf_width> distance;
  const std::uint32_t mask = distances_lanes(leaf, query, bound, distance.data());
  return keep_lanes(distance.data(), mask, found);
}

inline std::size_t near_points_lanes(const point_row* leaves, const nearby_leaves& near,
                                     const std::array<float, 3>& query, float bound, std::uint32_t* /*scratch*/,
                                     float* found, std::size_t capacity) {
  const box3 box{query, query};
  const float_lanes q[3] = {lanes_of(query[0]), lanes_of(query[1]), lanes_of(query[2])};
  const float_lanes border = lanes_of(bound);
  std::array<float, leaf_width> distance;
  std::size_t count = 0;
  for (std::size_t first = 0; first < near.count && count <= capacity; first += leaf_width) {
    std::uint32_t mask = near_boxes_lanes(near.boxes[first / leaf_width], box, bound, distance.data());
    for (; mask != 0 && count <= capacity; mask &= mask - 1) {
      const std::uint32_t leaf = near.leaves[first + static_cast<std::size_t>(std::countr_zero(mask))];
      const std::uint32_t within = leaf_distances(leaves[leaf], q, border, distance.data());
      if (within != 0) count += keep_lanes(distance.data(), within, found + count);
    }
  }
  std::fill_n(found + count, leaf_width, std::numeric_limits<float>::infinity());
  return count;
}

inline nearest_sum sum_nearest_lanes(float* found, std::size_t count, std::size_t wanted, float bound) {
  const auto total = [](mask_lanes n) { return static_cast<std::size_t>((n[0] + n[1]) + (n[2] + n[3])); };
  const auto count_within = [&](float at) {
    mask_lanes n[2] = {};
    for (std::size_t i = 0; i < count; i += 8) {
      n[0] -= load_lanes(found + i) <= lanes_of(at);
      n[1] -= load_lanes(found + i + 4) <= lanes_of(at);
    }
    return total(n[0] + n[1]);
  };
  const auto count_three = [&](const std::array<float, 3>& at) {
    mask_lanes n[3] = {};
    for (std::size_t i = 0; i < count; i += 4) {
      const float_lanes v = load_lanes(found + i);
      for (std::size_t t = 0; t != 3; ++t) n[t] -= v <= lanes_of(at[t]);
    }
    return std::array<std::size_t, 3>{total(n[0]), total(n[1]), total(n[2])};
  };
  const rank_bracket bracket = bracket_rank(bound, count, wanted, count_within, count_three);
  nearest_sum out;
  out.largest_squared = bracket.high;
  if (bracket.at_high - bracket.at_low <= leaf_width) {
    std::array<float, 2 * leaf_width> between{};
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; i += leaf_width) {
      mask_lanes in[rows_of_lanes];
      for (std::size_t r = 0; r != rows_of_lanes; ++r) {
        const float_lanes v = load_lanes(found + i + 4 * r);
        in[r] = (v <= lanes_of(bracket.high)) & (v > lanes_of(bracket.low));
      }
      for (std::uint32_t mask = bits_of_lanes(in); mask != 0; mask &= mask - 1) {
        between[n++] = found[i + static_cast<std::size_t>(std::countr_zero(mask))];
      }
    }
    float* const ranked = between.data() + (wanted - bracket.at_low - 1);
    std::nth_element(between.data(), ranked, between.data() + n);
    out.largest_squared = *ranked;
  }
  // Those below the largest, and the largest as often as it takes.
  std::array<float, leaf_width> smaller;
  std::size_t below = 0;
  for (std::size_t i = 0; i < count; i += leaf_width) {
    mask_lanes in[rows_of_lanes];
    for (std::size_t r = 0; r != rows_of_lanes; ++r) {
      in[r] = load_lanes(found + i + 4 * r) < lanes_of(out.largest_squared);
    }
    const std::size_t n = keep_lanes(found + i, bits_of_lanes(in), smaller.data());
    for (std::size_t s = 0; s != n; ++s) out.roots += std::sqrt(double{smaller[s]});
    below += n;
  }
  out.roots += static_cast<double>(wanted - below) * std::sqrt(double{out.largest_squared});
  return out;
}

}  // namespace orbis::cloud::detail
#else
#define ORBIS_HAS_LANES 0
#endif
