// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of grey.hpp.
#pragma once

#include <cstddef>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/grey.hpp>

namespace orbis::features {
namespace detail {

/// Weights of Rec. 601 luma, in units of 1/32768.
inline constexpr int luma_red = 9798, luma_green = 19235, luma_blue = 3735;

/// Blocks of 16 bytes that are `step` bytes apart.
template <class Target, std::size_t N = Target::bytes>
[[nodiscard]] ORBIS_ALWAYS_INLINE simd::vec<std::uint8_t, N, Target> blocks_of_16(const std::uint8_t* p,
                                                                                  std::size_t step) {
  if constexpr (N == 16)
    return simd::vec<std::uint8_t, N, Target>::load(p);
  else
    return {blocks_of_16<Target, N / 2>(p, step), blocks_of_16<Target, N / 2>(p + N / 32 * step, step)};
}

/// Processes one register of pixels at a time; returns the number of processed pixels: all except the last few.
template <class Target>
[[nodiscard]] ORBIS_ALWAYS_INLINE int luma_blocks(const rgb8* from, int count, std::uint8_t* to) {
  constexpr int pixels = Target::bytes;
  using bytes = simd::native_vec<std::uint8_t, Target>;
  using words = simd::native_vec<std::int16_t, Target>;
  using numbers = simd::native_vec<std::int32_t, Target>;
  constexpr std::uint8_t zero = 128;
  // Shuffles that select red and green of four pixels as adjacent words, and blue and zero.
  const bytes red_green = bytes::generate([](std::size_t i) ORBIS_INLINE_LAMBDA {
    return i % 2 == 1 ? zero : static_cast<std::uint8_t>(i % 16 / 4 * 3 + i % 4 / 2);
  });
  const bytes blue = bytes::generate([](std::size_t i) ORBIS_INLINE_LAMBDA {
    return i % 4 != 0 ? zero : static_cast<std::uint8_t>(i % 16 / 4 * 3 + 2);
  });
  const words red_green_weights =
      words::generate([](std::size_t i) ORBIS_INLINE_LAMBDA { return i % 2 == 0 ? luma_red : luma_green; });
  const words blue_weight =
      words::generate([](std::size_t i) ORBIS_INLINE_LAMBDA { return i % 2 == 0 ? luma_blue : 0; });
  // Computes the luma of four pixels at p and at every 48th byte after it; reads four bytes beyond the four pixels.
  const auto fours = [&](const std::uint8_t* p) ORBIS_INLINE_LAMBDA {
    const bytes v = blocks_of_16<Target>(p, 48);
    const numbers sum =
        multiply_add_pairs(simd::bits_as<std::int16_t>(look_up_in_blocks(v, red_green)), red_green_weights) +
        multiply_add_pairs(simd::bits_as<std::int16_t>(look_up_in_blocks(v, blue)), blue_weight);
    return simd::bits_as<std::uint8_t>((sum + numbers(1 << 14)) >> 15);
  };
  // Shuffles that select, in each 16-byte block, four values of `a`, then four of `b`, as words.
  const bytes first = bytes::generate([](std::size_t i) ORBIS_INLINE_LAMBDA {
    return i % 16 < 8 ? static_cast<std::uint8_t>(i % 8 / 2 * 4 + i % 2) : zero;
  });
  const bytes last = bytes::generate([](std::size_t i) ORBIS_INLINE_LAMBDA {
    return i % 16 < 8 ? zero : static_cast<std::uint8_t>(i % 8 / 2 * 4 + i % 2);
  });
  const auto eights = [&](const bytes& a, const bytes& b) ORBIS_INLINE_LAMBDA {
    return simd::bits_as<std::int16_t>(look_up_in_blocks(a, first) | look_up_in_blocks(b, last));
  };
  const auto* p = reinterpret_cast<const std::uint8_t*>(from);
  int x = 0;
  for (; x <= count - pixels - 2; x += pixels, p += 3 * pixels)
    narrow_in_blocks(eights(fours(p), fours(p + 12)), eights(fours(p + 24), fours(p + 36))).store(to + x);
  return x;
}

struct luma_kernel {
  using signature = void(const rgb8* from, int count, std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const rgb8* from, int count, std::uint8_t* to) {
    int x = 0;
    if constexpr (Target::needs >= simd::level::avx2) x = luma_blocks<Target>(from, count, to);
    for (; x < count; ++x)
      to[x] = static_cast<std::uint8_t>(
          (from[x].r * luma_red + from[x].g * luma_green + from[x].b * luma_blue + (1 << 14)) >> 15);
  }
};

}  // namespace detail

ORBIS_LAZY_INLINE void luma(image_view<const rgb8> from, image_view<std::uint8_t> to) {
  assert(from.width() == to.width() && from.height() == to.height());
  const auto row = simd::kernel<detail::luma_kernel, detail::luma_kernel::signature, simd::avx2>();
  for (int y = 0; y < from.height(); ++y) row(from.row(y).data(), from.width(), to.row(y).data());
}

}  // namespace orbis::features
