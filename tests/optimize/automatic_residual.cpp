// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include <Eigen/Geometry>

#include <orbis/core/random.hpp>
#include <orbis/optimize/automatic_residual.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

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
    const test::automatic in_camera{[&](const auto& q) {
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
  const test::automatic by_dual_numbers{by_definition, lie_group<Group>{}, lie_group<Group>{}};
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
        [&]<class S>(const test::similarity<S>& x, const test::similarity<S>& y) {
          const test::similarity<S> m{scaled.rotation_matrix().cast<S>(), scaled.translation().cast<S>(),
                                      S(scaled.scale())};
          return test::logarithm<S>(m.inverse() * (x.inverse() * y));
        },
        scaled_a, scaled_b, scaled);
  }
}

TEST_CASE("Cameras that are vectors can be estimated") {
  // A camera of three numbers: its centre. The residual is the direction to the point.
  const auto direction = []<class S>(const matrix<3, 1, S>& centre, const matrix<3, 1, S>& point,
                                     const optimize::bundle_observation&) {
    return matrix<3, 1, S>((point - centre).normalized());
  };
  const optimize::automatic_bundle_residual residual{direction, optimize::euclidean<3>{}};
  static_assert(optimize::bundle_residual<std::decay_t<decltype(residual)>>);
  const vec3 centre(0.3, -0.2, 0.1), point(1.0, 2.0, 3.0);
  mat3 by_camera = mat3::Zero(), by_point = mat3::Zero();
  const auto r = residual.linearize(centre, point, {}, by_camera, by_point);
  REQUIRE(r);
  CHECK((*r - *residual.residual(centre, point, {})).norm() < 1e-14);
  for (int i = 0; i != 3; ++i) {
    const vec3 h = 1e-6 * vec3::Unit(i);
    const vec3 slope = (*residual.residual(centre, point + h, {}) - *residual.residual(centre, point - h, {})) / 2e-6;
    CHECK((slope - by_point.col(i)).norm() < 1e-8);
    CHECK((slope + by_camera.col(i)).norm() < 1e-8);
  }
}

TEST_CASE("A residual that has no value, or none that is finite, is empty and leaves the Jacobians alone") {
  const optimize::automatic_bundle_residual sometimes{
      []<class S>(const matrix<3, 1, S>&, const matrix<3, 1, S>& v,
                  const optimize::bundle_observation&) -> std::optional<matrix<3, 1, S>> {
        if (optimize::value_of(v.x()) < 0.0) return std::nullopt;
        return v;
      },
      optimize::euclidean<3>{}};
  const vec3 camera = vec3::Zero();
  mat3 by_camera = mat3::Constant(7.0), by_point = by_camera;
  CHECK_FALSE(sometimes.residual(camera, vec3(-1, 0, 0), {}));
  CHECK_FALSE(sometimes.linearize(camera, vec3(-1, 0, 0), {}, by_camera, by_point));
  CHECK(by_point == mat3::Constant(7.0));
  CHECK(by_camera == mat3::Constant(7.0));
  CHECK(sometimes.linearize(camera, vec3(1, 0, 0), {}, by_camera, by_point));
  CHECK(by_point == mat3::Identity());
  CHECK(by_camera == mat3::Zero());
  const optimize::automatic_bundle_residual root{
      []<class S>(const matrix<3, 1, S>&, const matrix<3, 1, S>& v, const optimize::bundle_observation&) {
        using std::sqrt;
        matrix<3, 1, S> out = v;
        out.x() = sqrt(v.x());
        return out;
      },
      optimize::euclidean<3>{}};
  CHECK(root.residual(camera, vec3(0, 1, 1), {}));
  CHECK_FALSE(root.linearize(camera, vec3(0, 1, 1), {}, by_camera, by_point));  // the slope at 0
  CHECK_FALSE(root.residual(camera, vec3(-1, 1, 1), {}));
  CHECK_FALSE(root.residual(camera, vec3(std::numeric_limits<double>::quiet_NaN(), 1, 1), {}));
}

namespace {

/// Value and both derivatives of `f(x, y)` beside numbers and central differences.
template <class F>
void check_derivatives(F&& f, double x, double y) {
  using number = optimize::dual<2>;
  const number result = f(number::variable(x, 0), number::variable(y, 1));
  CHECK(result.value == f(x, y));
  const double h = 1e-6;
  const double by_x = (f(x + h, y) - f(x - h, y)) / (2 * h), by_y = (f(x, y + h) - f(x, y - h)) / (2 * h);
  CHECK(std::abs(result.slope[0] - by_x) <= 1e-7 * (1.0 + std::abs(by_x)));
  CHECK(std::abs(result.slope[1] - by_y) <= 1e-7 * (1.0 + std::abs(by_y)));
}

}  // namespace

TEST_CASE("Dual numbers differentiate every function") {
  random_bits random(3);
  for (int trial = 0; trial != 40; ++trial) {
    const double x = random.uniform(0.1, 0.9), y = random.uniform(0.1, 0.9);
    check_derivatives([](auto a, auto b) { return a + 2.0 * b - a * b * 3.0 + b / a - (-a) + (+b) + 1.0 / b - 0.5; }, x,
                      y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sqrt, std::exp, std::log;
          return sqrt(a) * exp(b) + log(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sin, std::cos, std::tan;
          return sin(a) * cos(b) + tan(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::asin, std::acos, std::atan;
          return asin(a) + acos(b) * atan(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sinh, std::cosh, std::tanh;
          return sinh(a) + cosh(b) * tanh(a - b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::atan2, std::hypot;
          return atan2(a, b) + hypot(a, b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::pow;
          return pow(a, 2.5) + pow(a, b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::abs, std::log1p;
          return abs(a - 2.0 * b) + log1p(a);
        },
        x, y + 1.0);
    check_derivatives(
        [](auto a, auto b) {
          using std::min, std::max;
          return min(a, b) * max(a, b) * max(a, b);
        },
        x, y + 1.0);
    check_derivatives(
        [](auto a, auto b) {
          a += b;
          a *= b;
          a -= 0.3 * b;
          a /= b + 1.0;
          return a;
        },
        x, y);
  }
}

TEST_CASE("Dual numbers are scalars to Eigen") {
  using number = optimize::dual<3>;
  matrix<3, 1, number> v;
  for (int i = 0; i != 3; ++i) v[i] = number::variable(i + 1.0, i);
  const number n = v.norm();
  CHECK(n.value == Approx(std::sqrt(14.0)));
  for (int i = 0; i != 3; ++i) CHECK(n.slope[i] == Approx((i + 1.0) / std::sqrt(14.0)));
  mat3 m;
  m << 1, 2, 3, 4, 5, 6, 7, 8, 10;
  const matrix<3, 1, number> w = m.cast<number>() * v * 2.0;
  for (int r = 0; r != 3; ++r)
    for (int c = 0; c != 3; ++c) CHECK(w[r].slope[c] == Approx(2.0 * m(r, c)));
  const matrix<3, 1, number> u = v.normalized().cross(w);
  CHECK(isfinite(u[0]));
  CHECK(optimize::value_of(v.dot(v)) == Approx(14.0));
}

TEST_CASE("Dual numbers compare by their value and say when they are not finite") {
  using number = optimize::dual<1>;
  const number a = number::variable(1.0, 0), b(2.0);
  CHECK((a < b && b > a && a <= 1.0 && a == number(1.0) && a != b));
  CHECK(isfinite(a));
  CHECK_FALSE(isfinite(sqrt(number::variable(0.0, 0))));  // the value is, the slope is not
  CHECK(isnan(log(number(-1.0))));
  CHECK(isinf(number(1.0) / number(0.0)));
}
