// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which measurement of one sensor belongs to which of another, by their time stamps.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

namespace orbis {

/// Indices into two lists.
struct index_pair {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  friend bool operator==(const index_pair&, const index_pair&) = default;
};

/// Pairs the time stamps (seconds) of two sorted lists, nearest pair first, each used at most once
/// and none further apart than `max_difference`. The pairs come in the order of `a`; equal
/// differences are settled in favour of the earlier stamp. Only the `max_candidates` nearest
/// neighbours on either side are considered for each stamp. O(n log n).
/// @pre both lists are sorted and free of NaN
[[nodiscard]] inline std::vector<index_pair> associate(std::span<const double> a, std::span<const double> b,
                                                       double max_difference, std::size_t max_candidates = 8) {
  assert(std::is_sorted(a.begin(), a.end()) && std::is_sorted(b.begin(), b.end()));
  struct candidate {
    double difference;
    index_pair pair;
  };
  std::vector<candidate> candidates;
  std::size_t after = 0;  // the first of b that is not before a[i]
  for (std::size_t i = 0; i != a.size(); ++i) {
    while (after != b.size() && b[after] < a[i]) ++after;
    const std::size_t begin = after - std::min(after, max_candidates);
    const std::size_t end = after + std::min(b.size() - after, max_candidates);
    for (std::size_t j = begin; j != end; ++j)
      if (const double d = std::abs(a[i] - b[j]); d <= max_difference)
        candidates.push_back({d, {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)}});
  }
  std::sort(candidates.begin(), candidates.end(), [](const candidate& x, const candidate& y) {
    return std::tie(x.difference, x.pair.first, x.pair.second) < std::tie(y.difference, y.pair.first, y.pair.second);
  });

  std::vector<bool> used_a(a.size(), false), used_b(b.size(), false);
  std::vector<index_pair> pairs;
  for (const candidate& c : candidates) {
    if (used_a[c.pair.first] || used_b[c.pair.second]) continue;
    used_a[c.pair.first] = used_b[c.pair.second] = true;
    pairs.push_back(c.pair);
  }
  std::sort(pairs.begin(), pairs.end(), [](const index_pair& x, const index_pair& y) { return x.first < y.first; });
  return pairs;
}

}  // namespace orbis
