// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arithmetic that gives the same bits on every machine and under every compiler flag: products that are never fused
/// with a sum, and sines and cosines.
#pragma once

#include <concepts>
#include <cstdint>

namespace orbis {

/// `a * b`, rounded: never contracted into a fused multiply-add, which compilers otherwise use for sums of products
/// with `-march=native` and on ARM.
template <std::floating_point S>
[[nodiscard]] inline S rounded_product(S a, S b) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
  return a * b;
#elif defined(__GNUC__) && defined(__x86_64__)
  S product = a * b;
  // __builtin_assoc_barrier does not survive g++ 12's vectoriser.
  if constexpr (sizeof(S) <= sizeof(double)) asm("" : "+x"(product));
  return product;
#elif defined(__has_builtin)
#if __has_builtin(__builtin_assoc_barrier)
  return __builtin_assoc_barrier(a * b);
#else
  return a * b;
#endif
#else
  return a * b;
#endif
}

}  // namespace orbis

// Between these two macros, every product and sum is rounded separately, even if the target can fuse them
// (`-march=native`). Functions between them must not be templates, which would be instantiated elsewhere, with other
// options.
#if defined(__clang__)
#define ORBIS_BEGIN_UNFUSED _Pragma("float_control(push)") _Pragma("clang fp contract(off)")
#define ORBIS_END_UNFUSED _Pragma("float_control(pop)")
#elif defined(__GNUC__)
#define ORBIS_BEGIN_UNFUSED _Pragma("GCC push_options") _Pragma("GCC optimize(\"fp-contract=off\")")
#define ORBIS_END_UNFUSED _Pragma("GCC pop_options")
#else
#define ORBIS_BEGIN_UNFUSED
#define ORBIS_END_UNFUSED
#endif

ORBIS_BEGIN_UNFUSED

namespace orbis {

/// The sine of an angle of `turns` full turns (2 pi each), to about 1e-14 for |turns| < 1e6. Uses only operations that
/// IEEE 754 defines exactly: a Taylor series after reduction to a quarter turn.
[[nodiscard]] inline double sin_turns(double turns) noexcept {
  double r = turns - static_cast<double>(static_cast<std::int64_t>(turns));  // (-1, 1)
  if (r > 0.5) r -= 1.0;
  if (r < -0.5) r += 1.0;
  if (r > 0.25) r = 0.5 - r;
  if (r < -0.25) r = -0.5 - r;
  const double a = r * 6.283185307179586;  // [-pi/2, pi/2]: the Taylor series up to a^19
  const double s = a * a;
  double sum = 1.0;
  for (int n = 18; n >= 2; n -= 2) sum = 1.0 - sum * (s / static_cast<double>(n * (n + 1)));
  return a * sum;
}
/// The cosine of an angle of `turns` full turns; as accurate as `sin_turns`.
[[nodiscard]] inline double cos_turns(double turns) noexcept { return sin_turns(turns + 0.25); }

}  // namespace orbis

ORBIS_END_UNFUSED
