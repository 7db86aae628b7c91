// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/bal_reprojection.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/residual.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};

/// `linearize` against central differences, relative to the size of each Jacobian.
template <optimize::bundle_residual R>
void check_jacobians(const R& residual, const typename R::camera_state& state, const vec3& point,
                     const bundle_observation& o) {
  constexpr int size = R::camera_manifold::dimension;
  const typename R::camera_manifold manifold{};
  matrix<R::dimension, size> by_camera, numeric_camera;
  matrix<R::dimension, 3> by_point, numeric_point;
  const auto r = residual.linearize(residual.prepare(state), point, o, by_camera, by_point);
  REQUIRE(r);
  REQUIRE((*r - *residual.residual(residual.prepare(state), point, o)).norm() <= 1e-12 * (1.0 + r->norm()));
  const double h = 1e-5;
  for (int i = 0; i != size; ++i) {
    const auto at = [&](double step) {
      const auto moved = manifold.retract(state, matrix<size>(step * matrix<size>::Unit(i)));
      return *residual.residual(residual.prepare(moved), point, o);
    };
    numeric_camera.col(i) = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
  }
  for (int i = 0; i != 3; ++i) {
    const auto at = [&](double step) {
      return *residual.residual(residual.prepare(state), vec3(point + step * vec3::Unit(i)), o);
    };
    numeric_point.col(i) = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
  }
  for (int i = 0; i != size; ++i)
    CHECK((by_camera.col(i) - numeric_camera.col(i)).norm() <= 1e-6 * (1e-2 + by_camera.col(i).norm()));
  CHECK((by_point - numeric_point).norm() <= 1e-6 * by_point.norm());
}

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
    check_jacobians(model, pose, point, o);
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

TEST_CASE("BAL residuals have the derivatives they claim and follow the format's formula") {
  random_bits random(12);
  const optimize::bal_reprojection model;
  for (int trial = 0; trial != 50; ++trial) {
    std::array<double, 9> p{};
    for (std::size_t i = 0; i != 3; ++i) p[i] = random.uniform(-1.5, 1.5), p[3 + i] = random.uniform(-2, 2);
    p[6] = random.uniform(300, 1000);
    p[7] = random.uniform(-0.1, 0.1);
    p[8] = random.uniform(-0.02, 0.02);
    const auto state = optimize::bal_camera::from_parameters(p);
    for (std::size_t i = 0; i != 9; ++i) CHECK(state.parameters()[i] == Approx(p[i]).epsilon(1e-12).margin(1e-12));
    vec3 q = test::random_point_in_view(random);
    if (trial % 4 != 0) q = -q;  // in front of this camera; the format does not ask
    const vec3 point = state.T_camera_world.inverse() * q;
    const bundle_observation o{.pixel = vec2(random.uniform(-300, 300), random.uniform(-300, 300))};
    check_jacobians(model, state, point, o);
    const double s = (q.x() * q.x() + q.y() * q.y()) / (q.z() * q.z());
    const vec2 expected = -p[6] * (1.0 + p[7] * s + p[8] * s * s) * q.head<2>() / q.z();
    CHECK((*model.residual(model.prepare(state), point, o) + o.pixel - expected).norm() < 1e-9 * (1 + expected.norm()));
    const matrix<9> d = 0.1 * matrix<9>::Random();
    const auto there = optimize::bal_manifold::retract(state, d);
    CHECK((optimize::bal_manifold::local(state, there) - d).norm() < 1e-9);
  }
  const optimize::bal_camera straight;
  CHECK_FALSE(model.residual(model.prepare(straight), vec3(1, 1, 0), {}));
}
