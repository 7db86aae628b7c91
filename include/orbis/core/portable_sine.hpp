// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sine and cosine that give the same bits on every machine; those of the standard library differ in their last bits.
#pragma once

#include <cstdint>

// Between the two, products and sums are rounded each on its own, whatever the target could fuse (`-march=native`).
// Functions in between are no templates: those would be compiled elsewhere, under other options.
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

/// The sine of an angle of `turns` full turns (2 pi each), to about 1e-14 for |turns| < 1e6. Only operations that
/// IEEE 754 defines to the last bit are used: a Taylor series after reduction to a quarter turn.
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
/// The cosine of an angle of `turns` full turns, as `sin_turns`.
[[nodiscard]] inline double cos_turns(double turns) noexcept { return sin_turns(turns + 0.25); }

}  // namespace orbis

ORBIS_END_UNFUSED
