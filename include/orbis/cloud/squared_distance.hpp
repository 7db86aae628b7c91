// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Squared distances that are the same bits under every compiler flag.
#pragma once

#include <array>
#include <concepts>

namespace orbis::cloud {

/// `a * b`, rounded: never the first half of a fused multiply-add, which `-march=native` and ARM
/// compilers would otherwise make of a product that is summed.
template <std::floating_point S>
[[nodiscard]] inline S rounded_product(S a, S b) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
  return a * b;
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

/// `(dx^2 + dy^2) + dz^2`, each operation rounded in `S`: the order in which the common k-d trees
/// sum, so that thresholds on it select the same points.
template <std::floating_point S>
[[nodiscard]] inline S squared_distance(const std::array<S, 3>& a, const std::array<S, 3>& b) noexcept {
  const S dx = a[0] - b[0];
  const S dy = a[1] - b[1];
  const S dz = a[2] - b[2];
  return (rounded_product(dx, dx) + rounded_product(dy, dy)) + rounded_product(dz, dz);
}

}  // namespace orbis::cloud
