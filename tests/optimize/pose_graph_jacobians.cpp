// SPDX-License-Identifier: BSD-3-Clause
//
// Jacobians of residuals between poses, against dual numbers.
#include <cmath>

#include <orbis/core/random.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>

#include "support.hpp"
#include "support/catch.hpp"
#include "templated_residuals.hpp"

using namespace orbis;
using optimize::lie_group;

namespace {

/// Residuals and Jacobians that are to be the same.
template <class A, class B>
void check_equal(const A& analytic, const B& by_dual_numbers) {
  CHECK((analytic - by_dual_numbers).norm() <= 1e-10 * (1.0 + by_dual_numbers.norm()));
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

TEST_CASE("Analytic Jacobians between poses are those of dual numbers") {
  random_bits random(37);
  for (int trial = 0; trial != 60; ++trial) {
    const se3 a = test::random_pose(random), b = test::random_pose(random);
    // What is left over is neither nothing nor nearly half a turn.
    const se3 rest(so3::exp(random.uniform(0.3, 2.5) * test::random_vector(random, 1.0).normalized()),
                   test::random_vector(random, 2.0));
    const se3 measured = a.inverse() * b * rest.inverse();
    const auto lifted = [&]<class S>(const test::rigid<S>& x, const test::rigid<S>& y) {
      const test::rigid<S> m{measured.rotation_matrix().cast<S>(), measured.translation().cast<S>()};
      return m.inverse() * (x.inverse() * y);
    };
    check_between(
        optimize::quaternion_between{},
        [&]<class S>(const test::rigid<S>& x, const test::rigid<S>& y) {
          const test::rigid<S> d = lifted(x, y);
          matrix<6, 1, S> r;
          r << d.translation, test::quaternion_vector<S>(d.rotation);
          return r;
        },
        a, b, measured);
    check_between(
        optimize::logarithm_between<se3>{},
        [&]<class S>(const test::rigid<S>& x, const test::rigid<S>& y) { return test::logarithm<S>(lifted(x, y)); }, a,
        b, measured);
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
