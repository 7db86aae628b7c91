// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random motions.
#pragma once

#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::test {

/// A motion whose logarithm has entries of at most `metres` and `radians`.
[[nodiscard]] inline se3 random_motion(random_bits& random, double metres, double radians) {
  se3::tangent xi;
  for (int i = 0; i != 3; ++i) {
    xi[i] = random.uniform(-metres, metres);
    xi[i + 3] = random.uniform(-radians, radians);
  }
  return se3::exp(xi);
}

}  // namespace orbis::test
