// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random geometry for the tests of the estimators.
#pragma once

#include <cmath>
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
inline double angle_between(const se3& a, const se3& b) { return (a.rotation().inverse() * b.rotation()).angle(); }
inline double distance_between(const se3& a, const se3& b) { return (a.translation() - b.translation()).norm(); }

}  // namespace orbis::test
