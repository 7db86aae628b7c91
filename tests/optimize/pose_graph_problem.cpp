// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/optimize/pose_graph_problem.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

namespace {

/// Largest difference between the analytic Jacobians and central differences, relative to the largest
/// entry.
template <class F, class T>
double jacobian_error(const F& f, const T& a, const T& b, const T& z) {
  constexpr int n = T::dof;
  matrix<F::dimension, n> by_a, by_b, slope_a, slope_b;
  const matrix<F::dimension> r = f.linearize(a, b, z, by_a, by_b);
  CHECK((r - f.residual(a, b, z)).norm() <= 1e-12 * (1.0 + r.norm()));
  const double h = 1e-5;
  for (int i = 0; i != n; ++i) {
    const typename T::tangent d = h * T::tangent::Unit(i);
    slope_a.col(i) = (f.residual(a * T::exp(d), b, z) - f.residual(a * T::exp(-d), b, z)) / (2.0 * h);
    slope_b.col(i) = (f.residual(a, b * T::exp(d), z) - f.residual(a, b * T::exp(-d), z)) / (2.0 * h);
  }
  const double size = std::max({1.0, by_a.cwiseAbs().maxCoeff(), by_b.cwiseAbs().maxCoeff()});
  return std::max((by_a - slope_a).cwiseAbs().maxCoeff(), (by_b - slope_b).cwiseAbs().maxCoeff()) / size;
}

sim3 random_similarity(random_bits& random) {
  const se3 pose = test::random_pose(random);
  return {pose.rotation(), pose.translation(), std::exp(random.uniform(-0.7, 0.7))};
}

}  // namespace

TEST_CASE("The Jacobians of relative poses are those of central differences") {
  random_bits random{311};
  for (int trial = 0; trial != 100; ++trial) {
    // From agreement to within rounding, over small errors, to measurements that are far off.
    const double size = trial % 4 == 0 ? 1e-9 : trial % 4 == 1 ? 0.1 : 1.0;
    vec6 xi;
    xi << test::random_vector(random, size), test::random_vector(random, size);
    const se3 a = test::random_pose(random), b = test::random_pose(random);
    const se3 z = a.inverse() * b * se3::exp(xi);
    CHECK(jacobian_error(quaternion_between{}, a, b, z) < 1e-6);
    CHECK(jacobian_error(logarithm_between<se3>{}, a, b, z) < 1e-6);
    CHECK(jacobian_error(logarithm_between<so3>{}, a.rotation(), b.rotation(), z.rotation()) < 1e-6);
    const sim3 s = random_similarity(random), t = random_similarity(random);
    vec7 eta;
    eta << 0.5 * xi, random.uniform(-0.3, 0.3) * size;
    CHECK(jacobian_error(logarithm_between<sim3>{}, s, t, s.inverse() * t * sim3::exp(eta)) < 1e-6);
  }
}

TEST_CASE("The residual is 0 where the poses agree, and does not depend on where the world is") {
  random_bits random{312};
  for (int trial = 0; trial != 50; ++trial) {
    const se3 a = test::random_pose(random), b = test::random_pose(random), z = test::random_pose(random);
    const se3 moved = test::random_pose(random);
    CHECK(quaternion_between::residual(a, b, a.inverse() * b).norm() < 1e-14);
    CHECK(logarithm_between<se3>::residual(a, b, a.inverse() * b).norm() < 1e-13);
    CHECK((quaternion_between::residual(a, b, z) - quaternion_between::residual(moved * a, moved * b, z)).norm() <
          1e-12);
  }
}

TEST_CASE("The quaternion residual is the error of g2o's edges") {
  // A quarter turn about z too much, and half a metre along the measured frame's x.
  const se3 a{so3::exp(vec3(0, 0, 0.3)), vec3(1, 2, 3)};
  const se3 z{so3::exp(vec3(0.1, 0.2, 0.3)), vec3(4, 5, 6)};
  const se3 off{so3::exp(vec3(0, 0, std::acos(-1.0) / 2)), vec3(0.5, 0, 0)};
  const vec6 r = quaternion_between::residual(a, a * z * off, z);
  const vec6 expected = (vec6() << 0.5, 0, 0, 0, 0, std::sqrt(0.5)).finished();
  CHECK((r - expected).norm() < 1e-14);
  // The sign of the quaternion makes no difference.
  const se3 more_than_half{so3::exp(vec3(0, 0, 2.0)) * so3::exp(vec3(0, 0, 2.0)), vec3::Zero()};
  CHECK(quaternion_between::residual(se3{}, more_than_half, se3{})[5] ==
        Approx(-std::sin((2.0 * std::acos(-1.0) - 4.0) / 2)));
}
