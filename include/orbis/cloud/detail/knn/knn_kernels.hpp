// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Inner loops of the all-points neighbour search.
///
/// Distances to boxes are computed by the same operations in the same order as distances to points. Rounding is
/// monotonic, so the distance to a box never exceeds that to a point in the box, and rounding loses no neighbour.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <type_traits>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/rank_bracket.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Allocates at cache-line boundaries. On many processors, a stored vector that straddles two cache lines cannot be
/// read again until it has reached the cache. Rows whose first vectors are read soon after they are written therefore
/// begin at a cache line.
template <class T>
struct line_allocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};
  static_assert(alignof(T) <= 64);
  line_allocator() = default;
  template <class U>
  line_allocator(const line_allocator<U>&) noexcept {}  // NOLINT(google-explicit-constructor)
  [[nodiscard]] T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), line)); }
  void deallocate(T* p, std::size_t) noexcept { ::operator delete(p, line); }
  template <class U>
  bool operator==(const line_allocator<U>&) const noexcept {
    return true;
  }
};

template <class T>
using line_vector = std::vector<T, line_allocator<T>>;

/// Boxes in structure-of-arrays layout: the coordinates of the low corners along axis a begin at `first + a * stride`,
/// those of the high corners three strides later.
struct box_axes {
  const float* first;
  std::size_t stride;
  box_axes(const float* from, std::size_t distance) noexcept : first{from}, stride{distance} {}
  box_axes(const box_row& row) noexcept  // NOLINT(google-explicit-constructor)
      : first{row.low[0].data()}, stride{leaf_width} {
    static_assert(sizeof(box_row) == 6 * leaf_width * sizeof(float));
  }
};

/// The leaves, or the rows of leaves, near a group of queries, with their boxes.
struct nearby_leaves {
  explicit nearby_leaves(std::size_t most)
      : stride{(most / leaf_width + 2) * leaf_width}, boxes(6 * stride), leaves(stride) {}
  std::size_t stride;
  line_vector<float> boxes;  ///< in the layout of `box_axes`
  line_vector<std::uint32_t> leaves;
  std::size_t count = 0;
  /// Returns true if another row of children fits.
  [[nodiscard]] bool has_room() const noexcept { return count + 2 * leaf_width <= stride; }
  /// Returns sixteen boxes. @pre first is a multiple of sixteen
  [[nodiscard]] box_axes row(std::size_t first) const noexcept { return {boxes.data() + first, stride}; }
  /// Pads the last row with boxes at infinity.
  void finish() noexcept {
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (std::size_t i = count; i % leaf_width != 0; ++i) {
      for (std::size_t a = 0; a != 3; ++a) {
        boxes[a * stride + i] = inf;
        boxes[(a + 3) * stride + i] = -inf;
      }
    }
  }
};

/// The maximum of the `wanted` smallest squared distances in a list, and the sum of their square roots.
struct nearest_sum {
  double roots = 0;           ///< sum of the roots, with relative error up to `roots_slack`; negative if unknown
  float largest_squared = 0;  ///< the `wanted`-th smallest squared distance
};

/// Upper bound on the relative error of `nearest_sum::roots`: the error of roots from Newton's method and of
/// corrections summed in float.
[[nodiscard]] inline double roots_slack(std::size_t wanted) noexcept {
  return 0x1p-40 + 0x1p-46 * static_cast<double>(wanted);
}

/// `(x^2 + y^2) + z^2`, each operation rounded: the vectorised `squared_distance`.
template <simd::vector V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V sum_of_squares(const V& x, const V& y, const V& z) noexcept {
  return (x * x + y * y) + z * z;
}

/// A point or the corner of a box, with each coordinate broadcast to all lanes.
template <simd::vector V>
struct spread_point {
  V x, y, z;
  explicit ORBIS_ALWAYS_INLINE spread_point(const std::array<float, 3>& p) noexcept : x(p[0]), y(p[1]), z(p[2]) {}
};

/// Squared distances between the boxes `at`, `at + 1`, ... and the box from `low` to `high`.
template <simd::vector V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V box_distances(const box_axes& boxes, std::size_t at, const spread_point<V>& low,
                                                  const spread_point<V>& high) noexcept {
  const auto gap = [&](std::size_t a, const V& from, const V& to) ORBIS_INLINE_LAMBDA {
    return max(V(0.0F), max(V::load(boxes.first + a * boxes.stride + at) - to,
                            from - V::load(boxes.first + (a + 3) * boxes.stride + at)));
  };
  return sum_of_squares(gap(0, low.x, high.x), gap(1, low.y, high.y), gap(2, low.z, high.z));
}
/// Squared distances between the points `at`, `at + 1`, ... of a leaf and `q`.
template <simd::vector V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V point_distances(const point_row& leaf, std::size_t at,
                                                    const spread_point<V>& q) noexcept {
  return sum_of_squares(q.x - V::load(leaf.axis[0].data() + at), q.y - V::load(leaf.axis[1].data() + at),
                        q.z - V::load(leaf.axis[2].data() + at));
}

/// Computes the squared distances from a box to sixteen other boxes; returns a bit mask of the boxes within `bound`.
struct near_boxes {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::uint32_t run(const box_axes& boxes, const box3& query, float bound, float* distance) {
    using lanes = simd::native_vec<float, Target>;
    const spread_point<lanes> low{query.low}, high{query.high};
    std::uint32_t within = 0;
    for (std::size_t at = 0; at != leaf_width; at += lanes::count) {
      const lanes d = box_distances(boxes, at, low, high);
      d.store(distance + at);
      within |= simd::bits(d <= lanes(bound)) << at;
    }
    return within;
  }
};

/// Computes the squared distances from a point to the points of a leaf; returns a bit mask of the distances within
/// `bound`.
struct leaf_distances {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::uint32_t run(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                               float* distance) {
    using lanes = simd::native_vec<float, Target>;
    const spread_point<lanes> q{query};
    std::uint32_t within = 0;
    for (std::size_t at = 0; at != leaf_width; at += lanes::count) {
      const lanes d = point_distances(leaf, at, q);
      d.store(distance + at);
      within |= simd::bits(d <= lanes(bound)) << at;
    }
    return within;
  }
};

/// Writes contiguously the squared distances within `bound` from a point to the points of a leaf; returns their number.
/// The output must have room for sixteen values.
struct near_in_leaf {
  template <simd::vector V>
  static ORBIS_ALWAYS_INLINE std::size_t keep(const point_row& leaf, const spread_point<V>& q, const V& bound,
                                              float* found) noexcept {
    std::size_t count = 0;
    for (std::size_t at = 0; at != leaf_width; at += V::count) {
      const V d = point_distances(leaf, at, q);
      const auto within = d <= bound;
      if constexpr (V::count == 4)
        if (simd::none(within)) continue;  // compressing lanes is slow
      count += simd::compress_store(found + count, d, within);
    }
    return count;
  }
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::size_t run(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                             float* found) {
    using lanes = simd::native_vec<float, Target>;
    return keep(leaf, spread_point<lanes>{query}, lanes(bound), found);
  }
};

/// Writes the indices of the leaves of `near` whose boxes are within `bound` of a point; returns their number. The
/// output must have room for sixteen more values.
struct chosen_leaves {
  template <simd::vector V, simd::vector Numbers>
  static ORBIS_ALWAYS_INLINE std::size_t find(const nearby_leaves& near, const spread_point<V>& q, const V& bound,
                                              std::uint32_t* chosen) noexcept {
    std::size_t count = 0;
    for (std::size_t first = 0; first < near.count; first += V::count) {
      const auto within = box_distances(near.row(0), first, q, q) <= bound;
      if constexpr (V::count == 4)
        if (simd::none(within)) continue;
      count += simd::compress_store(chosen + count, Numbers::load(near.leaves.data() + first), within);
    }
    return count;
  }
};

/// Writes the squared distances within `bound` from a point to the points of the chosen leaves, followed by sixteen
/// infinities. Returns their number. Ends early if there are more than `capacity`; writes at most `capacity + 3 *
/// leaf_width` values.
struct near_in_leaves {
  template <simd::vector V>
  static ORBIS_ALWAYS_INLINE std::size_t collect(const point_row* leaves, const std::uint32_t* chosen,
                                                 std::size_t number, const spread_point<V>& q, const V& bound,
                                                 float* found, std::size_t capacity) noexcept {
    std::size_t count = 0;
    for (std::size_t i = 0; i != number; ++i) {
      count += near_in_leaf::keep(leaves[chosen[i]], q, bound, found + count);
      if (count > capacity) break;
    }
    simd::vec<float, leaf_width, typename V::target_type>(std::numeric_limits<float>::infinity()).store(found + count);
    return count;
  }
};

/// Like `near_in_leaves`; also writes the corresponding places in `leaf_hierarchy::members`.
struct places_in_leaves {
  template <simd::vector V>
  static ORBIS_ALWAYS_INLINE std::size_t collect(const point_row* leaves, const std::uint32_t* chosen,
                                                 std::size_t number, const spread_point<V>& q, const V& bound,
                                                 float* found, std::uint32_t* places, std::size_t capacity) noexcept {
    using numbers = simd::native_vec<std::uint32_t, typename V::target_type>;
    std::size_t count = 0;
    for (std::size_t i = 0; i != number && count <= capacity; ++i) {
      const point_row& leaf = leaves[chosen[i]];
      for (std::size_t at = 0; at != leaf_width; at += V::count) {
        const V d = point_distances(leaf, at, q);
        const auto within = d <= bound;
        if constexpr (V::count == 4)
          if (simd::none(within)) continue;
        const numbers place = numbers::iota() + numbers(chosen[i] * static_cast<std::uint32_t>(leaf_width) +
                                                        static_cast<std::uint32_t>(at));
        simd::compress_store(places + count, place, within);
        count += simd::compress_store(found + count, d, within);
      }
    }
    simd::vec<float, leaf_width, typename V::target_type>(std::numeric_limits<float>::infinity()).store(found + count);
    return count;
  }
};

/// Applies `near_in_leaves` or, with `places`, `places_in_leaves` to the points [first, last) of a leaf and the leaves
/// of `near` whose boxes are within `bound` of them. The rows in `found` and `places` are `stride` long; `counts`
/// receives their numbers of entries. `scratch`: sixteen rows, each longer than `near.leaves` by sixteen. Works in two
/// passes, so that data written for a point in the first pass has reached the cache when the second pass reads it.
struct near_in_leaves_each {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const point_row* leaves, const nearby_leaves& near, const point_row& points,
                                      std::size_t first, std::size_t last, float bound, std::uint32_t* scratch,
                                      float* found, std::uint32_t* places, std::size_t stride, std::size_t capacity,
                                      std::uint32_t* counts) {
    using lanes = simd::native_vec<float, Target>;
    using numbers = simd::native_vec<std::uint32_t, Target>;
    const std::size_t length = near.leaves.size() + leaf_width;
    const lanes border = bound;
    const auto point = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
      return spread_point<lanes>{{points.axis[0][i], points.axis[1][i], points.axis[2][i]}};
    };
    for (std::size_t i = first; i != last; ++i)
      counts[i] =
          static_cast<std::uint32_t>(chosen_leaves::find<lanes, numbers>(near, point(i), border, scratch + i * length));
    for (std::size_t i = first; i != last; ++i) {
      const std::uint32_t* const chosen = scratch + i * length;
      float* const row = found + i * stride;
      counts[i] = static_cast<std::uint32_t>(
          places == nullptr ? near_in_leaves::collect(leaves, chosen, counts[i], point(i), border, row, capacity)
                            : places_in_leaves::collect(leaves, chosen, counts[i], point(i), border, row,
                                                        places + i * stride, capacity));
    }
  }
};

/// Counts the lanes that are set.
template <simd::target Target>
class lane_counter {
 public:
  using lanes = simd::native_vec<float, Target>;
  ORBIS_ALWAYS_INLINE void add(const typename lanes::mask_type& m) noexcept {
    if constexpr (Target::needs == simd::level::portable)
      count_ -= select(m, numbers(-1), numbers(0));  // needs no population count
    else
      count_ += simd::popcount(m);
  }
  [[nodiscard]] ORBIS_ALWAYS_INLINE std::size_t total() const noexcept {
    if constexpr (Target::needs == simd::level::portable)
      return static_cast<std::size_t>(simd::sum(count_));
    else
      return count_;
  }

 private:
  using numbers = simd::native_vec<std::int32_t, Target>;
  std::conditional_t<Target::needs == simd::level::portable, numbers, std::size_t> count_ = 0;
};

/// Computes the sum of the square roots of the `wanted` smallest squared distances, and the largest of these squares.
/// @pre 0 < wanted <= count; no squared distance exceeds `bound`; the distances are padded with sixteen infinite values
struct sum_nearest {
  /// Adds -1 to the lanes of `count` in which `v` is greater than `other`.
  template <simd::vector V, simd::vector Numbers>
  static ORBIS_ALWAYS_INLINE void count_smaller(Numbers& count, float other, const V& v) noexcept {
    if constexpr (V::is_native)
      count = select(V(other) < v, count - Numbers(1), count);  // one masked instruction
    else
      count += select(V(other) < v, Numbers(-1), Numbers(0));
  }
  /// Returns the `rank`-th smallest (from 1) of sixteen values by counting, for each value, the smaller ones.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE float ranked(const float* values, std::size_t rank) noexcept {
    using lanes = simd::vec<float, leaf_width, Target>;
    using numbers = simd::vec<std::int32_t, leaf_width, Target>;
    const lanes v = lanes::load(values);
    numbers even = 0, odd = 0;  // for each value, the negated number of smaller values
    for (std::size_t i = 0; i != leaf_width; i += 2) {
      count_smaller(even, values[i], v);
      count_smaller(odd, values[i + 1], v);
    }
    return simd::greatest(select(even + odd > numbers(-static_cast<std::int32_t>(rank)), v, lanes(0.0F)));
  }
  /// Returns the `rank`-th smallest of thirty-two values; the values at index `count` and above are infinite.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE float ranked_of_two(const float* values, std::size_t count, std::size_t rank) noexcept {
    using lanes = simd::vec<float, leaf_width, Target>;
    using numbers = simd::vec<std::int32_t, leaf_width, Target>;
    const lanes v0 = lanes::load(values), v1 = lanes::load(values + leaf_width);
    numbers smaller0 = 0, smaller1 = 0;
    for (std::size_t i = 0; i < count; i += 4) {
      for (std::size_t k = i; k != i + 4; ++k) {
        count_smaller(smaller0, values[k], v0);
        count_smaller(smaller1, values[k], v1);
      }
    }
    const numbers least = -static_cast<std::int32_t>(rank);
    const lanes zero = 0.0F;
    return simd::greatest(max(select(smaller0 > least, v0, zero), select(smaller1 > least, v1, zero)));
  }

  /// Adds the roots of the lanes of `v` selected by `in`, in double. With fused multiply-add, the roots have twice the
  /// precision of float: s = v / sqrt(v) by Newton's method, and the remainder v - s^2 as a correction. `tiny` marks
  /// lanes whose remainders would underflow.
  template <simd::target Target>
  struct root_sum {
    using lanes = simd::native_vec<float, Target>;
    using mask = typename lanes::mask_type;
    simd::vec<double, lanes::count / 2, Target> low = 0.0, high = 0.0;  // sums of the lower and the upper lanes
    lanes corrections = 0.0F;
    mask tiny = mask::first(0);

    ORBIS_ALWAYS_INLINE void add(const lanes& all, const mask& in) noexcept {
      if constexpr (Target::needs < simd::level::avx2) {
        const lanes v = select(in, all, lanes(0.0F));
        low += simd::sqrt(simd::convert<double>(v.low()));
        high += simd::sqrt(simd::convert<double>(v.high()));
      } else {
        const lanes zero = 0.0F, half = 0.5F, three_halves = 1.5F;
        const mask usual = in & (all >= lanes(0x1p-70F));
        tiny = tiny | (simd::and_not(in, usual) & (all > zero));
        const lanes v = select(usual, all, zero);
        // The initial value halves and negates the exponent; each step squares the error.
        using bits = simd::native_vec<std::int32_t, Target>;
        const lanes half_v = half * v;
        lanes y = simd::bits_as<float>(bits(0x5f375a86) - (simd::bits_as<std::int32_t>(v) >> 1));
        y = y * (three_halves - (half_v * y) * y);
        y = y * (three_halves - (half_v * y) * y);
        y = simd::approximate_multiply_add(y, simd::approximate_multiply_add(-(half_v * y), y, half), y);
        const lanes s = v * y;
        corrections = simd::approximate_multiply_add(simd::approximate_multiply_add(-s, s, v), half * y, corrections);
        low += simd::convert<double>(s.low());
        high += simd::convert<double>(s.high());
      }
    }
    /// Returns the sum; negative if it is unknown.
    [[nodiscard]] ORBIS_ALWAYS_INLINE double total() const noexcept {
      if (simd::any(tiny)) return -1.0;
      return simd::sum((low + simd::convert<double>(corrections.low())) +
                       (high + simd::convert<double>(corrections.high())));
    }
  };

  /// Adds the root of the largest squared distance `times` times to a sum of roots; returns the result, negative if the
  /// sum is unknown.
  static ORBIS_ALWAYS_INLINE double with_largest(double roots, std::size_t times, float largest_squared) noexcept {
    return roots < 0 ? -1.0 : roots + static_cast<double>(times) * std::sqrt(static_cast<double>(largest_squared));
  }

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE nearest_sum run(const float* found, std::size_t count, std::size_t wanted, float bound) {
    using lanes = simd::native_vec<float, Target>;
    const auto count_within = [&](float at) ORBIS_INLINE_LAMBDA {
      lane_counter<Target> n;
      for (std::size_t i = 0; i < count; i += lanes::count) n.add(lanes::load(found + i) <= lanes(at));
      return n.total();
    };
    const auto count_three = [&](const std::array<float, 3>& at) ORBIS_INLINE_LAMBDA {
      lane_counter<Target> n0, n1, n2;
      const lanes at0 = at[0], at1 = at[1], at2 = at[2];
      for (std::size_t i = 0; i < count; i += lanes::count) {
        const lanes v = lanes::load(found + i);
        n0.add(v <= at0);
        n1.add(v <= at1);
        n2.add(v <= at2);
      }
      return std::array<std::size_t, 3>{n0.total(), n1.total(), n2.total()};
    };
    const auto largest = [&]() ORBIS_INLINE_LAMBDA {
      if (count <= leaf_width) return ranked<Target>(found, wanted);
      // With fewer lanes, or if there are usually more values, guessing is faster.
      if constexpr (lanes::count == leaf_width)
        if (wanted <= leaf_width && count <= 2 * leaf_width) return ranked_of_two<Target>(found, count, wanted);
      const rank_bracket bracket = bracket_rank(bound, count, wanted, count_within, count_three);
      if (bracket.at_high - bracket.at_low > leaf_width) return bracket.high;
      std::array<float, 2 * leaf_width> between;
      std::size_t n = 0;
      for (std::size_t i = 0; i < count; i += lanes::count) {
        const lanes v = lanes::load(found + i);
        const auto in = (v <= lanes(bracket.high)) & (v > lanes(bracket.low));
        if constexpr (lanes::count == 4)
          if (simd::none(in)) continue;
        n += simd::compress_store(between.data() + n, v, in);
      }
      simd::vec<float, leaf_width, Target>(std::numeric_limits<float>::infinity()).store(between.data() + n);
      return ranked<Target>(between.data(), wanted - bracket.at_low);
    };
    nearest_sum out;
    out.largest_squared = largest();
    // Sums the values below the largest, and the largest value repeated up to `wanted` values.
    root_sum<Target> roots;
    lane_counter<Target> smaller;
    for (std::size_t i = 0; i < count; i += lanes::count) {
      const lanes v = lanes::load(found + i);
      const auto in = v < lanes(out.largest_squared);
      smaller.add(in);
      roots.add(v, in);
    }
    out.roots = with_largest(roots.total(), wanted - smaller.total(), out.largest_squared);
    return out;
  }
};

/// Applies `sum_nearest` to the points [first, last) of a leaf, whose rows in `found` are `stride` long; skips points
/// with fewer than `wanted` distances.
struct sum_nearest_each {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* found, std::size_t stride, std::size_t first, std::size_t last,
                                      const std::uint32_t* counts, std::size_t wanted, const float* bounds,
                                      nearest_sum* out) {
    std::uint32_t left = (1U << last) - (1U << first);
    if constexpr (simd::native_vec<float, Target>::count == leaf_width)
      if (wanted <= leaf_width) left = sum_few<Target>(found, stride, left, counts, wanted, out);
    for (; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      if (counts[i] >= wanted) out[i] = sum_nearest::run<Target>(found + i * stride, counts[i], wanted, bounds[i]);
    }
  }

 private:
  /// Handles the points that have at most 32 distances, which fit into two registers. The distances below the
  /// `wanted`-th smallest fit into one, because `wanted` is at most 16. Each of the two loops has a high latency for
  /// one point but a high throughput for several points in sequence. Returns the mask of the remaining points.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::uint32_t sum_few(const float* found, std::size_t stride, std::uint32_t points,
                                                   const std::uint32_t* counts, std::size_t wanted, nearest_sum* out) {
    using lanes = simd::native_vec<float, Target>;
    std::array<std::array<float, 2 * leaf_width>, leaf_width> smaller;
    std::array<std::uint32_t, leaf_width> number;
    std::uint32_t few = 0;
    for (std::uint32_t rest = points; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest));
      const float* const row = found + i * stride;
      if (counts[i] < wanted || counts[i] > 2 * leaf_width) continue;
      few |= 1U << i;
      const bool is_one = counts[i] <= leaf_width;
      const float largest = is_one ? sum_nearest::ranked<Target>(row, wanted)
                                   : sum_nearest::ranked_of_two<Target>(row, counts[i], wanted);
      out[i].largest_squared = largest;
      const lanes v = lanes::load(row);
      std::size_t n = simd::compress_store(smaller[i].data(), v, v < lanes(largest));
      if (!is_one) {
        const lanes w = lanes::load(row + leaf_width);
        n += simd::compress_store(smaller[i].data() + n, w, w < lanes(largest));
      }
      number[i] = static_cast<std::uint32_t>(n);
    }
    for (std::uint32_t rest = few; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest));
      sum_nearest::root_sum<Target> roots;
      roots.add(lanes::load(smaller[i].data()), lanes::mask_type::first(number[i]));
      out[i].roots = sum_nearest::with_largest(roots.total(), wanted - number[i], out[i].largest_squared);
    }
    return points & ~few;
  }
};

/// Returns the `rank`-th smallest (from 1) of sixteen non-negative values.
struct ranked_of_leaf {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE float run(const float* values, std::size_t rank) {
    return sum_nearest::ranked<Target>(values, rank);
  }
};

/// Appends to `near` those of sixteen boxes that the bits of `wanted` select. `first`: the index of the leaf, or of the
/// row of leaves, in the first of the sixteen boxes.
struct gather_leaves {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const box_row& boxes, std::uint32_t wanted, std::uint32_t first,
                                      nearby_leaves& near) {
    using lanes = simd::native_vec<float, Target>;
    using numbers = simd::native_vec<std::uint32_t, Target>;
    float* const to = near.boxes.data();
    if constexpr (Target::needs == simd::level::portable) {  // the portable target compresses lanes one by one
      for (; wanted != 0; wanted &= wanted - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(wanted));
        for (std::size_t a = 0; a != 3; ++a) {
          to[a * near.stride + near.count] = boxes.low[a][i];
          to[(a + 3) * near.stride + near.count] = boxes.high[a][i];
        }
        near.leaves[near.count++] = first + static_cast<std::uint32_t>(i);
      }
    } else {
      for (std::size_t at = 0; at != leaf_width; at += lanes::count) {
        const auto in = lanes::mask_type::from_bits(wanted >> at);
        for (std::size_t a = 0; a != 3; ++a) {
          simd::compress_store(to + a * near.stride + near.count, lanes::load(boxes.low[a].data() + at), in);
          simd::compress_store(to + (a + 3) * near.stride + near.count, lanes::load(boxes.high[a].data() + at), in);
        }
        const numbers leaf = numbers::iota() + numbers(first + static_cast<std::uint32_t>(at));
        near.count += simd::compress_store(near.leaves.data() + near.count, leaf, in);
      }
    }
  }
};

/// The loops, compiled for the best available instruction set.
template <class = void>
struct basic_knn_kernels {
  using point = std::array<float, 3>;
  using boxes_code = std::uint32_t(const box_axes&, const box3&, float, float*);
  using gather_code = void(const box_row&, std::uint32_t, std::uint32_t, nearby_leaves&);
  using leaf_code = std::size_t(const point_row&, const point&, float, float*);
  using distances_code = std::uint32_t(const point_row&, const point&, float, float*);
  using each_code = void(const point_row*, const nearby_leaves&, const point_row&, std::size_t, std::size_t, float,
                         std::uint32_t*, float*, std::uint32_t*, std::size_t, std::size_t, std::uint32_t*);
  using sums_code = void(const float*, std::size_t, std::size_t, std::size_t, const std::uint32_t*, std::size_t,
                         const float*, nearest_sum*);
  using rank_code = float(const float*, std::size_t);

  boxes_code* near_boxes = simd::kernel<detail::near_boxes, boxes_code>();
  gather_code* gather = simd::kernel<gather_leaves, gather_code>();
  each_code* near_points_of_each = simd::kernel<near_in_leaves_each, each_code>();
  leaf_code* in_leaf = simd::kernel<near_in_leaf, leaf_code>();
  distances_code* distances = simd::kernel<leaf_distances, distances_code>();
  sums_code* sums_of_each = simd::kernel<sum_nearest_each, sums_code>();
  rank_code* ranked = simd::kernel<ranked_of_leaf, rank_code>();

  /// Applies `near_points_of_each` to one point and returns its count. `scratch`: longer than `near.leaves` by sixteen.
  [[nodiscard]] std::size_t near_point(const point_row* leaves, const nearby_leaves& near, const point& query,
                                       float bound, std::uint32_t* scratch, float* found, std::uint32_t* places,
                                       std::size_t capacity) const {
    point_row row{};
    for (std::size_t a = 0; a != 3; ++a) row.axis[a][0] = query[a];
    std::uint32_t count = 0;
    near_points_of_each(leaves, near, row, 0, 1, bound, scratch, found, places, 0, capacity, &count);
    return count;
  }
  /// Applies `sums_of_each` to one point. @pre same as for `detail::sum_nearest`
  [[nodiscard]] nearest_sum sum_nearest(const float* found, std::size_t count, std::size_t wanted, float bound) const {
    const auto counted = static_cast<std::uint32_t>(count);
    nearest_sum out;
    sums_of_each(found, 0, 0, 1, &counted, wanted, &bound, &out);
    return out;
  }
};
using knn_kernels = basic_knn_kernels<>;

}  // namespace orbis::cloud::detail
