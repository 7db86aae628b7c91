// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Compiles a kernel once for every instruction set and selects a version at run time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include <orbis/core/simd/level.hpp>

/// Marks a kernel, and every function to which it passes vectors, so that they are inlined into the function that is
/// compiled for a target.
#define ORBIS_ALWAYS_INLINE __attribute__((always_inline)) inline
/// Forces inlining of a lambda in a kernel; write it after the parameters.
#define ORBIS_INLINE_LAMBDA __attribute__((always_inline))
#define ORBIS_TARGET_POPCNT ORBIS_TARGET("sse4.2,popcnt")
#define ORBIS_TARGET_AVX2 ORBIS_TARGET("avx2,fma,bmi,bmi2,popcnt")
#define ORBIS_TARGET_AVX512 ORBIS_TARGET("avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi,bmi2,popcnt")
/// Marks a function whose products are rounded before they are summed, including all inlined code. Vectors are always
/// rounded this way; the attribute covers scalars in the same function.
#if defined(__clang__)
#define ORBIS_UNFUSED  // clang fuses within one expression only; rounded_product prevents that
#else
#define ORBIS_UNFUSED __attribute__((optimize("fp-contract=off")))
#endif

namespace orbis::simd {

// Compilation targets: the template argument `Target` of kernels and of `vec`.

/// The baseline that the compiler flags select: SSE2 or NEON.
struct portable {
  static constexpr std::size_t bytes = 16;  ///< size of a register
  static constexpr level needs = level::portable;
};
/// SSE4.2 and POPCNT, for kernels that count bits.
struct popcnt {
  static constexpr std::size_t bytes = 16;
  static constexpr level needs = level::popcnt;
};
struct avx2 {
  static constexpr std::size_t bytes = 32;
  static constexpr level needs = level::avx2;
};
struct avx512 {
  static constexpr std::size_t bytes = 64;
  static constexpr level needs = level::avx512;
};

template <class T>
concept target = requires {
  T::bytes;
  T::needs;
};

namespace detail {

/// The function that contains the code of `Kernel` for a target.
template <class Kernel, class Signature, class Target>
struct code;
#ifndef DOXYGEN
#define ORBIS_KERNEL_CODE(Target, attribute)                                      \
  template <class Kernel, class R, class... Args>                                 \
  struct code<Kernel, R(Args...), Target> {                                       \
    static attribute R run(Args... args);                                         \
  };                                                                              \
  template <class Kernel, class R, class... Args>                                 \
  ORBIS_UNFUSED attribute R code<Kernel, R(Args...), Target>::run(Args... args) { \
    return Kernel::template run<Target>(static_cast<Args&&>(args)...);            \
  }
ORBIS_KERNEL_CODE(portable, )
#if ORBIS_X86
ORBIS_KERNEL_CODE(popcnt, ORBIS_TARGET_POPCNT)
ORBIS_KERNEL_CODE(avx2, ORBIS_TARGET_AVX2)
ORBIS_KERNEL_CODE(avx512, ORBIS_TARGET_AVX512)
#endif
#undef ORBIS_KERNEL_CODE
#endif

template <class T, class... List>
inline constexpr bool is_one_of = (std::is_same_v<T, List> || ...);

}  // namespace detail

/// Selects the code of a kernel for the best of `Targets` that `highest` and the processor allow.
///
/// `Kernel` has a static member template `run<Target>`, declared ORBIS_ALWAYS_INLINE, with the signature `Signature`;
/// no parameter is a vector. The kernel is compiled for `portable` and for each of `Targets`, by default `avx2` and
/// `avx512`.
template <class Kernel, class Signature, target... Targets>
[[nodiscard]] Signature* kernel(level highest = level::avx512) noexcept {
  if constexpr (sizeof...(Targets) == 0) {
    return kernel<Kernel, Signature, avx2, avx512>(highest);
  } else {
#if ORBIS_X86
    const level best = std::min(highest, best_level());
    if constexpr (detail::is_one_of<avx512, Targets...>)
      if (best >= level::avx512) return detail::code<Kernel, Signature, avx512>::run;
    if constexpr (detail::is_one_of<avx2, Targets...>)
      if (best >= level::avx2) return detail::code<Kernel, Signature, avx2>::run;
    if constexpr (detail::is_one_of<popcnt, Targets...>)
      if (best >= level::popcnt) return detail::code<Kernel, Signature, popcnt>::run;
#else
    static_cast<void>(highest);
#endif
    return detail::code<Kernel, Signature, portable>::run;
  }
}

}  // namespace orbis::simd
