// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of stereo.hpp.
#pragma once

#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/match/hamming_listed.hpp>
#include <orbis/features/stereo.hpp>

namespace orbis::features::detail {

struct slide_differences_kernel {
  using signature = void(const sliding_square&, int shifts, std::int32_t* sums);

  /// Each lane holds one shift. Pixels are multiplied by four, so that mean values are integers in units of a quarter
  /// of a grey value.
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const sliding_square& s, int shifts, std::int32_t* sums) {
    using bytes = simd::vec<std::uint8_t, 16, Target>;
    using words = simd::vec<std::int16_t, 16, Target>;
    using numbers = simd::vec<std::int32_t, 16, Target>;
    constexpr int max_side = sliding_square::max_side;
    constexpr int square_stride = 32, strip_stride = 64;  // the largest sides, rounded up
    constexpr int flush = 16;                             // number of terms of at most 2040 that fit into a word
    alignas(64) std::array<std::int16_t, max_side * square_stride> square;
    alignas(64) std::array<std::int16_t, max_side * strip_stride> strip;
    alignas(64) std::array<std::int16_t, strip_stride> columns;  // sums over the strip, at most 31620
    const int side = s.side, n = side * side;
    // Values beyond the readable pixels affect only shifts that are not requested.
    const auto widen = [side](const pixel_rows& from, int width, int stride, std::int16_t* to,
                              auto&& sum_up) ORBIS_INLINE_LAMBDA {
      for (int u = 0; u < width; u += 16) {
        const int there = std::clamp(from.readable - u, 0, 16);
        words sum(0);
        for (int v = 0; v != side; ++v) {
          const std::uint8_t* const p = from.first + v * from.stride + std::min(u, from.readable);
          const bytes b = there == 16 ? bytes::load(p) : bytes::load(p, static_cast<std::size_t>(there));
          const words w = simd::convert<std::int16_t>(b) << 2;
          w.store(to + v * stride + u);
          sum = sum + w;
        }
        sum_up(u, sum);
      }
    };
    alignas(64) std::array<std::int16_t, square_stride> square_columns;
    widen(s.square, side, square_stride, square.data(),
          [&](int u, const words& sum) ORBIS_INLINE_LAMBDA { sum.store(square_columns.data() + u); });
    widen(s.strip, side - 1 + (shifts + 15) / 16 * 16, strip_stride, strip.data(),
          [&](int u, const words& sum) ORBIS_INLINE_LAMBDA { sum.store(columns.data() + u); });
    std::int32_t own = 0;
    for (int u = 0; u != side; ++u) own += square_columns[static_cast<std::size_t>(u)];
    for (int first = 0; first < shifts; first += 16) {
      numbers there(0);
      for (int u = 0; u != side; ++u)
        there = there + simd::convert<std::int32_t>(words::load(columns.data() + u + first));
      alignas(64) std::array<std::int32_t, 16> total;
      alignas(64) std::array<std::int16_t, 16> offset;  // offsets of the means
      there.store(total.data());
      for (std::size_t i = 0; i != 16; ++i) offset[i] = static_cast<std::int16_t>((own - total[i]) / n);
      const words offsets = words::load(offset.data());
      numbers sum(0);
      for (int begin = 0; begin < side; begin += flush)
        for (int v = 0; v != side; ++v) {
          words part(0);
          for (int u = begin; u < side && u < begin + flush; ++u) {
            const words d = words(square[static_cast<std::size_t>(v * square_stride + u)]) - offsets -
                            words::load(strip.data() + v * strip_stride + u + first);
            part = part + max(d, words(0) - d);
          }
          sum = sum + simd::convert<std::int32_t>(part);
        }
      sum.store(sums + first);
    }
  }
};

ORBIS_LAZY_INLINE void slide_differences(const sliding_square& s, int shifts, std::int32_t* sums) {
  simd::kernel<slide_differences_kernel, slide_differences_kernel::signature, simd::avx2>()(s, shifts, sums);
}

}  // namespace orbis::features::detail
