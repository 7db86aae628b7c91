// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/depth/alignment.hpp>

#include "slam/detail/depth/planes.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

vec6 vector6(double a, double b, double c, double d, double e, double f) {
  vec6 v;
  v << a, b, c, d, e, f;
  return v;
}
const auto rig = test::small_rig();

/// The surface that a camera at the origin sees of planes, and samples of the same from elsewhere.
struct view {
  surface seen;
  std::vector<surface_sample> samples;
  view(const std::vector<test::plane>& planes, const se3& pose) {
    surface_builder<camera::pinhole> builder;
    surface there;
    builder.build(rig.camera(), test::metres(test::depth_of(planes, se3{}, rig.camera())), 1.0 / 400.0, 0.1, 10.0,
                  seen);
    builder.build(rig.camera(), test::metres(test::depth_of(planes, pose, rig.camera())), 1.0 / 400.0, 0.1, 10.0,
                  there);
    surface_sampler{}.choose(there, 300, samples);
  }
  [[nodiscard]] std::vector<plane_observation_of_row> planes_at(const moving_pose& at,
                                                                const camera::shutter& shutter = {}) const {
    std::vector<plane_observation_of_row> planes;
    const placed_surface place{&seen, se3{}};
    associate<camera::pinhole>(samples, 1, std::span(&place, 1), at, shutter, rig, {.distance = 0.2}, planes);
    return planes;
  }
};

/// What `build_equations` is the expansion of, where no residual is large.
double cost_of(std::span<const plane_observation_of_row> planes, const se3& T_camera_world, const vec6& twist) {
  double sum = 0.0;
  for (const plane_observation_of_row& o : planes) {
    optimize::point_to_plane seen = o.seen;
    seen.measured = moved_by(twist, o.time, seen.measured);
    sum += 0.5 * seen.residual(T_camera_world.inverse())->squaredNorm();
  }
  return sum;
}

}  // namespace

TEST_CASE("The equations of depth are the derivatives of its cost by pose and twist") {
  const view seen{test::corner(), se3::exp(vector6(0.05, 0.02, -0.04, 0.03, -0.02, 0.02))};
  const moving_pose at{se3::exp(vector6(0.05, 0.021, -0.039, 0.03, -0.02, 0.02)),
                       vector6(0.02, -0.03, 0.01, 0.02, -0.01, 0.03)};
  auto planes = seen.planes_at(at, {.color_read_out = 0.03, .depth_read_out = 0.03, .depth_delay = 0.01});
  std::erase_if(planes, [&](const plane_observation_of_row& o) {  // across an edge
    return cost_of(std::span(&o, 1), at.T_world_camera.inverse(), at.twist) > 0.5;
  });
  REQUIRE(planes.size() > 200);
  const depth_equations e = build_equations(planes, at, 1e9, 0.0);
  CHECK(e.determined == 6);
  const se3 T_camera_world = at.T_world_camera.inverse();
  CHECK(e.term.cost == Catch::Approx(cost_of(planes, T_camera_world, at.twist)));
  constexpr double h = 1e-5;
  for (int k = 0; k != 12; ++k) {
    const auto there = [&](double step) {
      vec6 by_pose = vec6::Zero(), by_twist = vec6::Zero();
      (k < 6 ? by_pose : by_twist)[k % 6] = step;
      return cost_of(planes, se3::exp(by_pose) * T_camera_world, at.twist + by_twist);
    };
    const double up = there(h), down = there(-h), here = there(0.0);
    // The twist turns the camera a little between the frame's time and the row's, as in those of keypoints.
    CHECK(std::abs((up - down) / (2.0 * h) - e.term.g[k]) < 0.02 * e.term.g.segment(k / 6 * 6, 6).norm());
    CHECK((up - 2.0 * here + down) / (h * h) == Catch::Approx(e.term.h(k, k)).epsilon(0.05));
  }
}

TEST_CASE("A wall determines three directions of the pose, with a floor five, and a corner all") {
  const se3 pose = se3::exp(vector6(0.02, 0.01, -0.02, 0.01, -0.02, 0.01));
  const auto determined = [&](const std::vector<test::plane>& planes) {
    const auto seen = view{planes, pose}.planes_at({pose, vec6::Zero()});
    REQUIRE(seen.size() > 200);
    return build_equations(seen, {pose, vec6::Zero()}, 30.0, 0.002).determined;
  };
  CHECK(determined(test::wall()) == 3);
  CHECK(determined(test::wall_and_floor()) == 5);
  CHECK(determined(test::corner()) == 6);
}

TEST_CASE("What a surface leaves free is left alone") {
  const se3 pose = se3::exp(vector6(0.02, 0.01, -0.02, 0.01, -0.02, 0.0));
  const auto seen = view{test::wall(), pose}.planes_at({se3{}, vec6::Zero()});
  const depth_equations e = build_equations(seen, {se3{}, vec6::Zero()}, 30.0, 0.002);
  REQUIRE(e.determined == 3);
  const vec6 step = solve_step(e);
  const vec6 found = (pose * se3::exp(step)).log();  // what is left, as a motion of the pose
  CHECK(std::abs(found[2]) < 1e-3);
  CHECK(std::abs(found[3]) < 1e-3);
  CHECK(std::abs(found[4]) < 1e-3);
  CHECK(std::abs(step[5]) < 1e-3);  // about the wall's direction
  vec6 along = vec6::Zero();
  along[0] = 1.0;
  CHECK(std::abs(e.term.g.head<6>().dot(along)) < 1e-2 * e.term.g.head<6>().norm());
}

TEST_CASE("Many points count as no more than they are allowed to") {
  const se3 pose = se3::exp(vector6(0.0, 0.0, -0.01, 0.0, 0.0, 0.0));
  const auto seen = view{test::corner(), pose}.planes_at({se3{}, vec6::Zero()});
  const auto all = build_equations(seen, {se3{}, vec6::Zero()}, 1e9, 0.002);
  const auto few = build_equations(seen, {se3{}, vec6::Zero()}, 30.0, 0.002);
  const double share = 30.0 / static_cast<double>(seen.size());
  CHECK((few.term.h - share * all.term.h).norm() < 1e-9 * all.term.h.norm());
  CHECK((few.term.g - share * all.term.g).norm() < 1e-9 * all.term.g.norm());
}

TEST_CASE("Points that lie off a surface or look elsewhere are not compared with it") {
  const view seen{test::wall(), se3{}};
  CHECK(seen.planes_at({se3::exp(vector6(0, 0, 0.15, 0, 0, 0)), vec6::Zero()}).size() > 200);
  CHECK(seen.planes_at({se3::exp(vector6(0, 0, 0.25, 0, 0, 0)), vec6::Zero()}).empty());
  const placed_surface place{&seen.seen, se3{}};
  std::vector<plane_observation_of_row> planes;
  const moving_pose turned{se3::exp(vector6(0, 0, 0, 0, 0.2, 0)), vec6::Zero()};
  const auto compared = [&](double cosine) {
    return associate<camera::pinhole>(seen.samples, 1, std::span(&place, 1), turned, {}, rig,
                                      {.distance = 5.0, .cosine = cosine}, planes);
  };
  CHECK(compared(0.97).share() == 1.0);
  CHECK(compared(0.99).share() == 0.0);
  CHECK(compared(0.99).visible > 100);
}
