// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/detail/bundle/lane_residual.hpp>
#include <orbis/optimize/reprojection.hpp>

#include "residual_checks.hpp"
#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};

template <class Camera>
void check_reprojection(const Camera& camera) {
  static_assert(optimize::camera_frame_residual<optimize::reprojection<Camera>>);
  static_assert(optimize::detail::lane_residual<optimize::reprojection<Camera>>);
  random_bits random(11);
  const optimize::reprojection<Camera> model{camera, 40.0};
  for (int trial = 0; trial != 50; ++trial) {
    const se3 pose = test::random_pose(random);
    const vec3 point = pose * test::random_point_in_view(random);
    bundle_observation o{.pixel = vec2(random.uniform(0, 640), random.uniform(0, 480)), .information = 0.7};
    if (trial % 2 == 0) o.right = random.uniform(0, 640);
    if (trial % 4 == 0) o.depth_weight = 0.3;
    if (trial % 3 == 0) o.smear = vec2(random.uniform(-4, 4), random.uniform(-4, 4));
    test::check_jacobians(model, pose, point, o);
  }
  bundle_observation behind;
  matrix<3, 6> by_camera;
  mat3 by_point;
  CHECK_FALSE(model.residual(model.prepare(se3{}), vec3(0, 0, -1), behind));
  CHECK_FALSE(model.linearize(model.prepare(se3{}), vec3(0, 0, -1), behind, by_camera, by_point));
}

}  // namespace

TEST_CASE("Reprojection residuals have the derivatives they claim, for every camera model") {
  check_reprojection(camera::pinhole{k});
  check_reprojection(camera::radial_tangential{k, {.k1 = 0.26, .k2 = -0.95, .p1 = -0.005, .p2 = 0.003, .k3 = 1.16}});
  check_reprojection(camera::kannala_brandt{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}});
}

TEST_CASE("Errors along the smear of a pixel count less, those across it and of the depth as before") {
  const optimize::reprojection<camera::pinhole> model{camera::pinhole{k}, 40.0};
  const vec3 point(0.3, -0.2, 2.0);
  const vec2 pixel = *model.camera.project(point), along = vec2(0.8, 0.6), across = vec2(-0.6, 0.8);
  optimize::pose_observation o{.pixel = pixel + along, .smear = 3.0 * along};
  CHECK(norm(*model.residual(point, o)) == Catch::Approx(1.0 / std::sqrt(10.0)));
  o.pixel = pixel + across;
  CHECK(norm(*model.residual(point, o)) == Catch::Approx(1.0));

  // With a long smear along the row, the third coordinate is the error of the depth alone.
  o.pixel = pixel + vec2(5.0, 0.0);
  o.right = model.right(o.pixel.x(), 2.1);
  o.depth_weight = 0.5;
  o.smear = vec2(1e4, 0.0);
  const vec3 r = *model.residual(point, o);
  CHECK(std::abs(r[0]) < 1e-2);
  CHECK(r[2] == Catch::Approx(0.5 * (40.0 / 2.1 - 40.0 / 2.0)).margin(1e-2));

  const optimize::pose_observation same = optimize::without_smear(o);
  CHECK(same.smear == vec2(zeros<vec2>()));
  CHECK(same.information == Catch::Approx(1e-8));
  CHECK(same.information * same.depth_weight * same.depth_weight == Catch::Approx(0.25));
}
