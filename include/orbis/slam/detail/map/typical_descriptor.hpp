// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which of several descriptors of a landmark is the most typical.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/slam/extractor.hpp>

namespace orbis::slam::detail {

/// The index of the most typical of `count` descriptors (`of(i)`): the one whose median distance to the others is
/// least, the first of those where equal. With more than 16 descriptors, 16 evenly spread ones take part, so that the
/// cost is bounded. With one or two, the last one.
/// @pre count > 0
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section III.C.
template <class Of>
[[nodiscard]] std::size_t most_typical(std::size_t count, Of&& of) {
  using distance = distance_of_t<std::remove_cvref_t<decltype(of(std::size_t{}))>>;
  constexpr std::size_t most = 16;
  const std::size_t n = std::min(count, most);
  if (n < 3) return count - 1;
  const auto original = [&](std::size_t i) { return i * (count - 1) / (n - 1); };
  std::array<std::array<std::uint32_t, most>, most> distances{};
  for (std::size_t i = 0; i != n; ++i)
    for (std::size_t j = 0; j != i; ++j)
      distances[i][j] = distances[j][i] = distance{}(of(original(i)), of(original(j)));
  std::size_t best = 0;
  std::uint32_t best_median = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t i = 0; i != n; ++i) {
    const auto row = distances[i].begin();
    const auto middle = row + static_cast<std::ptrdiff_t>(n / 2);
    std::nth_element(row, middle, row + static_cast<std::ptrdiff_t>(n));
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return original(best);
}

}  // namespace orbis::slam::detail
