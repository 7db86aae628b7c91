// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Squared distances that are bit-identical under every compiler flag.
#pragma once

#include <array>
#include <concepts>

#include <orbis/core/rounded.hpp>

namespace orbis::cloud::detail {

/// Computes `(dx^2 + dy^2) + dz^2`, each operation rounded to `S`. This is the summation order of the common k-d trees,
/// so that thresholds select the same points.
template <std::floating_point S>
[[nodiscard]] inline S squared_distance(const std::array<S, 3>& a, const std::array<S, 3>& b) noexcept {
  const S dx = a[0] - b[0];
  const S dy = a[1] - b[1];
  const S dz = a[2] - b[2];
  return (rounded_product(dx, dx) + rounded_product(dy, dy)) + rounded_product(dz, dz);
}

}  // namespace orbis::cloud::detail
