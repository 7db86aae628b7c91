// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gaussian smoothing of 8-bit images, exact in fixed point.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include <orbis/core/image.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/extract/byte_pairs.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>

namespace orbis::features::detail {

/// The weights of a Gaussian with sigma 2 at -3 ... 3, in units of 1/256; their sum is exactly one.
inline constexpr std::array<std::uint16_t, 7> gaussian_weights{18, 34, 48, 56, 48, 34, 18};
inline constexpr int smooth_block = 64;  ///< number of pixels written at a time

/// Weighted sums along a row, minus 2^15 so that they fit into signed words. The pixels are processed in
/// blocks of one vector register of bytes; within a block, the sums of the even pixels precede those of the odd pixels.
/// @pre `line` is readable from index -3 to n + 4, where n is `count` rounded up to whole blocks
struct smooth_along_kernel {
  // The weights are a parameter, because the compiler generates slow shifts and sums of products from constants.
  using signature = void(const std::uint8_t* line, int count, const std::array<std::uint16_t, 7>& weights,
                         std::int16_t* sums);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint8_t* line, int count, const std::array<std::uint16_t, 7>& weights,
                                      std::int16_t* sums) {
    using bytes = simd::native_vec<std::uint8_t, Target>;
    using words = simd::native_vec<std::uint16_t, Target>;
    const words w0(weights[0]), w1(weights[1]), w2(weights[2]), w3(weights[3]), to_signed(0x8000);
    for (int x = 0; x < count; x += static_cast<int>(bytes::count)) {
      std::array<words, 8> at;  // the bytes at -3, -2 ... 4 from each even pixel
      for (std::size_t i = 0; i != 8; i += 2) {
        const bytes v = bytes::load(line + x + static_cast<int>(i) - 3);
        at[i] = even_bytes(v);
        at[i + 1] = odd_bytes(v);
      }
      const auto put = [&](std::size_t i, std::int16_t* to) ORBIS_INLINE_LAMBDA {
        const words sum =
            (at[i] + at[i + 6]) * w0 + (at[i + 1] + at[i + 5]) * w1 + (at[i + 2] + at[i + 4]) * w2 + at[i + 3] * w3;
        simd::bits_as<std::int16_t>(sum ^ to_signed).store(to);
      };
      put(0, sums + x);
      put(1, sums + x + words::count);
    }
  }
};

/// Sums seven rows of `smooth_along_kernel` with their weights, rounds the sums, and restores the order of the pixels.
struct smooth_across_kernel {
  using signature = void(const std::array<const std::int16_t*, 7>& rows, int count, std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::array<const std::int16_t*, 7>& rows, int count, std::uint8_t* to) {
    using words = simd::native_vec<std::int16_t, Target>;
    using sums = simd::native_vec<std::uint32_t, Target>;
    const auto row_weights = [](std::size_t row) ORBIS_INLINE_LAMBDA {
      return words::generate([row](std::size_t i)
                                 ORBIS_INLINE_LAMBDA { return row + i % 2 < 7 ? gaussian_weights[row + i % 2] : 0; });
    };
    const words w01 = row_weights(0), w23 = row_weights(2), w45 = row_weights(4), w6 = row_weights(6);
    const sums bias(0x8000U * 256 + 0x8000U);  // converts back to unsigned and adds half for rounding
    const auto half_block = [&](int x) ORBIS_INLINE_LAMBDA {
      const auto row = [&](std::size_t i) ORBIS_INLINE_LAMBDA { return words::load(rows[i] + x); };
      const words a = row(0), b = row(1), c = row(2), d = row(3), e = row(4), f = row(5), g = row(6);
      const auto low =
          multiply_add_pairs(zip_low_in_blocks(a, b), w01) + multiply_add_pairs(zip_low_in_blocks(c, d), w23) +
          multiply_add_pairs(zip_low_in_blocks(e, f), w45) + multiply_add_pairs(zip_low_in_blocks(g, g), w6);
      const auto high =
          multiply_add_pairs(zip_high_in_blocks(a, b), w01) + multiply_add_pairs(zip_high_in_blocks(c, d), w23) +
          multiply_add_pairs(zip_high_in_blocks(e, f), w45) + multiply_add_pairs(zip_high_in_blocks(g, g), w6);
      // Words 0 4 1 5 2 6 3 7 of each block of eight.
      const sums even = (simd::bits_as<std::uint32_t>(low) + bias) >> 16;
      const sums odd = (simd::bits_as<std::uint32_t>(high) + bias) & sums(0xffff0000U);
      return words_of_pairs(even, odd);
    };
    constexpr int half = static_cast<int>(words::count);
    for (int x = 0; x < count; x += 2 * half) {
      const auto pairs = simd::bits_as<std::uint16_t>(interleaved(half_block(x), half_block(x + half)));
      simd::bits_as<std::uint8_t>(in_order(pairs, std::make_index_sequence<words::count>{})).store(to + x);
    }
  }

 private:
  /// Word 2 i is even[i], word 2 i + 1 is the upper half of odd[i].
  template <class V>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE auto words_of_pairs(const V& even, const V& odd) noexcept {
    if constexpr (std::endian::native == std::endian::little)
      return simd::bits_as<std::uint16_t>(even | odd);
    else
      return simd::bits_as<std::uint16_t>((even << 16) | (odd >> 16));
  }
  /// Words in the order 0 4 1 5 2 6 3 7 in each block of eight.
  template <class V, std::size_t... I>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE V in_order(const V& v, std::index_sequence<I...>) noexcept {
    return simd::shuffle<(I / 8 * 8 + 2 * (I % 4) + I % 8 / 4)...>(v);
  }
};

/// Convolves rows `[first, last)` of an image with a 7x7 Gaussian (sigma 2, weights in 1/256) and one rounding at the
/// end. The image is extended by reflection without repeating the edge. Bit-identical to OpenCV's GaussianBlur with
/// these parameters. O(pixels).
/// @pre width >= 4, height >= 4; `to` has the size of `from`, and every row, including the last, is writable up to a
/// multiple of 64 pixels
template <class = void>
void smooth(image_view<const std::uint8_t> from, image_view<std::uint8_t> to, int first, int last,
            smooth_workspace& memory) {
  const int width = from.width(), height = from.height();
  assert(width >= 4 && height >= 4 && to.width() == width && to.height() == height);
  assert(first >= 0 && last <= height);
  const auto along = simd::kernel<smooth_along_kernel, smooth_along_kernel::signature>();
  const auto across = simd::kernel<smooth_across_kernel, smooth_across_kernel::signature>();
  const auto padded = (static_cast<std::size_t>(width) + smooth_block - 1) / smooth_block * smooth_block;
  memory.line.resize(std::max(memory.line.size(), padded + 16 + smooth_block));
  memory.sums.resize(std::max(memory.sums.size(), padded * 8));
  const auto row_sums = [&](int y) { return memory.sums.data() + static_cast<std::size_t>(y & 7) * padded; };
  const auto reflected = [](int at, int size) { return at < 0 ? -at : at >= size ? 2 * size - 2 - at : at; };

  std::uint8_t* line = memory.line.data() + 16;
  int ready = std::max(0, first - 3);  // sums of rows before this one are ready
  for (int y = first; y < last; ++y) {
    for (; ready <= std::min(y + 3, height - 1); ++ready) {
      std::memcpy(line, from.row(ready).data(), static_cast<std::size_t>(width));
      for (int i = 1; i <= 3; ++i) {
        line[-i] = line[i];
        line[width - 1 + i] = line[width - 1 - i];
      }
      along(line, width, gaussian_weights, row_sums(ready));
    }
    std::array<const std::int16_t*, 7> rows;
    for (int i = 0; i != 7; ++i) rows[static_cast<std::size_t>(i)] = row_sums(reflected(y + i - 3, height));
    across(rows, width, to.data() + y * to.stride());
  }
}

}  // namespace orbis::features::detail
