// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/optimize/automatic.hpp>
#include <orbis/optimize/bal_reprojection.hpp>
#include <orbis/optimize/between_factor.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/optimize/prior.hpp>
#include <orbis/optimize/reprojection.hpp>

#include "support.hpp"
#include "support/catch.hpp"
#include "templated_residuals.hpp"

using namespace orbis;
using optimize::lie_group;

/// The camera of BAL in any type of number.
template <class S>
struct lifted_bal {
  optimize::rigid<S> T_camera_world;
  S focal, k1, k2;
};
template <>
struct optimize::lift<optimize::bal_manifold> {
  template <class S>
  static lifted_bal<S> at(const bal_manifold&, const bal_camera& c, const matrix<9, 1, S>& d) {
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
  matrix<3, 1, S> operator()(const optimize::rigid<S>& T_world_camera, const matrix<3, 1, S>& point,
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
  matrix<1, 1, S> operator()(const optimize::rigid<S>& T_world_camera, const matrix<3, 1, S>& point,
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
  const optimize::automatic_bundle_residual by_dual_numbers{reprojection_by_definition<Camera>{camera, 38.0},
                                                            lie_group<se3>{}};
  for (std::uint32_t trial = 0; trial != 100; ++trial) {
    const se3 pose = test::random_pose(random);
    const vec3 p = test::random_point_in_view(random);
    optimize::bundle_observation o{.pixel = vec2(300.0, 200.0)};
    if (trial % 2 == 0) o.right = 280.0;
    check_bundle_residual(analytic, by_dual_numbers, pose, pose * p, o);

    mat3 j = mat3::Zero();
    const auto r = analytic.residual(p, {.pixel = o.pixel, .right = o.right}, j);
    const optimize::automatic in_camera{[&](const auto& q) {
                                          return test::reproject<typename std::decay_t<decltype(q)>::Scalar>(
                                              camera, 38.0, q, o.pixel, o.right);
                                        },
                                        optimize::euclidean<3>{}};
    mat3 expected = mat3::Zero();
    const auto s = in_camera.linearize(p, expected);
    REQUIRE((r && s));
    check_equal(*r, *s);
    check_equal(j, expected);
  }
}

template <class Group, class Factor, class F>
void check_between(const Factor&, const F& by_definition, const Group& a, const Group& b, const Group& measured) {
  constexpr int d = Factor::dimension, n = Group::dof;
  matrix<d, n> by_a = matrix<d, n>::Zero(), by_b = by_a, expected_a = by_a, expected_b = by_a;
  const auto r = Factor::linearize(a, b, measured, by_a, by_b);
  const optimize::automatic by_dual_numbers{by_definition, lie_group<Group>{}, lie_group<Group>{}};
  const auto s = by_dual_numbers.linearize(a, b, expected_a, expected_b);
  REQUIRE(s);
  check_equal(r, *s);
  check_equal(by_a, expected_a);
  check_equal(by_b, expected_b);
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
                          optimize::automatic_bundle_residual{bal_by_definition{}, optimize::bal_manifold{}}, c,
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
        optimize::automatic_bundle_residual<plane_by_definition, lie_group<se3>, optimize::plane_observation>{
            plane_by_definition{}},
        pose, point, o);

    const optimize::point_to_plane alone{o.measured, point, o.normal, 2.5};
    const optimize::automatic by_dual_numbers{
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

TEST_CASE("Analytic Jacobians between poses are those of dual numbers") {
  random_bits random(37);
  for (int trial = 0; trial != 60; ++trial) {
    const se3 a = test::random_pose(random), b = test::random_pose(random);
    // What is left over is neither nothing nor nearly half a turn.
    const se3 rest(so3::exp(random.uniform(0.3, 2.5) * test::random_vector(random, 1.0).normalized()),
                   test::random_vector(random, 2.0));
    const se3 measured = a.inverse() * b * rest.inverse();
    const auto lifted = [&]<class S>(const optimize::rigid<S>& x, const optimize::rigid<S>& y) {
      const optimize::rigid<S> m{measured.rotation_matrix().cast<S>(), measured.translation().cast<S>()};
      return m.inverse() * (x.inverse() * y);
    };
    check_between(
        optimize::quaternion_between{},
        [&]<class S>(const optimize::rigid<S>& x, const optimize::rigid<S>& y) {
          const optimize::rigid<S> d = lifted(x, y);
          matrix<6, 1, S> r;
          r << d.translation, test::quaternion_vector<S>(d.rotation);
          return r;
        },
        a, b, measured);
    check_between(
        optimize::logarithm_between<se3>{},
        [&]<class S>(const optimize::rigid<S>& x, const optimize::rigid<S>& y) {
          return test::logarithm<S>(lifted(x, y));
        },
        a, b, measured);
    const mat3 back = measured.rotation_matrix().transpose();
    check_between(
        optimize::logarithm_between<so3>{},
        [&]<class S>(const Eigen::Matrix<S, 3, 3>& x, const Eigen::Matrix<S, 3, 3>& y) {
          return test::logarithm<S>(back.cast<S>() * (x.transpose() * y));
        },
        a.rotation(), b.rotation(), measured.rotation());
    const sim3 scaled_a(a.rotation(), a.translation(), random.uniform(0.5, 2.0));
    const sim3 scaled_b(b.rotation(), b.translation(), random.uniform(0.5, 2.0));
    const sim3 scaled(measured.rotation(), measured.translation(), random.uniform(0.5, 2.0));
    check_between(
        optimize::logarithm_between<sim3>{},
        [&]<class S>(const optimize::similarity<S>& x, const optimize::similarity<S>& y) {
          const optimize::similarity<S> m{scaled.rotation_matrix().cast<S>(), scaled.translation().cast<S>(),
                                          S(scaled.scale())};
          return test::logarithm<S>(m.inverse() * (x.inverse() * y));
        },
        scaled_a, scaled_b, scaled);
  }
}

TEST_CASE("Analytic Jacobians of priors are those of dual numbers") {
  random_bits random(47);
  for (int trial = 0; trial != 60; ++trial) {
    const se3 expected = test::random_pose(random);
    vec6 step;
    step << test::random_vector(random, 1.0), random.uniform(0.3, 2.5) * test::random_vector(random, 1.0).normalized();
    const se3 pose = expected * se3::exp(step);
    mat6 root;
    for (int i = 0; i != root.size(); ++i) root.data()[i] = random.normal();
    const optimize::pose_prior analytic{expected, root, {}};
    const optimize::automatic by_dual_numbers{
        [&]<class S>(const optimize::rigid<S>& x) {
          const optimize::rigid<S> from{expected.rotation_matrix().cast<S>(), expected.translation().cast<S>()};
          return matrix<6, 1, S>(root.cast<S>() * test::logarithm<S>(from.inverse() * x));
        },
        lie_group<se3>{}};
    mat6 a = mat6::Zero(), b = a;
    const auto r = analytic.linearize(pose, a), s = by_dual_numbers.linearize(pose, b);
    REQUIRE((r && s));
    check_equal(*r, *s);
    check_equal(a, b);
  }
}

TEST_CASE("Jacobians on spheres, vectors and restricted manifolds are those of their steps") {
  random_bits random(57);
  const auto distances = [](const auto& direction, const auto& v) {
    using S = typename std::decay_t<decltype(v)>::Scalar;
    return matrix<2, 1, S>(direction.dot(v), (direction - v).norm());
  };
  const optimize::automatic residual{distances, optimize::unit_sphere{}, optimize::euclidean<3>{}};
  static_assert(decltype(residual)::dimension == 2);
  for (int trial = 0; trial != 30; ++trial) {
    const vec3 p = test::random_vector(random, 1.0).normalized(), v = test::random_vector(random, 2.0);
    mat2 by_p = mat2::Zero();
    matrix<2, 3> by_v = matrix<2, 3>::Zero();
    const auto r = residual.linearize(p, v, by_p, by_v);
    REQUIRE(r);
    CHECK((*r - *residual.residual(p, v)).norm() < 1e-14);
    for (int i = 0; i != 2; ++i) {
      const vec2 h = 1e-6 * vec2::Unit(i);
      const vec2 slope = (*residual.residual(optimize::unit_sphere::retract(p, h), v) -
                          *residual.residual(optimize::unit_sphere::retract(p, -h), v)) /
                         2e-6;
      CHECK((slope - by_p.col(i)).norm() < 1e-7);
    }
    for (int i = 0; i != 3; ++i) {
      const vec3 h = 1e-6 * vec3::Unit(i);
      CHECK(((*residual.residual(p, v + h) - *residual.residual(p, v - h)) / 2e-6 - by_v.col(i)).norm() < 1e-7);
    }
  }
  using planar = optimize::subset<lie_group<se3>, 0, 1, 5>;
  const optimize::automatic_bundle_residual restricted{reprojection_by_definition<camera::pinhole>{plain, 40.0},
                                                       planar{}};
  static_assert(optimize::bundle_residual<std::decay_t<decltype(restricted)>>);
  const optimize::automatic_bundle_residual whole{reprojection_by_definition<camera::pinhole>{plain, 40.0},
                                                  lie_group<se3>{}};
  matrix<3, 3> few = matrix<3, 3>::Zero(), by_point = few;
  matrix<3, 6> all = matrix<3, 6>::Zero();
  const se3 pose = test::random_pose(random);
  const vec3 point = pose * vec3(0.2, 0.1, 2.0);
  REQUIRE(restricted.linearize(pose, point, {}, few, by_point));
  REQUIRE(whole.linearize(pose, point, {}, all, by_point));
  CHECK(few.col(0) == all.col(0));
  CHECK(few.col(2) == all.col(5));
}

TEST_CASE("A residual that has no value, or none that is finite, is empty and leaves the Jacobian alone") {
  const optimize::automatic sometimes{[](const auto& v) -> std::optional<std::decay_t<decltype(v)>> {
                                        if (optimize::value_of(v.x()) < 0.0) return std::nullopt;
                                        return v;
                                      },
                                      optimize::euclidean<3>{}};
  mat3 j = mat3::Constant(7.0);
  CHECK_FALSE(sometimes.residual(vec3(-1, 0, 0)));
  CHECK_FALSE(sometimes.linearize(vec3(-1, 0, 0), j));
  CHECK(j == mat3::Constant(7.0));
  CHECK(sometimes.linearize(vec3(1, 0, 0), j));
  CHECK(j == mat3::Identity());
  const optimize::automatic root{[](const auto& v) {
                                   using std::sqrt;
                                   auto out = v;
                                   out.x() = sqrt(v.x());
                                   return out;
                                 },
                                 optimize::euclidean<3>{}};
  CHECK(root.residual(vec3(0, 1, 1)));
  CHECK_FALSE(root.linearize(vec3(0, 1, 1), j));  // the slope at 0
  CHECK_FALSE(root.residual(vec3(-1, 1, 1)));
  CHECK_FALSE(root.residual(vec3(std::numeric_limits<double>::quiet_NaN(), 1, 1)));
}
