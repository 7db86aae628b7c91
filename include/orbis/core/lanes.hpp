// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Eight doubles at a time, for kernels that are told the number of doubles in a register.
#pragma once

#include <type_traits>

#include <orbis/core/simd.hpp>

namespace orbis::simd {

inline constexpr int lane_count = 8;

/// The target whose registers hold so many doubles.
template <int Native>
using target_with = std::conditional_t<Native == 8, avx512, std::conditional_t<Native == 4, avx2, portable>>;

/// `N` doubles in registers of `Native`: 8 for AVX-512, 4 for AVX2, 2 for what the compiler assumes.
template <int Native, int N = lane_count>
using lanes = vec<double, N, target_with<Native>>;

template <class L>
concept lane_vector = vector<L>;

}  // namespace orbis::simd
