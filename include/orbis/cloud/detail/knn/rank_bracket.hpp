// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Selection by counting: narrows an interval that contains the value of a given rank.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace orbis::cloud::detail {

/// Interval (low, high] that contains the `wanted`-th smallest value. `at_low` values do not exceed `low`; `at_high`
/// values do not exceed `high`.
struct rank_bracket {
  float low;
  float high;
  std::size_t at_low;
  std::size_t at_high;

  void narrow(float at, std::size_t count, std::size_t wanted) noexcept {
    if (count >= wanted) {
      if (at < high) high = at, at_high = count;
    } else if (at > low) {
      low = at, at_low = count;
    }
  }
  /// Chooses a value inside the interval; returns false if there is none.
  [[nodiscard]] bool pick(int tries, std::size_t wanted, float& at) const noexcept {
    const float floor = std::max(low, 0.0F);
    if (tries < 6) {
      const float share = (static_cast<float>(wanted - at_low) - 0.5F) / static_cast<float>(at_high - at_low);
      at = floor + (high - floor) * share;
      if (at > low && at < high) return true;
    }
    // Bisects the bit patterns, which have the same order as the values.
    const std::int64_t from = low < 0 ? -1 : std::int64_t{std::bit_cast<std::uint32_t>(low)};
    const std::int64_t to = std::bit_cast<std::uint32_t>(high);
    if (to - from <= 1) return false;
    at = std::bit_cast<float>(static_cast<std::uint32_t>(from + (to - from) / 2));
    return true;
  }
};

/// Estimates the `rank`-th smallest of `count` squared distances up to `bound`, as a compromise between the
/// distributions for points in a plane and for points in space.
[[nodiscard]] inline float guess_ranked(float bound, std::size_t rank, std::size_t count) noexcept {
  return bound * (1.0F - 0.92F * (1.0F - static_cast<float>(rank) / static_cast<float>(count)));
}

/// Narrows the interval of the `wanted`-th smallest of `count` values up to `bound`, until at most sixteen values
/// remain or all that remain are equal. `count_within(x)`: number of values at most `x`; `count_three(x)`: these
/// numbers for three values at once.
template <class Count, class CountThree>
[[gnu::always_inline]] inline rank_bracket bracket_rank(float bound, std::size_t count, std::size_t wanted,
                                                        const Count& count_within, const CountThree& count_three) {
  rank_bracket bracket{-1.0F, bound, 0, count};
  if (count <= 16) return bracket;
  // In most cases, three guesses, one of them slightly low and one slightly high, leave few values in between.
  constexpr std::size_t margin = 11;
  const std::array<float, 3> at{guess_ranked(bound, std::max(wanted, margin + 1) - margin, count),
                                guess_ranked(bound, wanted, count),
                                guess_ranked(bound, std::min(wanted + margin, count), count)};
  const std::array<std::size_t, 3> counts = count_three(at);
  for (std::size_t i = 0; i != 3; ++i) bracket.narrow(at[i], counts[i], wanted);
  float next = 0;
  for (int tries = 0; bracket.at_high - bracket.at_low > 16 && bracket.pick(tries, wanted, next); ++tries) {
    bracket.narrow(next, count_within(next), wanted);
  }
  return bracket;
}

}  // namespace orbis::cloud::detail
