// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/tracking/motion_model.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::detail::motion_model;
using slam::detail::timed_pose;

TEST_CASE("Constant motion goes on in proportion to time, for three intervals at most") {
  const vec6 step = (vec6() << 0.01, 0.02, -0.01, 0.05, 0.0, 0.02).finished();
  const timed_pose first{1.0, se3(so3::exp(vec3(0.3, 0, 0)), vec3(1, 2, 3))};
  const timed_pose second{1.1, first.T_world_camera * se3::exp(step)};
  motion_model motion;
  CHECK_FALSE(motion.is_known());
  const auto error = [](const se3& a, const se3& b) { return (a.inverse() * b).log().norm(); };
  CHECK(error(motion.predict(second, 1.2), second.T_world_camera) == 0.0);
  motion.set(first, second);
  CHECK(motion.is_known());
  CHECK(error(motion.predict(second, 1.2), second.T_world_camera * se3::exp(step)) < 1e-9);
  CHECK(error(motion.predict(second, 1.15), second.T_world_camera * se3::exp(0.5 * step)) < 1e-9);
  CHECK(error(motion.predict(second, 9.0), second.T_world_camera * se3::exp(3.0 * step)) < 1e-9);
  CHECK(error(motion.predict(second, 0.5), second.T_world_camera) < 1e-9);
  motion.scale_by(5.0);
  vec6 longer = step;
  longer.head<3>() *= 5.0;
  CHECK(error(motion.predict(second, 1.2), second.T_world_camera * se3::exp(longer)) < 1e-9);
  motion.reset();
  motion.scale_by(5.0);
  CHECK(error(motion.predict(second, 1.2), second.T_world_camera) == 0.0);
}

TEST_CASE("Frames at the same time move by one step") {
  const timed_pose first{1.0, se3{}}, second{1.0, se3(so3{}, vec3(0.1, 0, 0))};
  motion_model motion;
  motion.set(first, second);
  CHECK((motion.predict(second, 5.0).translation() - vec3(0.2, 0, 0)).norm() < 1e-12);
}
