// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Run-time SIMD dispatch inside a header, without `-march`.
///
/// A kernel is written once portably and once more for every instruction set worth it, each variant
/// marked with `ORBIS_TARGET(...)`; `simd::select` picks among their addresses:
///
/// @code
///   int  sum_portable(std::span<const int>);
///   ORBIS_TARGET("avx2") int sum_avx2(std::span<const int>);
///   auto* sum = orbis::simd::select<int(std::span<const int>)>(level, {.portable = sum_portable, .avx2 = sum_avx2});
/// @endcode
#pragma once

#include <algorithm>

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define ORBIS_X86 1
/// Compiles one function for more than the baseline instruction set.
#define ORBIS_TARGET(features) __attribute__((target(features)))
#else
#define ORBIS_X86 0
#define ORBIS_TARGET(features)
#endif

namespace orbis::simd {

/// Instruction sets we write kernels for, each including the ones before it.
enum class level {
  portable,  ///< what the compiler was told to assume; on x86-64 that is SSE2
  popcnt,    ///< + SSE4.2, POPCNT
  avx2,      ///< + AVX2, FMA, BMI
  avx512     ///< + AVX-512 F, BW, DQ, VL
};

/// The best level this processor has. Cheap (a few loads) after the first call.
[[nodiscard]] inline level detected() noexcept {
#if ORBIS_X86
  static const level best = [] {
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("popcnt") || !__builtin_cpu_supports("sse4.2")) return level::portable;
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi2"))
      return level::popcnt;
    if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") ||
        !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512vl"))
      return level::avx2;
    return level::avx512;
  }();
  return best;
#else
  return level::portable;
#endif
}

/// The variants of one kernel; those that do not exist are null.
template <class Signature>
struct variants {
  Signature* portable;
  Signature* popcnt = nullptr;
  Signature* avx2 = nullptr;
  Signature* avx512 = nullptr;
};

/// The best existing variant that neither `wanted` nor the processor excludes.
template <class Signature>
[[nodiscard]] Signature* select(level wanted, const variants<Signature>& v) noexcept {
  const level best = std::min(wanted, detected());
  if (best >= level::avx512 && v.avx512 != nullptr) return v.avx512;
  if (best >= level::avx2 && v.avx2 != nullptr) return v.avx2;
  if (best >= level::popcnt && v.popcnt != nullptr) return v.popcnt;
  return v.portable;
}

}  // namespace orbis::simd
