// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories: stamped poses, interpolation between them, and association of the time stamps of two sensors.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include <orbis/core/se3.hpp>

namespace orbis {

/// The camera pose at a time: `T_world_camera` at `timestamp` seconds.
struct stamped_pose {
  double timestamp = 0.0;
  se3 T_world_camera;
};

/// Poses sorted by time stamp.
using trajectory = std::vector<stamped_pose>;

/// Returns the pose at `timestamp` seconds. Between two poses at most `max_gap` seconds apart, interpolates the
/// position linearly and the rotation along the shortest path. Elsewhere, returns the nearest pose, or empty if it
/// is more than `max_distance` seconds away. O(log n). @pre `poses` is sorted by time
[[nodiscard]] inline std::optional<se3> interpolate(const trajectory& poses, double timestamp, double max_gap,
                                                    double max_distance) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), timestamp,
                                      [](const stamped_pose& p, double t) { return p.timestamp < t; });
  if (after != poses.end() && after->timestamp == timestamp) return after->T_world_camera;
  if (after != poses.end() && after != poses.begin()) {
    const stamped_pose& a = after[-1];
    const stamped_pose& b = *after;
    if (b.timestamp - a.timestamp <= max_gap) {
      const double s = (timestamp - a.timestamp) / (b.timestamp - a.timestamp);
      const se3& A = a.T_world_camera;
      const se3& B = b.T_world_camera;
      return se3(A.rotation() * so3::exp(s * (A.rotation().inverse() * B.rotation()).log()),
                 (1.0 - s) * A.translation() + s * B.translation());
    }
  }
  const stamped_pose* nearest = nullptr;
  if (after != poses.end()) nearest = &*after;
  if (after != poses.begin() &&
      (nearest == nullptr || timestamp - after[-1].timestamp <= nearest->timestamp - timestamp))
    nearest = &after[-1];
  if (nearest == nullptr || std::abs(nearest->timestamp - timestamp) > max_distance) return std::nullopt;
  return nearest->T_world_camera;
}

/// A pair of indices into two lists.
struct index_pair {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  friend bool operator==(const index_pair&, const index_pair&) = default;
};

/// Pairs the time stamps (seconds) of two sorted lists, nearest pair first. Each stamp is used at most once, and the
/// stamps of a pair differ by at most `max_difference`. The pairs are returned in the order of `a`; ties go to the
/// earlier stamp. Only the `max_candidates` nearest neighbours on either side are considered for each stamp. O(n log
/// n).
/// @pre both lists are sorted and free of NaN
[[nodiscard]] inline std::vector<index_pair> associate(std::span<const double> a, std::span<const double> b,
                                                       double max_difference, std::size_t max_candidates = 8) {
  assert(std::is_sorted(a.begin(), a.end()) && std::is_sorted(b.begin(), b.end()));
  struct candidate {
    double difference;
    index_pair pair;
  };
  std::vector<candidate> candidates;
  std::size_t after = 0;  // index of the first stamp of b that is not before a[i]
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
