// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sums over the entries of long vectors.
#pragma once

#include <cstddef>

namespace orbis::optimize::detail {

/// Returns the sum of `term(i)` for i < n, computed as four partial sums, which shortens the dependency chain.
template <class Term>
[[nodiscard]] double sum_over(std::size_t n, const Term& term) {
  double a = 0.0, b = 0.0, c = 0.0, d = 0.0;
  const std::size_t pairs = n / 2 * 2, whole = n / 4 * 4;
  for (std::size_t i = 0; i != whole; i += 4) {
    a += term(i);
    b += term(i + 1);
    c += term(i + 2);
    d += term(i + 3);
  }
  a += c;
  b += d;
  if (pairs != whole) {
    a += term(whole);
    b += term(whole + 1);
  }
  double sum = a + b;
  if (pairs != n) sum += term(pairs);
  return sum;
}

}  // namespace orbis::optimize::detail
