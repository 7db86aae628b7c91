// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The stages a matcher is composed of: each rejects candidates for one reason.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <span>
#include <unordered_map>
#include <vector>

#include <orbis/features/match.hpp>

namespace orbis::features {

/// Keeps a candidate whose distance is below `ratio` times the second nearest's. One that has no
/// rival stays; two equally near ones never do. Source: Lowe, "Distinctive image features from
/// scale-invariant keypoints", IJCV 2004, section 7.1.
struct ratio_test {
  float ratio = 0.8F;
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept {
    return c.second_distance == none || static_cast<float>(c.distance) < ratio * static_cast<float>(c.second_distance);
  }
};

/// Keeps a candidate that is nearest in both directions.
struct cross_check {
  static constexpr search_needs needs{.reverse = true};
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept { return c.reverse_query == c.query; }
};

/// Keeps a candidate at most `distance` away.
struct max_distance {
  std::uint32_t distance = 50;
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept { return c.distance <= distance; }
};

/// Keeps, of the candidates that share a train, the nearest (the lowest query on ties). Unlike
/// `cross_check`, only those that earlier stages left over compete.
struct unique {
  void operator()(std::vector<candidate>& candidates, std::span<const keypoint>, std::span<const keypoint>) const {
    std::unordered_map<std::uint32_t, std::uint32_t> nearest;  // train -> distance, of the best so far
    nearest.reserve(candidates.size());
    for (const candidate& c : candidates) {
      const auto [at, inserted] = nearest.try_emplace(c.train, c.distance);
      if (!inserted) at->second = std::min(at->second, c.distance);
    }
    std::erase_if(candidates, [&](const candidate& c) {
      std::uint32_t& distance = nearest.find(c.train)->second;
      if (c.distance != distance) return true;
      distance = none;  // taken: equally near ones that follow lose
      return false;
    });
  }
};

/// Keeps the candidates whose change of orientation is among the most frequent: between two images
/// that are turned against each other as a whole, true matches turn alike. The differences of the
/// angles fill `bins` equal bins around the circle; those of the `peaks` fullest stay (the lowest
/// bins on ties), but none below `weakest` of the fullest.
struct rotation_consistency {
  static constexpr search_needs needs{.keypoints = true};
  int bins = 30;
  int peaks = 3;
  float weakest = 0.1F;

  /// @pre one keypoint for each descriptor on both sides; bins > 0
  void operator()(std::vector<candidate>& candidates, std::span<const keypoint> queries,
                  std::span<const keypoint> trains) const {
    assert(bins > 0);
    const auto bin_of = [&](const candidate& c) {
      constexpr float turn = 2.0F * std::numbers::pi_v<float>;
      const float difference = (queries[c.query].angle - trains[c.train].angle) / turn;
      const float fraction = difference - std::floor(difference);  // [0, 1]: may round up
      if (!std::isfinite(fraction)) return std::size_t{0};
      // Bins are centred on their angle, so that "not turned" lies in the middle of one.
      return static_cast<std::size_t>(fraction * static_cast<float>(bins) + 0.5F) % static_cast<std::size_t>(bins);
    };
    std::vector<std::size_t> counts(static_cast<std::size_t>(bins), 0);
    for (const candidate& c : candidates) ++counts[bin_of(c)];

    std::vector<std::size_t> order(counts.size());
    for (std::size_t i = 0; i != order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return counts[a] > counts[b]; });
    const auto floor = weakest * static_cast<float>(counts[order.front()]);
    std::vector<char> kept(counts.size(), 0);
    for (std::size_t i = 0; i != order.size() && static_cast<int>(i) < peaks; ++i)
      kept[order[i]] = static_cast<float>(counts[order[i]]) >= floor ? 1 : 0;
    std::erase_if(candidates, [&](const candidate& c) { return kept[bin_of(c)] == 0; });
  }
};

static_assert(match_predicate<ratio_test> && match_predicate<cross_check> && match_predicate<max_distance>);
static_assert(match_filter<unique> && match_filter<rotation_consistency>);

}  // namespace orbis::features
