// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <limits>

#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "dual_numbers.hpp"
#include "residual_checks.hpp"
#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using camera::parameters_of;
using optimize::posed_camera;
using optimize::reprojection_with_intrinsics;

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};

// The models once more, straight from their definitions, with parameters of any type of number.
template <class S>
matrix<2, 1, S> project(const camera::pinhole&, const matrix<4, 1, S>& a, const matrix<3, 1, S>& p) {
  return {a[0] * p.x() / p.z() + a[2], a[1] * p.y() / p.z() + a[3]};
}
template <class S>
matrix<2, 1, S> project(const camera::radial_tangential&, const matrix<12, 1, S>& a, const matrix<3, 1, S>& p) {
  const S x = p.x() / p.z(), y = p.y() / p.z(), s = x * x + y * y;
  const S g = (1.0 + a[4] * s + a[5] * s * s + a[8] * s * s * s) / (1.0 + a[9] * s + a[10] * s * s + a[11] * s * s * s);
  const S u = g * x + 2.0 * a[6] * x * y + a[7] * (s + 2.0 * x * x);
  const S v = g * y + a[6] * (s + 2.0 * y * y) + 2.0 * a[7] * x * y;
  return {a[0] * u + a[2], a[1] * v + a[3]};
}
template <class S>
matrix<2, 1, S> project(const camera::kannala_brandt&, const matrix<8, 1, S>& a, const matrix<3, 1, S>& p) {
  using std::atan2, std::sqrt, std::pow;
  const S r = sqrt(p.x() * p.x() + p.y() * p.y()), theta = atan2(r, p.z());
  const S t = theta + a[4] * pow(theta, 3.0) + a[5] * pow(theta, 5.0) + a[6] * pow(theta, 7.0) + a[7] * pow(theta, 9.0);
  return {a[0] * t * p.x() / r + a[2], a[1] * t * p.y() / r + a[3]};
}

/// Whether two columns agree to `share` of their size, or of what there is to see in pixels.
bool agree(const vec3& a, const vec3& b, double share) { return (a - b).norm() <= share * (1.0 + b.norm()); }

/// The derivatives by the intrinsics against dual numbers, all of them against central differences.
template <class Camera, int... Free>
void check_jacobians(const Camera& truth) {
  using model_type = reprojection_with_intrinsics<Camera, Free...>;
  using manifold = typename model_type::camera_manifold;
  constexpr int count = parameters_of<Camera>::count, size = manifold::dimension;
  using number = test::dual<15>;  // enough for all models, so that there is one kind to compile
  static_assert(count + 3 <= 15);
  static_assert(optimize::camera_frame_residual<model_type>);
  random_bits random(21);
  const model_type model{.bf = 40.0};
  for (int trial = 0; trial != 30; ++trial) {
    const posed_camera<Camera> state{test::random_pose(random), truth};
    const vec3 point = state.T_world_camera * test::random_point_in_view(random);
    optimize::bundle_observation o{.pixel = vec2(random.uniform(0, 640), random.uniform(0, 480))};
    if (trial % 2 == 0) o.right = random.uniform(0, 640);

    matrix<3, size> by_camera;
    mat3 by_point;
    const auto view = model.prepare(state);
    const vec3 q = view.rotation * point + view.translation;
    const auto r = model.linearize(view, point, o, by_camera, by_point);
    REQUIRE(r);
    CHECK((*r - *model.residual(view, point, o)).norm() <= 1e-12 * (1.0 + r->norm()));

    matrix<count, 1, number> a;
    matrix<3, 1, number> p;
    const auto values = parameters_of<Camera>::get(truth);
    for (int i = 0; i != count; ++i) a[i] = number::variable(values[i], i);
    for (int i = 0; i != 3; ++i) p[i] = number::variable(q[i], count + i);
    const matrix<2, 1, number> pixel = project<number>(truth, a, p);
    const number shifted = pixel.x() - 40.0 / p.z();
    mat3 by_q;
    matrix<3, model_type::intrinsic_dimension> by_intrinsics;
    REQUIRE(model.linearize_in_camera(view, q, o, by_q, by_intrinsics));
    for (int i = 0; i != model_type::intrinsic_dimension; ++i) {
      const int at = manifold::free[static_cast<std::size_t>(i)];
      const vec3 exact(pixel.x().slope[at], pixel.y().slope[at], trial % 2 == 0 ? shifted.slope[at] : 0.0);
      CHECK(agree(by_intrinsics.col(i), exact, 1e-10));
      CHECK(by_intrinsics.col(i) == by_camera.col(6 + i));
    }
    for (int i = 0; i != 3; ++i) {
      const vec3 exact(pixel.x().slope[count + i], pixel.y().slope[count + i],
                       trial % 2 == 0 ? shifted.slope[count + i] : 0.0);
      CHECK(agree(by_q.col(i), exact, 1e-10));
    }

    for (int i = 0; i != size; ++i) {
      const double h = i < 6 ? 1e-5 : manifold::free[static_cast<std::size_t>(i - 6)] < 4 ? 1e-2 : 1e-5;
      const auto at = [&](double step) {
        const auto moved = manifold::retract(state, matrix<size>(step * matrix<size>::Unit(i)));
        return *model.residual(model.prepare(moved), point, o);
      };
      const vec3 numeric = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
      CHECK((by_camera.col(i) - numeric).norm() <= 1e-6 * (1e-2 + by_camera.col(i).norm()));
    }

    matrix<size> d;
    for (int i = 0; i != size; ++i) d[i] = 0.01 * random.normal();
    const auto there = manifold::retract(state, d);
    CHECK(((state.T_world_camera.inverse() * there.T_world_camera).log() - d.template head<6>()).norm() < 1e-9);
    const auto from = parameters_of<Camera>::get(state.camera), to = parameters_of<Camera>::get(there.camera);
    for (std::size_t i = 0; i != manifold::free.size(); ++i)
      CHECK(std::abs(to[manifold::free[i]] - from[manifold::free[i]] - d[6 + static_cast<int>(i)]) < 1e-9);
  }
}

}  // namespace

TEST_CASE("Residuals with intrinsics have the derivatives they claim, for every camera model") {
  check_jacobians(camera::pinhole{k});
  check_jacobians(camera::radial_tangential{
      k, {.k1 = 0.26, .k2 = -0.55, .p1 = -0.005, .p2 = 0.003, .k3 = 0.66, .k4 = 0.03, .k5 = 0.02, .k6 = 0.01}});
  check_jacobians<camera::radial_tangential, 0, 1, 4, 11>(camera::radial_tangential{k, {.k1 = 0.1, .k2 = 0.05}});
  check_jacobians(camera::kannala_brandt{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}});
}

TEST_CASE("A step that would leave no camera goes as far as there is one") {
  using model = reprojection_with_intrinsics<camera::pinhole, 0>;
  const posed_camera<camera::pinhole> state{se3{}, camera::pinhole{k}};
  matrix<7> d = matrix<7>::Zero();
  d[0] = 0.5;
  d[6] = -3.0 * k.fx;
  const auto there = model::camera_manifold::retract(state, d);
  CHECK(there.camera.k().fx == Approx(k.fx - 0.75 * k.fx));
  CHECK(there.camera.k().fy == k.fy);
  CHECK(there.T_world_camera.translation().x() == Approx(0.5));
  d[6] = std::numeric_limits<double>::quiet_NaN();
  CHECK(model::camera_manifold::retract(state, d).camera == state.camera);
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
    const optimize::bundle_observation o{.pixel = vec2(random.uniform(-300, 300), random.uniform(-300, 300))};
    test::check_jacobians(model, state, point, o);
    const double s = (q.x() * q.x() + q.y() * q.y()) / (q.z() * q.z());
    const vec2 expected = -p[6] * (1.0 + p[7] * s + p[8] * s * s) * q.head<2>() / q.z();
    CHECK((*model.residual(model.prepare(state), point, o) + o.pixel - expected).norm() < 1e-9 * (1 + expected.norm()));
    const matrix<9> d = 0.1 * matrix<9>::Random();
    const auto there = optimize::bal_manifold::retract(state, d);
    CHECK(((there.T_camera_world * state.T_camera_world.inverse()).log() + d.head<6>()).norm() < 1e-9);
    CHECK((vec3(there.focal - state.focal, there.k1 - state.k1, there.k2 - state.k2) - d.tail<3>()).norm() < 1e-9);
  }
  const optimize::bal_camera straight;
  CHECK_FALSE(model.residual(model.prepare(straight), vec3(1, 1, 0), {}));
}
