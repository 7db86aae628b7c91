// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/eval/ate.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/eval/rpe.hpp>

#include "support/catch.hpp"
#include "support/random_motion.hpp"

namespace eval = orbis::eval;
using orbis::se3;
using orbis::so3;
using orbis::trajectory;
using orbis::vec3;

namespace {

/// A drive round a circle; the camera turns with it by up to `turn` radians.
trajectory circle(std::size_t n, double turn) {
  trajectory poses;
  for (std::size_t i = 0; i != n; ++i) {
    const double s = static_cast<double>(i) / static_cast<double>(n);
    poses.push_back({0.1 * static_cast<double>(i),
                     se3(so3::exp(vec3(0, 0, turn * s)), vec3(2 * std::cos(6 * s), 2 * std::sin(6 * s), s))});
  }
  return poses;
}

trajectory with_rotation(trajectory poses, const so3& rotation) {
  for (auto& p : poses) p.T_world_camera = {rotation, p.T_world_camera.translation()};
  return poses;
}

}  // namespace

TEST_CASE("a reference with equal orientations gives ATE and no RPE if the estimate turns") {
  constexpr double degree = std::numbers::pi / 180.0;
  const trajectory turning = circle(50, 6.0), rails = circle(50, 0.0);
  for (std::uint64_t seed = 0; seed != 40; ++seed) {
    orbis::random_bits random{seed};
    const so3 any = seed == 0 ? so3{} : orbis::test::random_motion(random, 1.0, 2.0).rotation();
    const trajectory positions = with_rotation(turning, any);
    const auto refused = eval::rpe(turning, positions);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == orbis::errc::degenerate);
    CHECK(refused.error().message.find("no orientations") != std::string::npos);
    CHECK(eval::ate(turning, positions).value().translation.rmse < 1e-9);
    // On rails, and with a complete reference, there is an RPE.
    CHECK(eval::rpe(with_rotation(rails, orbis::test::random_motion(random, 1.0, 2.0).rotation()), positions));
    CHECK(eval::rpe(circle(50, 0.5 * degree), positions));
    CHECK(eval::rpe(turning, circle(50, 0.01 * degree)));
    CHECK(eval::has_equal_orientations(positions));
    CHECK(eval::has_positions_only(positions) == (seed == 0));
  }
  CHECK(eval::rpe(circle(4, 6.0), with_rotation(circle(4, 0.0), {})));  // too few to tell
  CHECK_FALSE(eval::has_equal_orientations(circle(4, 0.0)));
  CHECK_FALSE(eval::has_equal_orientations(circle(50, 0.01 * degree)));
  CHECK_FALSE(eval::has_equal_orientations(with_rotation(trajectory(20), so3::exp(vec3(1, 0, 0)))));
  CHECK_FALSE(eval::has_equal_orientations({}));
  CHECK_FALSE(eval::has_positions_only(circle(4, 0.0)));
  CHECK(eval::has_positions_only(rails));
  CHECK_FALSE(eval::has_positions_only(turning));
  CHECK_FALSE(eval::has_positions_only(trajectory(20)));  // a camera that stands still
  CHECK_FALSE(eval::has_positions_only({}));
}
