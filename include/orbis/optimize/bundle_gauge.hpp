// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ways to move the whole of a bundle that change no observation, and covariances with respect to them.
///
/// Source: W. Baarda, "S-transformations and criterion matrices", Netherlands Geodetic Commission, 1973.
///
/// `S` is always double: the functions are templates so that only who calls them has them compiled.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <utility>

#include <Eigen/Core>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// Those combinations of the columns of `all` that have no energy, orthonormal. `energy` has what the
/// normal equations say of every two of the columns, `alone` what their own entries would say of each if
/// nothing balanced anything.
template <std::same_as<double> S = double>
[[nodiscard]] Eigen::MatrixXd free_directions(const Eigen::MatrixXd& all, const Eigen::MatrixXd& energy,
                                              const Eigen::VectorXd& alone) {
  using VectorXd = Eigen::Matrix<S, Eigen::Dynamic, 1>;
  using MatrixXd = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
  constexpr double no_energy = 1e-13;
  const Eigen::Index count = all.cols();
  VectorXd unit = VectorXd::Zero(count);
  for (Eigen::Index i = 0; i != count; ++i)
    if (alone[i] > 0.0) unit[i] = 1.0 / std::sqrt(alone[i]);
  MatrixXd scaled = energy;
  for (Eigen::Index i = 0; i != count; ++i)
    for (Eigen::Index j = 0; j != count; ++j) scaled(i, j) *= unit[i] * unit[j];
  const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(scaled);
  MatrixXd free(all.rows(), count);
  Eigen::Index found = 0;
  for (Eigen::Index i = 0; i != count && eigen.values[i] <= no_energy; ++i) {
    VectorXd direction = VectorXd::Zero(all.rows());
    double size = 0.0;  // of what the columns bring, which may cancel: such a combination moves nothing
    for (Eigen::Index k = 0; k != count; ++k) {
      const double factor = unit[k] * eigen.vectors(k, i);
      const VectorXd column = all.col(k);
      direction += factor * column;
      size += std::abs(factor) * column.norm();
    }
    for (Eigen::Index j = 0; j != found; ++j) direction -= free.col(j).dot(direction) * free.col(j);
    const double norm = direction.norm();
    if (norm > 1e-9 * size) free.col(found++) = direction / norm;
  }
  free.conservativeResize(all.rows(), found);
  return free;
}

/// Entries for the diagonal of the normal equations, in as many of the first `rows` coordinates as there
/// are free directions, that make them regular: one after the other where the directions left move most.
template <std::same_as<double> S = double>
[[nodiscard]] Eigen::VectorXd holding_entries(const Eigen::MatrixXd& free, Eigen::Index rows,
                                              const Eigen::VectorXd& diagonal) {
  using VectorXd = Eigen::Matrix<S, Eigen::Dynamic, 1>;
  VectorXd entries = VectorXd::Zero(free.rows());
  Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic> left = free;
  for (Eigen::Index k = 0; k != free.cols(); ++k) {
    Eigen::Index most = 0;
    double reach = -1.0;
    for (Eigen::Index i = 0; i != rows; ++i)
      if (const double r = left.row(i).squaredNorm(); r > reach) most = i, reach = r;
    entries[most] = std::max(diagonal[most], std::numeric_limits<double>::min());
    const VectorXd pivot = left.row(most).transpose() / std::sqrt(std::max(reach, 1e-300));
    const VectorXd along = left * pivot;
    left.noalias() -= along * pivot.transpose();
  }
  return entries;
}

/// Those combinations of `candidates` that hold the free directions: the first `preferred` columns where
/// these can, else all.
template <std::same_as<double> S = double>
[[nodiscard]] Eigen::MatrixXd holding_constraints(const Eigen::MatrixXd& candidates, Eigen::Index preferred,
                                                  const Eigen::MatrixXd& free) {
  using MatrixXd = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
  const MatrixXd directions = free, all = candidates, chosen = all.leftCols(preferred);
  const MatrixXd moved = chosen.transpose().lazyProduct(directions);
  const MatrixXd gram = moved.transpose().lazyProduct(moved);
  const auto values = eigen_of_symmetric<Eigen::Dynamic>(gram).values;
  if (values[0] > 1e-12 * values[gram.cols() - 1]) return chosen.lazyProduct(moved);
  const MatrixXd all_moved = all.transpose().lazyProduct(directions);
  return all.lazyProduct(all_moved);
}

/// From the gauge a covariance was computed in to the one where C^T x = 0: x becomes
/// (I - G (C^T G)^-1 C^T) x. With `solved` = Sigma C and `moved` = G (C^T G)^-1 a block of it is
/// Sigma - moved solved^T - solved moved^T + moved (C^T solved) moved^T.
struct gauge_change {
  Eigen::MatrixXd solved, moved, middle;

  /// @pre C^T G is symmetric and positive definite, as `holding_constraints` makes it
  template <std::same_as<double> S = double>
  void set(const Eigen::MatrixXd& constraints, const Eigen::MatrixXd& free, Eigen::MatrixXd solved_constraints) {
    using MatrixXd = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
    const MatrixXd held = constraints, directions = free;
    solved = std::move(solved_constraints);
    const MatrixXd gram = held.transpose().lazyProduct(directions);
    const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(gram);
    MatrixXd turned = directions.lazyProduct(eigen.vectors);
    for (Eigen::Index k = 0; k != turned.cols(); ++k) turned.col(k) /= eigen.values[k];
    moved = turned.lazyProduct(eigen.vectors.transpose());
    middle = held.transpose().lazyProduct(solved);
  }
  /// The block at these rows and columns, of which `block` is what it was.
  void apply(double* block, Eigen::Index rows, Eigen::Index columns, Eigen::Index row, Eigen::Index column) const {
    for (Eigen::Index j = 0; j != columns; ++j)
      for (Eigen::Index i = 0; i != rows; ++i) {
        double change = 0.0;
        for (Eigen::Index k = 0; k != moved.cols(); ++k) {
          change -= moved(row + i, k) * solved(column + j, k) + solved(row + i, k) * moved(column + j, k);
          for (Eigen::Index l = 0; l != moved.cols(); ++l)
            change += moved(row + i, k) * middle(k, l) * moved(column + j, l);
        }
        block[j * rows + i] += change;
      }
  }
};

/// Whether the information of a point says something of every direction.
[[nodiscard]] inline bool is_determined(const mat3& v) {
  for (int k = 0; k != 9; ++k)
    if (!std::isfinite(v.data()[k])) return false;
  if (!(v(0, 0) > 0.0) || !(v(1, 1) > 0.0) || !(v(2, 2) > 0.0)) return false;
  const double a = v(0, 1) / std::sqrt(v(0, 0) * v(1, 1)), b = v(0, 2) / std::sqrt(v(0, 0) * v(2, 2)),
               c = v(1, 2) / std::sqrt(v(1, 1) * v(2, 2));
  return 1.0 + 2.0 * a * b * c - a * a - b * b - c * c > 1e-12;
}

}  // namespace orbis::optimize::detail
