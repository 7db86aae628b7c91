// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The very nearest neighbours of the points of a leaf, all points at once.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Up to how many neighbours `few_nearest` is faster than choosing among candidates, point by point: a longer row pays
/// with as many lanes as a leaf has points.
inline constexpr std::size_t most_few = 4;
[[nodiscard]] inline bool is_few(std::size_t neighbors) noexcept {
  return neighbors <= (simd::best_level() == simd::level::avx512 ? most_few : 2);
}

/// The `Width` nearest other points of each point of a leaf: in row n the squared distances to the n-th nearest, and
/// their indices.
template <std::size_t Width>
struct few_rows {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::array<std::array<float, leaf_width>, Width> squared;
  std::array<std::array<std::uint32_t, leaf_width>, Width> index;  ///< none where too few are within the bound
};

/// Fills `out` for the points [first, last) of leaf `l` from it and from the leaves of `near` within `bound`, squared.
/// Where the last of a row is within `bound`, too, the row is right if `near` has all leaves within `bound` of the
/// point; otherwise its distances are not less than they should be. Those at equal squared distances are in the order
/// of their indices. `none` as the last index: there are too few points, or squared distances overflow, or too many
/// points are as near.
///
/// Three passes: the neighbours within the leaf itself, where the lanes are its points, which costs 16 (8 + 9 Width)
/// operations for as many points as there are lanes; what is as near in other leaves, point by point, where the lanes
/// are those of the other leaf; and that is put into the rows as in the first pass.
template <std::size_t Width>
struct few_nearest {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const leaf_hierarchy& tree, const nearby_leaves& near, std::size_t l,
                                      std::size_t first, std::size_t last, float bound, few_rows<Width>& out) {
    using lanes = simd::native_vec<float, Target>;
    const std::uint32_t active = (1U << last) - (1U << first);
    const auto for_each_block = [&](auto&& f) ORBIS_INLINE_LAMBDA {
      for (std::size_t at = 0; at != leaf_width; at += lanes::count) {
        const auto in = lanes::mask_type::from_bits(active >> at);
        if (simd::any(in)) f(at, in);
      }
    };
    for_each_block([&](std::size_t at, const auto& in) ORBIS_INLINE_LAMBDA {
      sorted_rows<Target> rows{in};
      rows.add_own(tree, l, at);
      rows.store(out, at);
    });
    candidates others;
    std::array<std::int32_t, leaf_width> counts{};
    for (std::size_t i = first; i != last; ++i) {
      counts[i] = others.template find<Target>(tree, near, l, i, std::min(bound, out.squared[Width - 1][i]));
      if (counts[i] <= candidates::most) continue;
      counts[i] = 0;
      out.index[Width - 1][i] = few_rows<Width>::none;
    }
    for_each_block([&](std::size_t at, const auto& in) ORBIS_INLINE_LAMBDA {
      sorted_rows<Target> rows{out, at, in};
      rows.add(others, counts, at);
      rows.store(out, at);
    });
  }

 private:
  /// Indices as signed numbers in the same order, which more processors can compare.
  static constexpr std::uint32_t sign = 0x80000000U;
  static constexpr float infinity = std::numeric_limits<float>::infinity();

  /// For each point of a leaf the points of others that are as near as the last of its row.
  struct candidates {
    static constexpr std::int32_t most = 3 * leaf_width;
    static constexpr std::size_t stride = most + 2 * leaf_width;  // one is written beyond the last, one parts the rows
    alignas(64) std::array<float, leaf_width * stride> squared;
    alignas(64) std::array<std::uint32_t, leaf_width * stride> index;

    /// Finds those of the i-th point, and returns their number; if that is more than `most`, not all.
    template <simd::target Target>
    ORBIS_ALWAYS_INLINE std::int32_t find(const leaf_hierarchy& tree, const nearby_leaves& near, std::size_t l,
                                          std::size_t i, float bound) noexcept {
      using lanes = simd::native_vec<float, Target>;
      using numbers = simd::native_vec<std::uint32_t, Target>;
      const point_row& leaf = tree.leaves[l];
      const spread_point<lanes> q{{leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]}};
      const lanes border = bound;
      float* const found = squared.data() + i * stride;
      std::uint32_t* const which = index.data() + i * stride;
      std::int32_t count = 0;
      for (std::size_t begin = 0; begin < near.count; begin += lanes::count) {
        const auto boxes = (box_distances(near.row(0), begin, q, q) <= border) &
                           (numbers::load(near.leaves.data() + begin) != numbers(static_cast<std::uint32_t>(l)));
        for (std::uint32_t rest = simd::bits(boxes); rest != 0; rest &= rest - 1) {
          if (count > most) return count;
          const std::size_t other = near.leaves[begin + static_cast<std::size_t>(std::countr_zero(rest))];
          const std::uint32_t* const members = tree.members.data() + other * leaf_width;
          for (std::size_t at = 0; at != leaf_width; at += lanes::count) {
            const lanes d = point_distances(tree.leaves[other], at, q);
            const auto within = d <= border;
            if constexpr (lanes::count == 4)
              if (simd::none(within)) continue;
            simd::compress_store(which + count, numbers::load(members + at), within);
            count += static_cast<std::int32_t>(simd::compress_store(found + count, d, within));
          }
        }
      }
      return count;
    }
  };

  /// The rows of as many points as there are lanes, sorted.
  template <simd::target Target>
  struct sorted_rows {
    using lanes = simd::native_vec<float, Target>;
    using numbers = simd::native_vec<std::int32_t, Target>;
    using unsigned_numbers = simd::native_vec<std::uint32_t, Target>;
    using mask = typename lanes::mask_type;

    std::array<lanes, Width> squared;
    std::array<numbers, Width> index;

    /// Empty rows; those that are not active stay so: -1 is less than any squared distance.
    explicit ORBIS_ALWAYS_INLINE sorted_rows(const mask& active) noexcept {
      squared.fill(select(active, lanes(std::numeric_limits<float>::max()), lanes(-1.0F)));
      index.fill(numbers(static_cast<std::int32_t>(few_rows<Width>::none ^ sign)));
    }
    ORBIS_ALWAYS_INLINE sorted_rows(const few_rows<Width>& from, std::size_t at, const mask& active) noexcept {
      for (std::size_t n = 0; n != Width; ++n) {
        squared[n] = select(active, lanes::load(from.squared[n].data() + at), lanes(-1.0F));
        index[n] =
            simd::bits_as<std::int32_t>(unsigned_numbers::load(from.index[n].data() + at) ^ unsigned_numbers(sign));
      }
    }
    /// The points of the leaf of the rows' points, each but into its own row.
    ORBIS_ALWAYS_INLINE void add_own(const leaf_hierarchy& tree, std::size_t l, std::size_t at) noexcept {
      const point_row& leaf = tree.leaves[l];
      const std::uint32_t* const members = tree.members.data() + l * leaf_width;
      const lanes x = lanes::load(leaf.axis[0].data() + at), y = lanes::load(leaf.axis[1].data() + at),
                  z = lanes::load(leaf.axis[2].data() + at);
      const std::size_t size = tree.size_of(l);
      for (std::size_t i = 0; i != size; ++i) {
        const lanes d =
            sum_of_squares(x - lanes(leaf.axis[0][i]), y - lanes(leaf.axis[1][i]), z - lanes(leaf.axis[2][i]));
        const auto self = numbers::iota() == numbers(static_cast<std::int32_t>(i) - static_cast<std::int32_t>(at));
        insert(select(self, lanes(infinity), d), numbers(static_cast<std::int32_t>(members[i] ^ sign)));
      }
    }
    ORBIS_ALWAYS_INLINE void add(const candidates& others, const std::array<std::int32_t, leaf_width>& counts,
                                 std::size_t at) noexcept {
      const numbers number = numbers::load(counts.data() + at);
      const std::int32_t columns = simd::greatest(number);
      const numbers begin = (numbers::iota() + numbers(static_cast<std::int32_t>(at))) *
                            numbers(static_cast<std::int32_t>(candidates::stride));
      for (std::int32_t i = 0; i < columns; ++i) {
        const mask there = numbers(i) < number;
        const lanes d = simd::gather(others.squared.data() + i, begin, there, lanes(infinity));
        const unsigned_numbers which = simd::gather(others.index.data() + i, begin, there, unsigned_numbers(0U));
        insert(d, simd::bits_as<std::int32_t>(which ^ unsigned_numbers(sign)));
      }
    }
    ORBIS_ALWAYS_INLINE void store(few_rows<Width>& out, std::size_t at) const noexcept {
      for (std::size_t n = 0; n != Width; ++n) {
        squared[n].store(out.squared[n].data() + at);
        (simd::bits_as<std::uint32_t>(index[n]) ^ unsigned_numbers(sign)).store(out.index[n].data() + at);
      }
    }

   private:
    ORBIS_ALWAYS_INLINE void insert(const lanes& distances, const numbers& indices) noexcept {
      lanes d = distances;
      numbers which = indices;
      for (std::size_t n = 0; n != Width; ++n) {
        const mask less = (d < squared[n]) | ((d == squared[n]) & (which < index[n]));
        const lanes nearer = select(less, d, squared[n]);
        const numbers nearer_index = select(less, which, index[n]);
        if (n + 1 != Width) {
          d = select(less, squared[n], d);
          which = select(less, index[n], which);
        }
        squared[n] = nearer;
        index[n] = nearer_index;
      }
    }
  };
};

template <std::size_t Width>
using few_nearest_code = void(const leaf_hierarchy&, const nearby_leaves&, std::size_t, std::size_t, std::size_t, float,
                              few_rows<Width>&);
/// For the best instruction set.
template <std::size_t Width>
[[nodiscard]] few_nearest_code<Width>* few_nearest_kernel() noexcept {
  return simd::kernel<few_nearest<Width>, few_nearest_code<Width>>();
}

}  // namespace orbis::cloud::detail

ORBIS_COMPILED_KERNEL(orbis::cloud::detail::few_nearest<1>, orbis::cloud::detail::few_nearest_code<1>);
ORBIS_COMPILED_KERNEL(orbis::cloud::detail::few_nearest<2>, orbis::cloud::detail::few_nearest_code<2>);
ORBIS_COMPILED_KERNEL(orbis::cloud::detail::few_nearest<3>, orbis::cloud::detail::few_nearest_code<3>);
ORBIS_COMPILED_KERNEL(orbis::cloud::detail::few_nearest<4>, orbis::cloud::detail::few_nearest_code<4>);
