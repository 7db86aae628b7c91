// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What every Lie group here has to fulfil, checked through its public interface and against the
/// power series of the matrix exponential.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>

#include "support/catch.hpp"

namespace orbis::test {

/// exp(m) by its power series, in long double.
[[gnu::noinline]] inline Eigen::MatrixXd exponential_series(const Eigen::MatrixXd& m) {
  using big = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const big x = m.cast<long double>();
  big sum = big::Identity(m.rows(), m.cols());
  big term = sum;
  for (int n = 1; n != 120; ++n) {
    term = (term.lazyProduct(x) / static_cast<long double>(n)).eval();
    sum += term;
  }
  return sum.cast<double>();
}

/// How far apart the parameters of two matrices are, relative to their size.
[[gnu::noinline]] inline double difference_of(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const double size = std::max({1.0, a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff()});
  return (a - b).cwiseAbs().maxCoeff() / size;
}
template <class A, class B>
double difference(const A& a, const B& b) {
  return difference_of(a.template cast<double>(), b.template cast<double>());
}

/// A rotation vector of the given angle and random direction.
template <class S>
matrix<3, 1, S> random_rotation_vector(random_bits& random, double angle) {
  vec3 v{random.normal(), random.normal(), random.normal()};
  return (v * (angle / v.norm())).template cast<S>();
}

/// Angles worth trying: zero, where series take over from closed forms, ordinary ones, up to pi.
inline std::vector<double> interesting_angles() {
  return {0.0,
          1e-300,
          1e-12,
          1e-8,
          0.9e-4,
          1.1e-4,
          1e-3,
          0.9e-2,
          1e-2,
          1.1e-2,
          0.1,
          0.999,
          1.0,
          1.001,
          1.571,
          3.0,
          std::numbers::pi - 1e-4,
          std::numbers::pi - 1e-8};
}

/// The group axioms and the action on points, for some elements.
template <class G>
void check_group_axioms(const std::vector<G>& elements, double tolerance) {
  using point = typename G::point;
  const point p{typename G::scalar(0.3), typename G::scalar(-1.2), typename G::scalar(2.5)};
  for (const G& a : elements) {
    CHECK(difference((a * a.inverse()).log(), G::tangent::Zero().eval()) < tolerance);
    CHECK(difference((a.inverse() * a).log(), G::tangent::Zero().eval()) < tolerance);
    CHECK(difference(a * p, (a * G{}) * p) < tolerance);
    CHECK(difference(a * p, (G{} * a) * p) < tolerance);
    for (const G& b : elements) {
      CHECK(difference((a * b) * p, a * (b * p)) < tolerance);
      for (const G& c : elements) CHECK(difference(((a * b) * c) * p, (a * (b * c)) * p) < tolerance);
    }
  }
}

/// `T exp(xi) T^-1 == exp(Ad xi)`.
template <class G>
void check_adjoint(const std::vector<G>& elements, const std::vector<typename G::tangent>& tangents, double tolerance) {
  const typename G::point p{typename G::scalar(0.3), typename G::scalar(-1.2), typename G::scalar(2.5)};
  for (const G& t : elements)
    for (const auto& xi : tangents) {
      const typename G::tangent moved = t.adjoint() * xi;
      CHECK(difference((t * G::exp(xi) * t.inverse()) * p, G::exp(moved) * p) < tolerance);
    }
}

/// The left and right Jacobians against central differences, and their inverses against them.
template <class G>
void check_jacobians(const typename G::tangent& xi, double step, double tolerance) {
  using S = typename G::scalar;
  using square = matrix<G::dof, G::dof, S>;
  square left, right;
  for (int i = 0; i != G::dof; ++i) {
    typename G::tangent d = G::tangent::Zero();
    d[i] = static_cast<S>(step);
    const G forward = G::exp(xi + d), backward = G::exp(xi - d), here = G::exp(xi);
    // The difference of two logarithms about `here`, so that no branch of log is near.
    left.col(i) = ((forward * here.inverse()).log() - (backward * here.inverse()).log()) / S(2 * step);
    right.col(i) = ((here.inverse() * forward).log() - (here.inverse() * backward).log()) / S(2 * step);
  }
  CHECK(difference(G::left_jacobian(xi), left) < tolerance);
  CHECK(difference(G::right_jacobian(xi), right) < tolerance);
  const square identity = square::Identity();
  CHECK(difference(square(G::left_jacobian(xi) * G::left_jacobian_inverse(xi)), identity) < 0.1 * tolerance);
  CHECK(difference(square(G::right_jacobian_inverse(xi) * G::right_jacobian(xi)), identity) < 0.1 * tolerance);
}

}  // namespace orbis::test
