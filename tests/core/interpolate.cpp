// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/interpolate.hpp>

#include "support/catch.hpp"

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
