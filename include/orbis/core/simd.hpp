// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// SIMD kernels that are written once and run on every instruction set.
///
/// A kernel is a static member template whose template argument is the target. It works on `vec<T, N, Target>`, which
/// is split into the registers of the target. It is compiled for each target and selected at run time:
///
/// @code
///   struct sum_of_squares {
///     template <orbis::simd::target Target>
///     static ORBIS_ALWAYS_INLINE double run(std::span<const double> x) {
///       using lanes = orbis::simd::vec<double, 8, Target>;
///       lanes sum = 0.0;
///       for (std::size_t i = 0; i < x.size(); i += lanes::count) {
///         const lanes v = lanes::load(x.data() + i, std::min(lanes::count, x.size() - i));
///         sum += select(v > 0.0, v * v, 0.0);
///       }
///       return orbis::simd::sum(sum);
///     }
///   };
///   double total = orbis::simd::kernel<sum_of_squares, double(std::span<const double>)>()(values);
/// @endcode
///
/// If a kernel passes vectors to a function, declare that function ORBIS_ALWAYS_INLINE; write lambdas in a kernel as
/// `[&](auto& v) ORBIS_INLINE_LAMBDA {...}`. Code that is not inlined is compiled for the baseline. Use the same N for
/// all targets if the order of sums matters; otherwise use `native_vec<T, Target>`, which fills one register.
///
/// | header | contents |
/// | --- | --- |
/// | core/simd/level.hpp | the processor's instruction sets; a limit on them for tests |
/// | core/simd/dispatch.hpp | targets; `kernel`: selects the code for the best target |
/// | core/simd/mask.hpp | `mask`, `bits`, `any`, `all`, `popcount` |
/// | core/simd/vec.hpp | `vec`: memory, arithmetic, comparisons, `select`, `min`, `max`, bits, shifts |
/// | core/simd/math.hpp | `abs`, `sqrt`, `floor`, approximate roots, sums over lanes |
/// | core/simd/convert.hpp | widening and narrowing conversions between number types |
/// | core/simd/memory.hpp | gather and compress |
/// | core/simd/shuffle.hpp | constant shuffles, interleaving, table look-up per lane |
/// | core/simd/integer.hpp | saturated sums, averages, sums of products, bit counts |
#pragma once

#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/memory.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
