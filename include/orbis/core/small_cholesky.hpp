// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cholesky factorisation of normal equations with few unknowns, without heap memory.
#pragma once

#include <cmath>
#include <optional>

#include <orbis/core/types.hpp>

namespace orbis {

/// The factorisation `H = L D L^T` of a symmetric N x N matrix, scaled to a unit diagonal first, so that its pivots do
/// not depend on the units of the unknowns or on the number of residuals. O(N^3), for N up to about ten.
template <int N>
class small_cholesky {
 public:
  using vector = matrix<N>;
  using square = matrix<N, N>;

  /// Reads the lower triangle. Returns false if an entry on the diagonal is not positive and finite.
  [[nodiscard]] bool set(const square& h) {
    for (int i = 0; i != N; ++i) {
      if (!(h(i, i) > 0.0) || !std::isfinite(h(i, i))) return false;
      scale_[i] = 1.0 / std::sqrt(h(i, i));
    }
    for (int j = 0; j != N; ++j)
      for (int i = j + 1; i != N; ++i) scaled_[i][j] = h(i, j) * scale_[i] * scale_[j];
    return true;
  }

  /// Factorises H with its diagonal multiplied by `1 + damping`. Returns the smallest pivot of the scaled matrix: 1 for
  /// independent unknowns; close to or below the rounding error of double, or NaN, if some are not determined.
  [[nodiscard]] double factor(double damping) {
    double least = 1.0 + damping;
    for (int j = 0; j != N; ++j) {
      double pivot = 1.0 + damping;
      for (int k = 0; k != j; ++k) pivot -= l_[j][k] * l_[j][k] * pivots_[k];
      pivots_[j] = pivot;
      inverse_[j] = 1.0 / pivot;
      if (!(pivot > least)) least = pivot;
      for (int i = j + 1; i != N; ++i) {
        double sum = scaled_[i][j];
        for (int k = 0; k != j; ++k) sum -= l_[i][k] * l_[j][k] * pivots_[k];
        l_[i][j] = sum * inverse_[j];
      }
    }
    return least;
  }

  /// Solves `H x = b` for the most recently factorised matrix. @pre its smallest pivot was positive
  [[nodiscard]] vector solve(const vector& b) const {
    vector x;
    for (int i = 0; i != N; ++i) {
      double sum = b[i] * scale_[i];
      for (int k = 0; k != i; ++k) sum -= l_[i][k] * x[k];
      x[i] = sum;
    }
    for (int i = 0; i != N; ++i) x[i] *= inverse_[i];
    for (int i = N - 1; i >= 0; --i) {
      double sum = x[i];
      for (int k = i + 1; k != N; ++k) sum -= l_[k][i] * x[k];
      x[i] = sum;
    }
    for (int i = 0; i != N; ++i) x[i] *= scale_[i];
    return x;
  }

  /// The inverse of the most recently factorised matrix. @pre its smallest pivot was positive
  [[nodiscard]] square inverse() const {
    square out;
    for (int j = 0; j != N; ++j) {
      vector unit = zeros<vector>();
      unit[j] = 1.0;
      set_column(out, j, solve(unit));
    }
    return out;
  }

  /// Threshold on the smallest pivot of the undamped matrix; below it, some linear combination of the unknowns is not
  /// determined.
  static constexpr double determined = 1e-11;

 private:
  double scale_[N] = {}, pivots_[N] = {}, inverse_[N] = {};
  double scaled_[N][N] = {}, l_[N][N] = {};  // the lower triangles
};

/// Solves `h x = b` for a positive semidefinite matrix, damped by the smallest factor that makes its pivots positive,
/// at least 1e-12. Empty if an entry on the diagonal is not positive and finite.
template <int N>
[[nodiscard]] std::optional<matrix<N>> solve_semidefinite(const matrix<N, N>& h, const matrix<N>& b) {
  small_cholesky<N> factors;
  if (!factors.set(h)) return std::nullopt;
  for (double damping = 1e-12; damping < 1.0; damping *= 100.0)
    if (factors.factor(damping) > 1e-15) return factors.solve(b);
  return std::nullopt;
}

}  // namespace orbis
