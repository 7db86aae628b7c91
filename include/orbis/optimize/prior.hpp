// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is known of an estimate beforehand.
#pragma once

#include <concepts>
#include <optional>

#include <Eigen/Eigenvalues>

#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/manifold.hpp>

namespace orbis::optimize {

/// The derivative of `local(expected, retract(p, d))` by `d` at 0: for Lie groups the inverse of the right
/// Jacobian at the logarithm, for vectors the identity.
template <class T>
[[nodiscard]] matrix<T::dof, T::dof> derivative_of_local(const lie_group<T>&, const matrix<T::dof>& away) {
  return T::right_jacobian_inverse(away);
}
template <int N>
[[nodiscard]] matrix<N, N> derivative_of_local(const euclidean<N>&, const matrix<N>&) {
  return matrix<N, N>::Identity();
}

/// A manifold whose `local` has a derivative in closed form.
template <class M>
concept prior_manifold = manifold<M> && requires(const M& m, const typename M::tangent& away) {
  { derivative_of_local(m, away) } -> std::convertible_to<matrix<M::dimension, M::dimension>>;
};

/// The step that leads from `expected` to the estimate, in the tangent space of `expected`, whitened by
/// `root`: the squared norm of the residual is `step^T information step` with `information = root^T root`.
/// Translation comes before rotation for poses, in metres and radians.
template <prior_manifold M>
struct prior {
  using point = typename M::point;
  static constexpr int dimension = M::dimension;

  point expected{};
  matrix<dimension, dimension> root = matrix<dimension, dimension>::Identity();
  M space{};

  /// From an information matrix, the inverse of a covariance. Errors: invalid_argument, where that is not
  /// finite, not symmetric, or has a negative eigenvalue.
  [[nodiscard]] static result<prior> from_information(const point& expected,
                                                      const matrix<dimension, dimension>& information, M space = {}) {
    if (!information.allFinite()) return fail(errc::invalid_argument, "prior", "the information is not finite");
    const double size = information.cwiseAbs().maxCoeff();
    if ((information - information.transpose()).cwiseAbs().maxCoeff() > 1e-9 * size)
      return fail(errc::invalid_argument, "prior", "the information is not symmetric");
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, dimension, dimension>> solver(information);
    if (solver.eigenvalues().minCoeff() < -1e-9 * size)
      return fail(errc::invalid_argument, "prior", "the information has a negative eigenvalue");
    const matrix<dimension> sizes = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    const matrix<dimension, dimension> root = sizes.asDiagonal() * solver.eigenvectors().transpose();
    return prior{expected, root, space};
  }

  /// Empty where it is not finite.
  [[nodiscard]] std::optional<matrix<dimension>> residual(const point& p) const {
    const matrix<dimension> r = root * space.local(expected, p);
    if (!r.allFinite()) return std::nullopt;
    return r;
  }
  /// The same with its derivative by a step of the estimate; untouched where empty.
  [[nodiscard]] std::optional<matrix<dimension>> linearize(const point& p,
                                                           matrix<dimension, dimension>& jacobian) const {
    const matrix<dimension> away = space.local(expected, p);
    const matrix<dimension> r = root * away;
    if (!r.allFinite()) return std::nullopt;
    jacobian = root * derivative_of_local(space, away);
    return r;
  }
};

using pose_prior = prior<lie_group<se3>>;

}  // namespace orbis::optimize
