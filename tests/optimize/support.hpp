// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random geometry for the tests of the estimators.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::test {

inline vec3 random_vector(random_bits& random, double bound) {
  return {random.uniform(-bound, bound), random.uniform(-bound, bound), random.uniform(-bound, bound)};
}
inline se3 random_pose(random_bits& random, double translation = 3.0) {
  const vec3 axis = random_vector(random, 1.0).normalized();
  return {so3::exp(random.uniform(0.0, 3.1) * axis), random_vector(random, translation)};
}
/// A point one to five metres in front of the camera, within its image, in camera coordinates.
inline vec3 random_point_in_view(random_bits& random) {
  const double z = random.uniform(1.0, 5.0);
  return {random.uniform(-0.5, 0.5) * z, random.uniform(-0.4, 0.4) * z, z};
}
/// What the threshold of an inlier cannot be.
inline constexpr double bad_thresholds[] = {0.0, -1.0, std::numeric_limits<double>::infinity(),
                                            -std::numeric_limits<double>::infinity(),
                                            std::numeric_limits<double>::quiet_NaN()};

/// Whether `estimate(min_inliers, seed)` never answers with fewer inliers than asked, where that is about as many as
/// there are to be had; and does both, answer and fail.
template <class Estimate>
bool keeps_to_min_inliers(const Estimate& estimate) {
  std::size_t answers = 0, failures = 0;
  for (std::size_t seed = 1; seed <= 40; ++seed) {
    const auto free = estimate(std::size_t{0}, seed);
    if (!free) return false;
    const std::size_t most = free->inliers.size();
    for (std::size_t asked = most - 1; asked <= most + 3; ++asked) {
      const auto found = estimate(asked, seed);
      ++(found ? answers : failures);
      if (found && found->inliers.size() < asked) return false;
    }
  }
  return answers != 0 && failures != 0;
}

inline double angle_between(const se3& a, const se3& b) { return (a.rotation().inverse() * b.rotation()).angle(); }
inline double distance_between(const se3& a, const se3& b) { return (a.translation() - b.translation()).norm(); }

}  // namespace orbis::test
