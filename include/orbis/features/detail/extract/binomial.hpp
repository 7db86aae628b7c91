// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The (1, 2, 1) / 4 mean of three rows of bytes.
#pragma once

#include <cstdint>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::features::detail {

/// to[x] = (a[x] + 2 b[x] + c[x] + 2) / 4. @pre `to` overlaps none of the others
struct binomial_kernel {
  using signature = void(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                         std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                                      std::uint8_t* to) {
    using bytes = simd::native_vec<std::uint8_t, Target>;
    constexpr int step = static_cast<int>(bytes::count);
    const auto block = [&](int x) ORBIS_INLINE_LAMBDA {
      // The mean of a and c, rounded down; then its mean with b, rounded up: together that is the rounding wanted.
      const bytes va = bytes::load(a + x), vb = bytes::load(b + x), vc = bytes::load(c + x);
      const bytes ac = average(va, vc) - ((va ^ vc) & bytes(1));
      average(ac, vb).store(to + x);
    };
    if (count < step) {
      for (int x = 0; x < count; ++x) to[x] = static_cast<std::uint8_t>((a[x] + 2 * b[x] + c[x] + 2) >> 2);
      return;
    }
    for (int x = 0; x <= count - step; x += step) block(x);
    if (count % step != 0) block(count - step);  // overlaps the block before it
  }
};

}  // namespace orbis::features::detail

ORBIS_COMPILED_KERNEL(orbis::features::detail::binomial_kernel, orbis::features::detail::binomial_kernel::signature);
