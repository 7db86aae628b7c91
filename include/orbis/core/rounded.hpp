// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Products that are the same bits under every compiler flag.
#pragma once

#include <concepts>

namespace orbis {

/// `a * b`, rounded: never the first half of a fused multiply-add, which `-march=native` and ARM
/// compilers would otherwise make of a product that is summed.
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
