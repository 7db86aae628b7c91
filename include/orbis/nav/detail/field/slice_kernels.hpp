// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Kernels of the distance field, which process slices of 8x8 voxels of one brick.
///
/// Values are squared distances in voxels or `far_away`. A *source* offers a target voxel its own value plus the square
/// of the distance between them; the value of a target is the smallest offer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/nav/detail/field/slice_code.hpp>

namespace orbis::nav::detail {

template <class Target>
using slice_lanes = simd::vec<std::uint16_t, 64, Target>;

/// Sets `offer` to `from` where `from` is less than `other`, and to `no_offer` elsewhere.
struct choose_offer_kernel {
  using signature = void(const std::uint16_t* from, const std::uint16_t* other, slice_offer* offer);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint16_t* from, const std::uint16_t* other, slice_offer* offer) {
    using V = slice_lanes<Target>;
    const V a = V::load(from);
    const V chosen = select(a < V::load(other), a, V(no_offer));
    chosen.store(offer->value.data());
    offer->least = simd::least(chosen);
  }
};

/// Finds those of eight consecutive slices (`targets`; `tops`: the largest value of each) that contain a value equal to
/// the source's offer; returns them as bits. `from`: distance of the source from the first slice, in slices. Examines
/// slices [first, last] except those in `skip`.
struct equal_slices_kernel {
  using signature = unsigned(const std::uint16_t* targets, const std::uint16_t* tops, const slice_offer* offer,
                             int from, int first, int last, unsigned skip);
  template <class Target>
  static ORBIS_ALWAYS_INLINE unsigned run(const std::uint16_t* targets, const std::uint16_t* tops,
                                          const slice_offer* offer, int from, int first, int last, unsigned skip) {
    using V = slice_lanes<Target>;
    const V value = V::load(offer->value.data());
    unsigned found = 0;
    for (int t = first; t <= last; ++t) {
      const int square = (t - from) * (t - from);
      if ((skip >> t & 1U) != 0 || offer->least + square > tops[t]) continue;
      if (any(V::load(targets + 64 * t) == value + V(static_cast<std::uint16_t>(square)))) found |= 1U << t;
    }
    return found;
  }
};

/// For the same slices as `equal_slices_kernel`: lowers values to the source's offer where it is less and at most
/// `bound`; updates `tops`.
struct lower_slices_kernel {
  using signature = void(std::uint16_t* targets, std::uint16_t* tops, const slice_offer* offer, int from, int first,
                         int last, unsigned skip, std::uint16_t bound);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint16_t* targets, std::uint16_t* tops, const slice_offer* offer, int from,
                                      int first, int last, unsigned skip, std::uint16_t bound) {
    using V = slice_lanes<Target>;
    const V value = V::load(offer->value.data());
    for (int t = first; t <= last; ++t) {
      const int square = (t - from) * (t - from);
      if ((skip >> t & 1U) != 0 || offer->least + square >= tops[t]) continue;
      const V offered = value + V(static_cast<std::uint16_t>(square));
      const V now = min(V::load(targets + 64 * t), select(offered <= V(bound), offered, V(far_away)));
      now.store(targets + 64 * t);
      tops[t] = simd::greatest(now);
    }
  }
};

/// Returns true if any value of the slice equals `offer` plus `squares`.
struct equal_rows_kernel {
  using signature = bool(const std::uint16_t* target, const slice_offer* offer, const std::uint16_t* squares);
  template <class Target>
  static ORBIS_ALWAYS_INLINE bool run(const std::uint16_t* target, const slice_offer* offer,
                                      const std::uint16_t* squares) {
    using V = slice_lanes<Target>;
    return any(V::load(target) == V::load(offer->value.data()) + V::load(squares));
  }
};

/// Writes a copy of the slice to `lowered`, with values lowered to `offer` plus `squares` where that is less and at
/// most `bound`, and its largest value to `top`. Returns false, and writes nothing, if no value is lowered.
struct lower_rows_kernel {
  using signature = bool(const std::uint16_t* target, const slice_offer* offer, const std::uint16_t* squares,
                         std::uint16_t bound, std::uint16_t* lowered, std::uint16_t* top);
  template <class Target>
  static ORBIS_ALWAYS_INLINE bool run(const std::uint16_t* target, const slice_offer* offer,
                                      const std::uint16_t* squares, std::uint16_t bound, std::uint16_t* lowered,
                                      std::uint16_t* top) {
    using V = slice_lanes<Target>;
    const V before = V::load(target);
    const V offered = V::load(offer->value.data()) + V::load(squares);
    const auto less = (offered < before) & (offered <= V(bound));
    if (!any(less)) return false;
    const V now = select(less, offered, before);
    now.store(lowered);
    *top = simd::greatest(now);
    return true;
  }
};

/// Lowers `best` to the smallest offer of eight rows of distances along x (`rows`: 64 bytes; 255 means `far_away`)
/// where that is less. `squares - 8 * i`: squared distances of row i to the rows of the target. Returns the largest
/// value in `best`.
struct add_rows_kernel {
  using signature = std::uint16_t(std::uint16_t* best, const std::uint8_t* rows, const std::uint16_t* squares);
  template <class Target>
  static ORBIS_ALWAYS_INLINE std::uint16_t run(std::uint16_t* best, const std::uint8_t* rows,
                                               const std::uint16_t* squares) {
    using V = slice_lanes<Target>;
    using row = simd::vec<std::uint16_t, 8, Target>;
    V all = V::load(best);
    for (int i = 0; i != 8; ++i) {
      std::array<std::uint16_t, 8> square;
      unsigned least = far_away;
      for (std::size_t x = 0; x != 8; ++x) {
        const unsigned d = rows[8 * i + static_cast<int>(x)];
        square[x] = static_cast<std::uint16_t>(d == 255 ? unsigned{far_away} : d * d);
        least = least < square[x] ? least : square[x];
      }
      if (least == far_away) continue;
      const row r = row::load(square.data());
      const simd::vec<std::uint16_t, 16, Target> two{r, r};
      const simd::vec<std::uint16_t, 32, Target> four{two, two};
      all = min(all, V{four, four} + V::load(squares - 8 * i));
    }
    all.store(best);
    return simd::greatest(all);
  }
};

/// Computes a slice: the minimum of `own` and the offers of the slices before and after it, `below[i]` and `above[i]`
/// at distance i + 1 (null: no slice). Values greater than `bound` become `far_away`. Returns the largest value.
struct combine_slices_kernel {
  using signature = std::uint16_t(const std::uint16_t* own, const std::uint16_t* const* below,
                                  const std::uint16_t* const* above, int count, std::uint16_t bound,
                                  std::uint16_t* out);
  template <class Target>
  static ORBIS_ALWAYS_INLINE std::uint16_t run(const std::uint16_t* own, const std::uint16_t* const* below,
                                               const std::uint16_t* const* above, int count, std::uint16_t bound,
                                               std::uint16_t* out) {
    using V = slice_lanes<Target>;
    V best = V::load(own);
    for (int i = 0; i != count; ++i) {
      const V square(static_cast<std::uint16_t>((i + 1) * (i + 1)));
      if ((i & 3) == 0 && !any(best > square)) break;
      if (below[i] != nullptr) best = min(best, V::load(below[i]) + square);
      if (above[i] != nullptr) best = min(best, V::load(above[i]) + square);
    }
    best = select(best <= V(bound), best, V(far_away));
    best.store(out);
    return simd::greatest(best);
  }
};

template <class K>
[[nodiscard]] typename K::signature* best_code() noexcept {
  return simd::kernel<K, typename K::signature>();
}

/// The best kernels for the current processor.
[[nodiscard]] inline slice_code best_slice_code() noexcept {
  return {best_code<choose_offer_kernel>(),  best_code<equal_slices_kernel>(), best_code<lower_slices_kernel>(),
          best_code<equal_rows_kernel>(),    best_code<lower_rows_kernel>(),   best_code<add_rows_kernel>(),
          best_code<combine_slices_kernel>()};
}

}  // namespace orbis::nav::detail
