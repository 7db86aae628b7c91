// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Eigenvalues and singular values of small matrices by Jacobi rotations, and the nearest rotation to a matrix.
/// Accurate to rounding, and compiles much faster than a general decomposition.
///
/// Sources: G. Golub, C. Van Loan, "Matrix computations", 4th edition, 2013, sections 8.5 and 8.6.3;
/// M. Hestenes, "Inversion of matrices by biorthogonalization and related results", 1958.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <orbis/core/result.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

template <int N>
struct symmetric_eigen {
  matrix<N> values;      ///< ascending
  matrix<N, N> vectors;  ///< column k belongs to `values[k]`; orthonormal
};

template <int N>
struct singular_decomposition {
  matrix<N, N> u;    ///< orthonormal
  matrix<N> values;  ///< non-negative, in descending order
  matrix<N, N> v;    ///< orthonormal; the matrix is `u * values.asDiagonal() * v.transpose()`
};

namespace detail {

/// Cosine and sine of the rotation that makes two columns (or rows and columns) orthogonal. `a` and `b`: their squared
/// norms (or diagonal entries); `c`: their dot product (or off-diagonal entry).
struct jacobi_turn {
  double cosine = 1.0, sine = 0.0;
  jacobi_turn(double a, double b, double c) {
    const double tau = (b - a) / (2.0 * c);
    const double t = std::copysign(1.0, tau) / (std::abs(tau) + std::hypot(1.0, tau));
    cosine = 1.0 / std::hypot(1.0, t);
    sine = t * cosine;
  }
  void apply(double& x, double& y) const {
    const double kept = cosine * x - sine * y;
    y = sine * x + cosine * y;
    x = kept;
  }
};

template <int N>
void swap_columns(matrix<N, N>& m, int i, int k) {
  for (int r = 0; r != m.rows(); ++r) std::swap(m(r, i), m(r, k));
}

}  // namespace detail

/// Eigen-decomposition of the symmetric matrix whose lower triangle is in `a`. O(n^3) per sweep; takes a few sweeps. N
/// may be `Eigen::Dynamic`.
/// @pre `a` is square and finite
template <int N>
[[nodiscard]] symmetric_eigen<N> eigen_of_symmetric(matrix<N, N> a) {
  const int n = static_cast<int>(a.rows());
  symmetric_eigen<N> out;
  out.values.resize(n);
  out.vectors.resize(n, n);
  for (int i = 0; i != n; ++i)
    for (int k = 0; k != n; ++k) {
      out.vectors(i, k) = i == k ? 1.0 : 0.0;
      if (k > i) a(i, k) = a(k, i);
    }
  for (int sweep = 0; sweep != 40; ++sweep) {
    bool turned = false;
    for (int p = 0; p != n; ++p)
      for (int q = p + 1; q != n; ++q) {
        const double apart = a(p, q);
        if (std::abs(apart) <= std::numeric_limits<double>::min()) continue;
        // Entries too small to change the diagonal are treated as zero.
        if (std::abs(apart) < 0.1 * std::numeric_limits<double>::epsilon() * std::sqrt(std::abs(a(p, p))) *
                                  std::sqrt(std::abs(a(q, q)))) {
          a(p, q) = a(q, p) = 0.0;
          continue;
        }
        turned = true;
        const detail::jacobi_turn turn(a(p, p), a(q, q), apart);
        for (int k = 0; k != n; ++k) turn.apply(a(k, p), a(k, q));
        for (int k = 0; k != n; ++k) turn.apply(a(p, k), a(q, k));
        for (int k = 0; k != n; ++k) turn.apply(out.vectors(k, p), out.vectors(k, q));
        a(p, q) = a(q, p) = 0.0;
      }
    if (!turned) break;
  }
  for (int i = 0; i != n; ++i) out.values[i] = a(i, i);
  for (int i = 0; i != n; ++i) {
    int least = i;
    for (int k = i + 1; k != n; ++k)
      if (out.values[k] < out.values[least]) least = k;
    if (least == i) continue;
    std::swap(out.values[i], out.values[least]);
    detail::swap_columns(out.vectors, i, least);
  }
  return out;
}

/// Singular value decomposition of any finite square matrix, including singular ones. O(N^3) per sweep; takes a few
/// sweeps.
template <int N>
[[nodiscard]] singular_decomposition<N> svd(const matrix<N, N>& m) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  singular_decomposition<N> out;
  matrix<N, N>& u = out.u;  // the columns of m, rotated until they are orthogonal
  double largest = 0.0;
  for (int i = 0; i != N; ++i)
    for (int k = 0; k != N; ++k) {
      largest = std::max(largest, std::abs(m(i, k)));
      out.v(i, k) = i == k ? 1.0 : 0.0;
    }
  const double scale = largest > 0.0 ? largest : 1.0;  // prevents overflow and underflow of squares
  for (int i = 0; i != N; ++i)
    for (int k = 0; k != N; ++k) u(i, k) = m(i, k) / scale;

  for (int sweep = 0; sweep != 40; ++sweep) {
    bool turned = false;
    for (int p = 0; p != N; ++p)
      for (int q = p + 1; q != N; ++q) {
        double a = 0.0, b = 0.0, c = 0.0;
        for (int k = 0; k != N; ++k) {
          a += u(k, p) * u(k, p);
          b += u(k, q) * u(k, q);
          c += u(k, p) * u(k, q);
        }
        if (std::abs(c) <= 0.5 * epsilon * std::sqrt(a) * std::sqrt(b) || std::abs(c) < 1e-300) continue;
        turned = true;
        const detail::jacobi_turn turn(a, b, c);
        for (int k = 0; k != N; ++k) turn.apply(u(k, p), u(k, q));
        for (int k = 0; k != N; ++k) turn.apply(out.v(k, p), out.v(k, q));
      }
    if (!turned) break;
  }
  for (int i = 0; i != N; ++i) {
    double square = 0.0;
    for (int k = 0; k != N; ++k) square += u(k, i) * u(k, i);
    out.values[i] = std::sqrt(square);
  }
  for (int i = 0; i != N; ++i) {
    int most = i;
    for (int k = i + 1; k != N; ++k)
      if (out.values[k] > out.values[most]) most = k;
    if (most == i) continue;
    std::swap(out.values[i], out.values[most]);
    detail::swap_columns(u, i, most);
    detail::swap_columns(out.v, i, most);
  }
  // Normalise the columns; replace columns that are only rounding noise with arbitrary ones orthogonal to the others.
  for (int i = 0; i != N; ++i) {
    const bool made = !(out.values[i] > epsilon * out.values[0]);
    for (int axis = 0; made && axis != N; ++axis) {
      for (int k = 0; k != N; ++k) u(k, i) = k == axis ? 1.0 : 0.0;
      for (int again = 0; again != 2; ++again)
        for (int j = 0; j != i; ++j) {
          double along = 0.0;
          for (int k = 0; k != N; ++k) along += u(k, j) * u(k, i);
          for (int k = 0; k != N; ++k) u(k, i) -= along * u(k, j);
        }
      double left = 0.0;
      for (int k = 0; k != N; ++k) left += u(k, i) * u(k, i);
      if (left >= 0.5 / N) break;  // at least one axis is this far from the span of the others
    }
    double length = 0.0;
    for (int k = 0; k != N; ++k) length += u(k, i) * u(k, i);
    length = std::sqrt(length);
    for (int k = 0; k != N; ++k) u(k, i) /= length;
  }
  for (int i = 0; i != N; ++i) out.values[i] *= scale;
  return out;
}

/// The rotation matrix closest to `m` (smallest sum of squared differences). Errors: degenerate if `m` contains a
/// reflection (determinant below 0), is singular up to rounding, or is not finite.
///
/// Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point
/// patterns", PAMI 13(4), 1991.
[[nodiscard]] inline result<so3> nearest_rotation(const mat3& m) {
  const double size = largest_magnitude(m);
  if (!all_finite(m)) return fail(errc::degenerate, "rotation matrix", "is not finite");
  const double volume = size > 0.0 ? determinant(m / size) : 0.0;
  if (volume < 0.0) return fail(errc::degenerate, "rotation matrix", "is a reflection: its determinant is negative");
  if (!(volume > 16.0 * std::numeric_limits<double>::epsilon()))
    return fail(errc::degenerate, "rotation matrix", "is singular");
  const auto [u, values, v] = svd<3>(m);
  return so3{u * transposed(v)};
}
template <int N>
[[deprecated("use svd")]] [[nodiscard]] singular_decomposition<N> singular_values_of(const matrix<N, N>& m) {
  return svd<N>(m);
}

}  // namespace orbis
