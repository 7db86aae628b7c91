// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Unrolled loops with a constant number of iterations, for kernels whose values must stay in registers.
#pragma once

#include <type_traits>
#include <utility>

#include <orbis/core/simd/dispatch.hpp>

namespace orbis::optimize::detail {

/// Calls `f` with the constants 0 to N - 1.
template <int N, class F>
ORBIS_ALWAYS_INLINE void unroll(const F& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) ORBIS_INLINE_LAMBDA { (f(std::integral_constant<int, I>{}), ...); }
  (std::make_integer_sequence<int, N>{});
}

}  // namespace orbis::optimize::detail
