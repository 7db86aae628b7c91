// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The natural logarithm at compile time, where C++20's std::log cannot be called.
#pragma once

#include <bit>
#include <cassert>
#include <cstdint>

namespace orbis::octree::detail {

/// The natural logarithm of `x`, within three units in the last place of a double, so that its float is
/// std::log's (but for one value in some ten million, where the two round apart).
///
/// `x = m * 2^e` with `m` in [0.7, 1.41]; `log(m) = 2 atanh(s)` for `s = (m - 1) / (m + 1)`, by the
/// series `s + s^3 / 3 + s^5 / 5 + ...`, |s| < 0.172. For constants: at run time std::log is faster.
/// @pre x is positive and normal
[[nodiscard]] constexpr double constexpr_log(double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  assert(bits >> 52U >= 1 && bits >> 52U < 0x7ff);
  auto exponent = static_cast<int>(bits >> 52U) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++exponent;
  }
  const double s = (m - 1.0) / (m + 1.0);
  double series = 0.0;
  for (int k = 27; k != 1; k -= 2) series = (series + 1.0 / k) * (s * s);
  // log 2 in two parts, the first of which is exact when multiplied by an exponent.
  constexpr double log2_high = 0x1.62e42fee00000p-1, log2_low = 0x1.a39ef35793c76p-33;
  return exponent * log2_high + (2.0 * s + (2.0 * s * series + exponent * log2_low));
}

}  // namespace orbis::octree::detail
