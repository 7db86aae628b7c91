// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Deterministic random numbers: the same seed gives the same numbers with every standard library, unlike
/// `std::normal_distribution`.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace orbis {

/// SplitMix64's finaliser: a well-mixed 64-bit hash of `x`. Use `mix64(seed ^ mix64(index))` for counter-based noise,
/// which needs no state and no fixed order of evaluation. Source: Steele, Lea, Flood, "Fast splittable pseudorandom
/// number generators", OOPSLA 2014.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// A small, fast generator (SplitMix64); satisfies `std::uniform_random_bit_generator`.
class random_bits {
 public:
  using result_type = std::uint64_t;
  constexpr explicit random_bits(std::uint64_t seed) noexcept : state_{seed} {}
  [[nodiscard]] static constexpr result_type min() noexcept { return 0; }
  [[nodiscard]] static constexpr result_type max() noexcept { return std::numeric_limits<result_type>::max(); }

  constexpr result_type operator()() noexcept {
    const result_type r = mix64(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return r;
  }

  /// A uniform random number in [0, 1), a multiple of 2^-53.
  [[nodiscard]] constexpr double uniform() noexcept { return static_cast<double>((*this)() >> 11U) * 0x1.0p-53; }
  /// A uniform random number in [lo, hi).
  [[nodiscard]] constexpr double uniform(double lo, double hi) noexcept { return lo + (hi - lo) * uniform(); }
  /// A uniform random integer in [0, n), n > 0, by multiplication (Lemire 2019, without rejection: bias < n / 2^32).
  [[nodiscard]] constexpr std::uint32_t below(std::uint32_t n) noexcept {
    return static_cast<std::uint32_t>((((*this)() >> 32U) * n) >> 32U);
  }
  /// Approximately normal with mean 0 and standard deviation 1, accurate out to four sigma: a centred binomial of 64
  /// coin flips, smoothed by adding a uniform random number of width 1. Uses no libm function.
  [[nodiscard]] constexpr double normal() noexcept {
    const result_type first = (*this)();  // named, since the evaluation order of arguments is unspecified
    return gaussian_from(first, (*this)());
  }

  /// `normal()` computed from two random words, for counter-based noise.
  [[nodiscard]] static constexpr double gaussian_from(std::uint64_t a, std::uint64_t b) noexcept {
    // Binomial(64, 1/2) has variance 16; the uniform number of width 1 adds 1/12.
    constexpr double inverse_deviation = 0.24935149047701481;  // 1 / sqrt(16 + 1/12)
    const double flips = static_cast<double>(std::popcount(a)) - 32.0;
    const double step = static_cast<double>(b >> 11U) * 0x1.0p-53 - 0.5;
    return (flips + step) * inverse_deviation;
  }
  [[deprecated("use gaussian_from")]] [[nodiscard]] static constexpr double normal_of(std::uint64_t a,
                                                                                      std::uint64_t b) noexcept {
    return gaussian_from(a, b);
  }

 private:
  std::uint64_t state_;
};

/// Shuffles `list` (fewer than 2^32 entries); all orders are equally likely. Source: R. Durstenfeld, "Algorithm 235:
/// random permutation", CACM 7(7), 1964.
template <class List>
constexpr void shuffle(List& list, random_bits& random) noexcept {
  for (std::size_t i = list.size(); i > 1; --i)
    std::swap(list[i - 1], list[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace orbis
