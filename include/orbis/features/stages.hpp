// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The stages of a matcher: each rejects candidates according to one criterion.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include <orbis/features/match.hpp>

namespace orbis::features {

/// Keeps a candidate whose distance is less than `ratio` times the second-nearest distance. A candidate without a
/// second-nearest neighbour is kept; equal distances never pass. Source: Lowe, "Distinctive image features from
/// scale-invariant keypoints", IJCV 2004, section 7.1.
struct ratio_test {
  float ratio = 0.8F;
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept {
    return c.second_distance == none || static_cast<float>(c.distance) < ratio * static_cast<float>(c.second_distance);
  }
};

/// Keeps a candidate if both descriptors are nearest neighbours of each other.
struct cross_check {
  static constexpr search_needs needs{.reverse = true};
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept { return c.reverse_query == c.query; }
};

/// Keeps a candidate with a distance of at most `distance`.
struct max_distance {
  std::uint32_t distance = 50;
  [[nodiscard]] constexpr bool operator()(const candidate& c) const noexcept { return c.distance <= distance; }
};

/// Of the candidates with the same train descriptor, keeps the nearest (the lowest query on ties). Unlike
/// `cross_check`, only candidates left by earlier stages compete.
struct unique {
  using workspace = std::vector<std::uint32_t>;  ///< the smallest distance for each train descriptor

  void operator()(std::vector<candidate>& candidates, std::span<const keypoint>, std::span<const keypoint>,
                  workspace& nearest) const {
    std::size_t trains = 0;
    for (const candidate& c : candidates) trains = std::max(trains, std::size_t{c.train} + 1);
    nearest.assign(trains, none);
    for (const candidate& c : candidates) nearest[c.train] = std::min(nearest[c.train], c.distance);
    std::erase_if(candidates, [&](const candidate& c) {
      if (c.distance != nearest[c.train]) return true;
      nearest[c.train] = none;  // mark as assigned, to reject later candidates with the same distance
      return false;
    });
  }
};

/// Keeps the candidates whose change of orientation is among the most frequent: between two images with a relative
/// rotation, the keypoints of true matches rotate by the same angle. The angle differences fill `bins` equal bins
/// around the circle; candidates in the `peaks` fullest bins are kept (the lowest bins on ties), except in bins with
/// less than `weakest` times the count of the fullest.
struct rotation_consistency {
  static constexpr search_needs needs{.keypoints = true};
  int bins = 30;
  int peaks = 3;
  float weakest = 0.1F;
  struct workspace {
    std::vector<std::uint32_t> counts, order;
    std::vector<char> kept;
  };

  /// @pre one keypoint per descriptor on both sides; bins > 0
  void operator()(std::vector<candidate>& candidates, std::span<const keypoint> queries,
                  std::span<const keypoint> trains, workspace& memory) const {
    assert(bins > 0);
    const auto bin_of = [&](const candidate& c) {
      constexpr float turn = 2.0F * std::numbers::pi_v<float>;
      const float difference = (queries[c.query].angle - trains[c.train].angle) / turn;
      const float fraction = difference - std::floor(difference);  // in [0, 1]: may be rounded up to 1
      if (!std::isfinite(fraction)) return std::size_t{0};
      // Bins are centred on multiples of their width, so that a rotation of zero is in the middle of a bin.
      return static_cast<std::size_t>(fraction * static_cast<float>(bins) + 0.5F) % static_cast<std::size_t>(bins);
    };
    auto& [counts, order, kept] = memory;
    counts.assign(static_cast<std::size_t>(bins), 0);
    for (const candidate& c : candidates) ++counts[bin_of(c)];

    order.resize(counts.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&counts = counts](std::uint32_t a, std::uint32_t b) {
      return counts[a] != counts[b] ? counts[a] > counts[b] : a < b;
    });
    const auto floor = weakest * static_cast<float>(counts[order.front()]);
    kept.assign(counts.size(), 0);
    for (std::size_t i = 0; i != order.size() && static_cast<int>(i) < peaks; ++i)
      kept[order[i]] = static_cast<float>(counts[order[i]]) >= floor ? 1 : 0;
    std::erase_if(candidates, [&](const candidate& c) { return memory.kept[bin_of(c)] == 0; });
  }
};

static_assert(match_predicate<ratio_test> && match_predicate<cross_check> && match_predicate<max_distance>);
static_assert(match_filter<unique> && match_filter<rotation_consistency>);

}  // namespace orbis::features
