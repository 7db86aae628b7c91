// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Selection by counting: between which values the one of a given rank lies.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace orbis::cloud::detail {

/// Where the `wanted`-th smallest value lies: above `low`, which `at_low` values do not exceed, and
/// not above `high`, which `at_high` values do not exceed.
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
  /// A value within; false if there is none.
  [[nodiscard]] bool pick(int tries, std::size_t wanted, float& at) const noexcept {
    const float floor = std::max(low, 0.0F);
    if (tries < 6) {
      const float share = (static_cast<float>(wanted - at_low) - 0.5F) / static_cast<float>(at_high - at_low);
      at = floor + (high - floor) * share;
      if (at > low && at < high) return true;
    }
    // By halves of the bit patterns, which are ordered as the values are.
    const std::int64_t from = low < 0 ? -1 : std::int64_t{std::bit_cast<std::uint32_t>(low)};
    const std::int64_t to = std::bit_cast<std::uint32_t>(high);
    if (to - from <= 1) return false;
    at = std::bit_cast<float>(static_cast<std::uint32_t>(from + (to - from) / 2));
    return true;
  }
};

/// A guess at the value that `rank` of `count` values do not exceed, where `bound` is the largest:
/// between the squared distances in a plane and those in space.
[[nodiscard]] inline float guess_ranked(float bound, std::size_t rank, std::size_t count) noexcept {
  return bound * (1.0F - 0.92F * (1.0F - static_cast<float>(rank) / static_cast<float>(count)));
}

/// Narrows down where the `wanted`-th smallest of `count` values up to `bound` lies, until at most
/// sixteen are left or all that are left are equal. `count_within(x)`: how many are at most `x`;
/// `count_both(x, y)`: the same for two.
template <class Count, class CountBoth>
[[gnu::always_inline]] inline rank_bracket bracket_rank(float bound, std::size_t count, std::size_t wanted,
                                                        std::size_t margin, const Count& count_within,
                                                        const CountBoth& count_both) {
  rank_bracket bracket{-1.0F, bound, 0, count};
  if (count <= 16) return bracket;
  // Most often two guesses, a little low and a little high, leave few values between them.
  const float low = guess_ranked(bound, std::max(wanted, margin + 1) - margin, count);
  const float high = guess_ranked(bound, std::min(wanted + margin, count), count);
  const std::array<std::size_t, 2> counts = count_both(low, high);
  bracket.narrow(low, counts[0], wanted);
  bracket.narrow(high, counts[1], wanted);
  float at = 0;
  for (int tries = 0; bracket.at_high - bracket.at_low > 16 && bracket.pick(tries, wanted, at); ++tries) {
    bracket.narrow(at, count_within(at), wanted);
  }
  return bracket;
}

}  // namespace orbis::cloud::detail
