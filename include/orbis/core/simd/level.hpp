// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Detection of the processor's instruction sets, and a limit on them for tests.
///
/// Public interfaces have no level parameter: every kernel runs at `simd::best_level()`, and all levels give the same
/// bits. A test of a component verifies this by making the same public call under a `simd::level_limit`:
///
/// @code
///   for (const simd::level l : simd::available_levels()) {
///     const simd::level_limit limit{l};  // during its lifetime, kernels selected in any thread use at most l
///     CHECK(extract(image) == expected);
///   }
/// @endcode
///
/// An object that selects its kernels when it is constructed must be constructed while the limit exists. A limit
/// applies to all threads; the library itself never sets one.
#pragma once

#include <algorithm>
#include <atomic>
#include <vector>

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
#define ORBIS_X86 1
/// Compiles one function for an instruction set above the baseline.
#define ORBIS_TARGET(features) __attribute__((target(features)))
#else
#define ORBIS_X86 0
#define ORBIS_TARGET(features)
#endif

namespace orbis::simd {

/// Instruction sets that kernels are compiled for; each includes the previous ones.
enum class level {
  portable,  ///< the baseline that the compiler flags select: SSE2 on x86-64, NEON on ARM
  popcnt,    ///< + SSE4.2, POPCNT
  avx2,      ///< + AVX2, FMA, BMI
  avx512     ///< + AVX-512 F, BW, DQ, VL
};

/// The best level that this processor supports. Cheap (a few loads) after the first call.
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

namespace detail {
/// The result of best_level() as a number; negative before the first call.
inline std::atomic<int> chosen_level{-1};
}  // namespace detail

/// The level that kernels run at: the best one that the processor supports, unless a test limits it. Costs one load.
[[nodiscard]] inline level best_level() noexcept {
  const int chosen = detail::chosen_level.load(std::memory_order_relaxed);
  if (chosen >= 0) return static_cast<level>(chosen);
  int unknown = -1;  // a limit may have been set concurrently
  detail::chosen_level.compare_exchange_strong(unknown, static_cast<int>(detected()));
  return static_cast<level>(detail::chosen_level.load(std::memory_order_relaxed));
}

/// For tests: limits `best_level()` to at most `highest` in all threads during its lifetime. Limits nest; they must be
/// destroyed in reverse order.
class level_limit {
 public:
  explicit level_limit(level highest) noexcept : before_{best_level()} {
    detail::chosen_level.store(static_cast<int>(std::min(highest, detected())));
  }
  ~level_limit() { detail::chosen_level.store(static_cast<int>(before_)); }
  level_limit(const level_limit&) = delete;
  level_limit& operator=(const level_limit&) = delete;

 private:
  level before_;
};

/// For tests: all levels that this processor supports, ascending from `portable`.
[[nodiscard]] inline std::vector<level> available_levels() {
  std::vector<level> levels;
  for (const level l : {level::portable, level::popcnt, level::avx2, level::avx512})
    if (l <= detected()) levels.push_back(l);
  return levels;
}

}  // namespace orbis::simd
