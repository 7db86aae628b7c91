// SPDX-License-Identifier: BSD-3-Clause
//
// Jacobians of residuals that are written by hand, against dual numbers.
#include <cmath>
#include <type_traits>

#include <orbis/core/random.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "dual_numbers.hpp"
#include "support.hpp"
#include "support/catch.hpp"
#include "templated_residuals.hpp"

using namespace orbis;
using optimize::lie_group;

/// The camera of BAL in any type of number.
template <class S>
struct lifted_bal {
  test::rigid<S> T_camera_world;
  S focal, k1, k2;
};
template <>
struct test::lift<optimize::bal_manifold> {
  template <class S>
  static lifted_bal<S> at(const optimize::bal_manifold&, const optimize::bal_camera& c, const matrix<9, 1, S>& d) {
    const matrix<3, 1, S> rho = d.template head<3>(), phi = d.template segment<3>(3);
    const mat3 rotation = c.T_camera_world.rotation_matrix();
    const matrix<3, 3, S> turn = matrix<3, 3, S>::Identity() - hat<S>(phi);
    return {{turn * rotation.cast<S>(), turn * c.T_camera_world.translation().cast<S>() - rho},
            c.focal + d[6],
            c.k1 + d[7],
            c.k2 + d[8]};
  }
};

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};
const camera::pinhole plain{k};
const camera::radial_tangential distorted{k, {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};
const camera::radial_tangential rational{
    k, {.k1 = 0.3, .k2 = 0.1, .p1 = 0.001, .p2 = -0.002, .k3 = 0.01, .k4 = 0.5, .k5 = 0.2, .k6 = 0.03}};
const camera::kannala_brandt fisheye{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}};

/// Residuals and Jacobians that are to be the same.
template <class A, class B>
void check_equal(const A& analytic, const B& by_dual_numbers) {
  CHECK((analytic - by_dual_numbers).norm() <= 1e-10 * (1.0 + by_dual_numbers.norm()));
}

template <class Camera>
struct reprojection_by_definition {
  Camera camera;
  double bf;
  template <class S>
  matrix<3, 1, S> operator()(const test::rigid<S>& T_world_camera, const matrix<3, 1, S>& point,
                             const optimize::bundle_observation& o) const {
    return test::reproject<S>(camera, bf, T_world_camera.inverse() * point, o.pixel, o.right);
  }
};

struct bal_by_definition {
  template <class S>
  matrix<2, 1, S> operator()(const lifted_bal<S>& c, const matrix<3, 1, S>& point,
                             const optimize::bundle_observation& o) const {
    const matrix<3, 1, S> p = c.T_camera_world * point;
    const S x = p.x() / p.z(), y = p.y() / p.z(), rr = x * x + y * y;
    const S factor = -c.focal * (1.0 + c.k1 * rr + c.k2 * rr * rr);
    return {factor * x - o.pixel.x(), factor * y - o.pixel.y()};
  }
};

struct plane_by_definition {
  template <class S>
  matrix<1, 1, S> operator()(const test::rigid<S>& T_world_camera, const matrix<3, 1, S>& point,
                             const optimize::plane_observation& o) const {
    const matrix<3, 1, S> measured = o.measured.cast<S>(), normal = o.normal.cast<S>();
    return matrix<1, 1, S>(normal.dot(T_world_camera * measured - point));
  }
};

template <class Residual, class Automatic, class Observation>
void check_bundle_residual(const Residual& analytic, const Automatic& by_dual_numbers,
                           const typename Residual::camera_state& camera, const vec3& point, const Observation& o) {
  static_assert(optimize::bundle_residual<Residual> && optimize::bundle_residual<Automatic>);
  constexpr int d = Residual::dimension, n = Residual::camera_manifold::dimension;
  matrix<d, n> camera_a = matrix<d, n>::Zero(), camera_b = camera_a;
  matrix<d, 3> point_a = matrix<d, 3>::Zero(), point_b = point_a;
  const auto a = analytic.linearize(analytic.prepare(camera), point, o, camera_a, point_a);
  const auto b = by_dual_numbers.linearize(by_dual_numbers.prepare(camera), point, o, camera_b, point_b);
  REQUIRE((a && b));
  check_equal(*a, *b);
  check_equal(camera_a, camera_b);
  check_equal(point_a, point_b);
}

template <class Camera>
void check_reprojection(const Camera& camera) {
  random_bits random(7);
  const optimize::reprojection analytic{camera, 38.0};
  const test::automatic_bundle_residual by_dual_numbers{reprojection_by_definition<Camera>{camera, 38.0},
                                                        lie_group<se3>{}};
  for (std::uint32_t trial = 0; trial != 100; ++trial) {
    const se3 pose = test::random_pose(random);
    const vec3 p = test::random_point_in_view(random);
    optimize::bundle_observation o{.pixel = vec2(300.0, 200.0)};
    if (trial % 2 == 0) o.right = 280.0;
    check_bundle_residual(analytic, by_dual_numbers, pose, pose * p, o);

    mat3 j = mat3::Zero();
    const auto r = analytic.residual(p, {.pixel = o.pixel, .right = o.right}, j);
    const test::automatic in_camera{[&](const auto& q) {
                                      return test::reproject<typename std::decay_t<decltype(q)>::Scalar>(
                                          camera, 38.0, q, o.pixel, o.right);
                                    },
                                    test::euclidean<3>{}};
    mat3 expected = mat3::Zero();
    const auto s = in_camera.linearize(p, expected);
    REQUIRE((r && s));
    check_equal(*r, *s);
    check_equal(j, expected);
  }
}

}  // namespace

TEST_CASE("Analytic Jacobians of reprojection are those of dual numbers, for every camera model") {
  check_reprojection(plain);
  check_reprojection(distorted);
  check_reprojection(rational);
  check_reprojection(fisheye);
}

TEST_CASE("Analytic Jacobians of the camera with nine parameters are those of dual numbers") {
  random_bits random(17);
  for (int trial = 0; trial != 100; ++trial) {
    const optimize::bal_camera c{test::random_pose(random), random.uniform(300.0, 900.0), random.uniform(-0.2, 0.2),
                                 random.uniform(-0.1, 0.1)};
    const vec3 p = test::random_point_in_view(random);
    check_bundle_residual(optimize::bal_reprojection{},
                          test::automatic_bundle_residual{bal_by_definition{}, optimize::bal_manifold{}}, c,
                          c.T_camera_world.inverse() * vec3(p.x(), p.y(), -p.z()),
                          optimize::bundle_observation{.pixel = vec2(10.0, -20.0)});
  }
}

TEST_CASE("Analytic Jacobians of point to plane are those of dual numbers") {
  random_bits random(27);
  for (int trial = 0; trial != 100; ++trial) {
    const se3 pose = test::random_pose(random);
    const optimize::plane_observation o{.measured = test::random_point_in_view(random),
                                        .normal = test::random_vector(random, 1.0).normalized()};
    const vec3 point = test::random_vector(random, 4.0);
    check_bundle_residual(
        optimize::point_to_plane_adjustment{},
        test::automatic_bundle_residual<plane_by_definition, lie_group<se3>, optimize::plane_observation>{
            plane_by_definition{}},
        pose, point, o);

    const optimize::point_to_plane alone{o.measured, point, o.normal, 2.5};
    const test::automatic by_dual_numbers{
        [&](const auto& T_world_camera) {
          using S = typename std::decay_t<decltype(T_world_camera.translation)>::Scalar;
          return matrix<1, 1, S>(std::sqrt(2.5) * plane_by_definition{}(T_world_camera, point.cast<S>().eval(), o)[0]);
        },
        lie_group<se3>{}};
    matrix<1, 6> j = matrix<1, 6>::Zero(), expected = j;
    const auto a = alone.linearize(pose, j), b = by_dual_numbers.linearize(pose, expected);
    REQUIRE((a && b));
    check_equal(*a, *b);
    check_equal(j, expected);
    CHECK(*a == *alone.residual(pose));
  }
}
