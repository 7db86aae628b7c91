// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/core/trajectory.hpp>

#include "support/catch.hpp"

TEST_CASE("a stamped pose begins at the origin and takes points of the camera to the world") {
  orbis::trajectory t(1);
  CHECK(t[0].timestamp == 0.0);
  CHECK(t[0].T_world_camera.to_matrix() == orbis::mat4::Identity());
  t.push_back({.timestamp = 2.5, .T_world_camera = {orbis::so3{}, {1, 2, 3}}});
  CHECK(t[1].T_world_camera * orbis::vec3{0, 0, 1} == orbis::vec3{1, 2, 4});
}

using orbis::interpolate;
using orbis::se3;
using orbis::so3;
using orbis::vec3;

namespace {
const orbis::trajectory poses{{1.0, se3(so3{}, vec3(0, 0, 0))},
                              {2.0, se3(so3::exp(vec3(0, 0, 1)), vec3(4, 0, 0))},
                              {9.0, se3(so3{}, vec3(5, 0, 0))}};
}

TEST_CASE("between two poses position and rotation are in proportion") {
  const auto pose = interpolate(poses, 1.25, 1.0, 0.0).value();
  CHECK(pose.translation().x() == Approx(1.0));
  CHECK((pose.rotation().log() - vec3(0, 0, 0.25)).norm() < 1e-12);
  CHECK(interpolate(poses, 2.0, 0.0, 0.0).value().translation().x() == 4.0);
}

TEST_CASE("across a gap and outside the nearest pose counts if it is near") {
  CHECK_FALSE(interpolate(poses, 5.0, 1.0, 0.5).has_value());
  CHECK(interpolate(poses, 2.4, 1.0, 0.5).value().translation().x() == 4.0);
  CHECK(interpolate(poses, 8.6, 1.0, 0.5).value().translation().x() == 5.0);
  CHECK(interpolate(poses, 0.9, 1.0, 0.5).value().translation().x() == 0.0);
  CHECK(interpolate(poses, 9.1, 1.0, 0.5).value().translation().x() == 5.0);
  CHECK_FALSE(interpolate(poses, 0.1, 1.0, 0.5).has_value());
  CHECK_FALSE(interpolate(poses, 9.9, 1.0, 0.5).has_value());
  CHECK_FALSE(interpolate({}, 1.0, 1.0, 0.5).has_value());
}

using orbis::index_pair;
using stamps = std::vector<double>;

TEST_CASE("the nearest pair is taken first and every stamp once") {
  // 1.2 is nearest to both 1.0 and 1.3; it goes to 1.3, and 1.0 takes the next best.
  CHECK(orbis::associate(stamps{1.0, 1.3}, stamps{0.7, 1.2}, 0.5) == std::vector<index_pair>{{0, 0}, {1, 1}});
  CHECK(orbis::associate(stamps{1.0, 1.3}, stamps{1.2}, 0.5) == std::vector<index_pair>{{1, 0}});
}

TEST_CASE("stamps further apart than allowed are not paired") {
  CHECK(orbis::associate(stamps{1.0, 2.0}, stamps{1.25, 2.5}, 0.25) == std::vector<index_pair>{{0, 0}});
  CHECK(orbis::associate(stamps{}, stamps{1.0}, 1.0).empty());
  CHECK(orbis::associate(stamps{1.0}, stamps{}, 1.0).empty());
}

TEST_CASE("equal differences go to the earlier stamp") {
  CHECK(orbis::associate(stamps{1.0}, stamps{0.5, 1.5}, 1.0) == std::vector<index_pair>{{0, 0}});
  CHECK(orbis::associate(stamps{0.5, 1.5}, stamps{1.0}, 1.0) == std::vector<index_pair>{{0, 0}});
}

TEST_CASE("many equal stamps do not take quadratic time") {
  const stamps same(200000, 1.0);
  CHECK(orbis::associate(same, same, 0.02).size() <= same.size());
}
