// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bilinear downscaling of 8-bit images, exact in fixed point.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <orbis/core/image.hpp>
#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/extract/byte_pairs.hpp>
#include <orbis/features/detail/extract/resize_plan.hpp>

namespace orbis::features::detail {

/// The two source pixels of a result pixel; `weight`: weight of the second, in units of 1/256.
struct resize_tap {
  int first = 0;
  int second = 0;
  std::uint16_t weight = 0;
};

/// Pixels are areas with centres at integers: result pixel i is at (i + 1/2) * from / to - 1/2.
[[nodiscard]] inline resize_tap tap_at(int i, int from, int to) {
  const double at = (i + 0.5) * (static_cast<double>(from) / to) - 0.5;
  const double whole = std::floor(at);
  const int first = static_cast<int>(whole);
  if (first < 0) return {0, 0, 0};
  if (first >= from - 1) return {from - 1, from - 1, 0};
  return {first, first + 1, static_cast<std::uint16_t>(std::lrint((at - whole) * 256.0))};
}

inline constexpr int resize_block = 32;  ///< number of pixels written at a time

inline void make_plan(resize_plan& plan, int from, int to) {
  if (plan.from == from && plan.to == to) return;
  plan.from = from;
  plan.to = to;
  plan.first.clear();
  plan.weight.clear();
  plan.base.clear();
  plan.places.clear();
  if (from < 2) return;
  const int padded = (to + resize_block - 1) / resize_block * resize_block;
  for (int i = 0; i != padded; ++i) {
    const resize_tap t = tap_at(std::min(i, to - 1), from, to);
    const bool last = t.first == from - 1;  // stored as the previous pixel, with all the weight on the second
    plan.first.push_back(last ? from - 2 : t.first);
    plan.weight.push_back(last ? std::uint16_t{256} : t.weight);
  }
  if (from < 16) return;
  for (std::size_t g = 0; g != plan.first.size(); g += 8) {
    const std::int32_t base = std::min(plan.first[g], from - 16);
    if (plan.first[g + 7] + 1 - base > 15) return plan.base.clear();
    plan.base.push_back(base);
    for (std::size_t i = 0; i != 8; ++i) {
      plan.places.push_back(static_cast<std::uint8_t>(plan.first[g + i] - base));
      plan.places.push_back(0x80);
    }
  }
}

/// Interpolates a source row horizontally; the results are in units of 1/256.
struct resize_along_kernel {
  using signature = void(const resize_plan& plan, const std::uint8_t* from, std::uint16_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const resize_plan& plan, const std::uint8_t* from, std::uint16_t* to) {
    if (plan.from == 1) return static_cast<void>(std::fill_n(to, plan.to, static_cast<std::uint16_t>(from[0] * 256)));
    using words = simd::native_vec<std::uint16_t, Target>;
    const auto put = [&](const words& first, const words& second, std::size_t x) ORBIS_INLINE_LAMBDA {
      // Computed modulo 2^16: the result fits, although the difference may be negative.
      ((first << 8) + (second - first) * words::load(plan.weight.data() + x)).store(to + x);
    };
    if constexpr (has_byte_look_up<Target>) {
      if (!plan.base.empty()) {
        using bytes = simd::native_vec<std::uint8_t, Target>;
        for (std::size_t x = 0; x != plan.first.size(); x += words::count) {
          const bytes pixels = blocks<bytes>(from, plan.base.data() + x / 8);
          const bytes first = bytes::load(plan.places.data() + 2 * x);
          const bytes second = first + simd::bits_as<std::uint8_t>(words(1));
          put(simd::bits_as<std::uint16_t>(look_up_in_blocks(pixels, first)),
              simd::bits_as<std::uint16_t>(look_up_in_blocks(pixels, second)), x);
        }
        return;
      }
    }
    for (std::size_t x = 0; x != plan.first.size(); x += words::count) {
      const auto pairs = words::generate([&](std::size_t i) ORBIS_INLINE_LAMBDA {
        std::uint16_t pair;
        std::memcpy(&pair, from + plan.first[x + i], sizeof pair);
        return pair;
      });
      const auto bytes = simd::bits_as<std::uint8_t>(pairs);
      put(even_bytes(bytes), odd_bytes(bytes), x);
    }
  }

 private:
  /// True if the target has a byte look-up instruction.
  template <class Target>
  static constexpr bool has_byte_look_up = Target::needs >= simd::level::popcnt;
  /// Loads blocks of sixteen bytes from `from + base[0]`, `from + base[1]` ...
  template <class V>
  [[nodiscard]] static ORBIS_ALWAYS_INLINE V blocks(const std::uint8_t* from, const std::int32_t* base) noexcept {
    if constexpr (V::count == 16)
      return V::load(from + *base);
    else
      return V(blocks<typename V::half>(from, base), blocks<typename V::half>(from, base + V::count / 32));
  }
};

/// Interpolates vertically, with rounding, between two horizontally interpolated rows; the second has the weight
/// `weight` / 256.
struct resize_across_kernel {
  using signature = void(const std::uint16_t* first, const std::uint16_t* second, int weight, int count,
                         std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint16_t* first, const std::uint16_t* second, int weight, int count,
                                      std::uint8_t* to) {
    using words = simd::native_vec<std::uint16_t, Target>;
    const words w0(static_cast<std::uint16_t>(256 - weight)), w1(static_cast<std::uint16_t>(weight)), low_byte(255);
    for (int x = 0; x < count; x += static_cast<int>(words::count)) {
      const words a = words::load(first + x), b = words::load(second + x);
      const words high = (a >> 8) * w0 + (b >> 8) * w1, low = (a & low_byte) * w0 + (b & low_byte) * w1;
      simd::convert<std::uint8_t>(rounded_high_byte(high, low)).store(to + x);
    }
  }
};

/// Scales an image to the size of `to` by bilinear interpolation: weights in 1/256, one rounding at the end.
/// Bit-identical to OpenCV's INTER_LINEAR_EXACT. Fast for downscaling factors up to 1.8. Downscaling by a factor
/// above 2 skips pixels. O(pixels of both images).
/// @pre neither image is empty; every row of `to`, including the last, is writable up to a multiple of 32 pixels
template <class = void>
void resize(image_view<const std::uint8_t> from, image_view<std::uint8_t> to, resize_workspace& memory) {
  assert(!from.empty() && !to.empty());
  const auto along = simd::kernel<resize_along_kernel, resize_along_kernel::signature>();
  const auto across = simd::kernel<resize_across_kernel, resize_across_kernel::signature>();
  make_plan(memory.plan, from.width(), to.width());
  const auto padded = (static_cast<std::size_t>(to.width()) + resize_block - 1) / resize_block * resize_block;
  memory.rows.resize(std::max(memory.rows.size(), 2 * padded));
  std::array<int, 2> holds{-1, -1};  // source rows in memory.rows; even rows in the first
  const auto row_of = [&](int y) {
    const auto slot = static_cast<std::size_t>(y & 1);
    std::uint16_t* row = memory.rows.data() + slot * padded;
    if (holds[slot] != y) along(memory.plan, from.row(y).data(), row);
    holds[slot] = y;
    return row;
  };
  for (int y = 0; y != to.height(); ++y) {
    const resize_tap tap = tap_at(y, from.height(), to.height());
    const std::uint16_t* first = row_of(tap.first);
    across(first, row_of(tap.second), tap.weight, to.width(), to.data() + y * to.stride());
  }
}

}  // namespace orbis::features::detail
