// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How unlike a square of pixels is to those that a strip shows at each shift.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::features::detail {

/// A square of `side` x `side` pixels, and the strip of as many rows along which it slides. All pixels are four times
/// their value.
struct sliding_square {
  static constexpr int max_side = 31, max_shifts = 32;
  static constexpr int stride = 64;  ///< of the strip: `max_side` + `max_shifts`, rounded up

  int side = 0;
  alignas(64) std::array<std::int16_t, max_side * max_side> square;  ///< row after row, `side` each
  alignas(64) std::array<std::int16_t, max_side * stride> strip;     ///< of a row the first `side` + 15, or + 31, count
};

struct slide_differences_kernel {
  using signature = void(const sliding_square&, int shifts, std::int32_t* sums);

  /// Lanes are shifts.
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const sliding_square& s, int shifts, std::int32_t* sums) {
    using words = simd::vec<std::int16_t, 16, Target>;
    using numbers = simd::vec<std::int32_t, 16, Target>;
    constexpr int flush = 16;  // so many terms of at most 2040 fit into a word
    const int side = s.side, n = side * side;
    std::int32_t own = 0;
    for (int i = 0; i != n; ++i) own += s.square[static_cast<std::size_t>(i)];
    for (int first = 0; first < shifts; first += 16) {
      const auto add_up = [&](auto&& term) ORBIS_INLINE_LAMBDA {
        numbers total(0);
        for (int v = 0; v != side; ++v)
          for (int begin = 0; begin < side; begin += flush) {
            words part(0);
            for (int u = begin; u < side && u < begin + flush; ++u)
              part = part + term(v, u, words::load(s.strip.data() + v * sliding_square::stride + u + first));
            total = total + simd::convert<std::int32_t>(part);
          }
        return total;
      };
      alignas(64) std::array<std::int32_t, 16> total;
      alignas(64) std::array<std::int16_t, 16> offset;  // of the means
      add_up([](int, int, const words& w) ORBIS_INLINE_LAMBDA { return w; }).store(total.data());
      for (std::size_t i = 0; i != 16; ++i) offset[i] = static_cast<std::int16_t>((own - total[i]) / n);
      const words offsets = words::load(offset.data());
      add_up([&](int v, int u, const words& w) ORBIS_INLINE_LAMBDA {
        const words d = words(s.square[static_cast<std::size_t>(v * side + u)]) - offsets - w;
        return max(d, words(0) - d);
      }).store(sums + first);
    }
  }
};

/// `sums[k]` becomes four times the sum of absolute differences between the square and the strip from column `k` on,
/// each less its mean (to a quarter of a grey value), for k < `shifts`. Writes a multiple of 16 sums.
/// @pre 1 <= side <= max_side, shifts <= max_shifts; all pixels of the strip that count are set
inline void slide_differences(const sliding_square& s, int shifts, std::int32_t* sums) {
  simd::kernel<slide_differences_kernel, slide_differences_kernel::signature, simd::avx2>()(s, shifts, sums);
}

}  // namespace orbis::features::detail

ORBIS_COMPILED_KERNEL_AVX2(orbis::features::detail::slide_differences_kernel,
                           orbis::features::detail::slide_differences_kernel::signature);
