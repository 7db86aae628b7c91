// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The essential matrices that agree with five pairs of rays.
///
/// The five epipolar constraints are satisfied by the matrices `x X + y Y + z Z + W`. An essential matrix is singular
/// and has two equal singular values, which gives ten cubic equations in x, y and z. Elimination yields a polynomial of
/// degree ten in z. Newton's method on the cubics recovers the accuracy lost in the elimination.
///
/// Source: D. Nister, "An efficient solution to the five-point relative pose problem", PAMI 26(6), 2004.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <Eigen/LU>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/real_roots.hpp>

namespace orbis::optimize::detail {

/// Up to ten essential matrices, each with Frobenius norm sqrt(2).
class five_point_solutions {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] const mat3& operator[](std::size_t i) const noexcept { return matrices_[i]; }
  [[nodiscard]] const mat3* begin() const noexcept { return matrices_.data(); }
  [[nodiscard]] const mat3* end() const noexcept { return matrices_.data() + size_; }
  void push_back(const mat3& e) noexcept {
    if (size_ < matrices_.size()) matrices_[size_++] = e;
  }

 private:
  std::array<mat3, 10> matrices_;
  std::size_t size_ = 0;
};

/// Polynomials in x, y and z, represented by their coefficients in the order of the terms in the tables below.
namespace epipolar_cubics {

using linear = std::array<double, 4>;
using quadric = std::array<double, 10>;
using cubic = std::array<double, 20>;
using exponents = std::array<std::uint8_t, 3>;

inline constexpr std::array<exponents, 4> linear_terms{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
inline constexpr std::array<exponents, 10> quadric_terms{
    {{2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {1, 0, 0}, {0, 2, 0}, {0, 1, 1}, {0, 1, 0}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};
/// The first ten terms are eliminated; the others are x, y and 1, each multiplied by powers of z.
inline constexpr std::array<exponents, 20> cubic_terms{
    {{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}, {2, 0, 0}, {0, 2, 1}, {0, 2, 0}, {1, 1, 1}, {1, 1, 0},
     {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2}, {0, 1, 1}, {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

/// Returns the index in `terms` of the product of the i-th term of `a` and the j-th term of `b`.
template <std::size_t A, std::size_t B, std::size_t N>
[[nodiscard]] consteval std::array<std::array<std::uint8_t, B>, A> product_table(
    const std::array<exponents, A>& a, const std::array<exponents, B>& b, const std::array<exponents, N>& terms) {
  std::array<std::array<std::uint8_t, B>, A> table{};
  for (std::size_t i = 0; i != A; ++i)
    for (std::size_t j = 0; j != B; ++j)
      for (std::size_t k = 0; k != N; ++k)
        if (terms[k][0] == a[i][0] + b[j][0] && terms[k][1] == a[i][1] + b[j][1] && terms[k][2] == a[i][2] + b[j][2])
          table[i][j] = static_cast<std::uint8_t>(k);
  return table;
}
inline constexpr auto linear_products = product_table(linear_terms, linear_terms, quadric_terms);
inline constexpr auto quadric_products = product_table(quadric_terms, linear_terms, cubic_terms);

/// Adds `sign * a * b` to `sum`.
inline void add_product(quadric& sum, const linear& a, const linear& b, double sign = 1.0) noexcept {
  for (std::size_t i = 0; i != 4; ++i)
    for (std::size_t j = 0; j != 4; ++j) sum[linear_products[i][j]] += sign * a[i] * b[j];
}
inline void add_product(cubic& sum, const quadric& a, const linear& b) noexcept {
  for (std::size_t i = 0; i != 10; ++i)
    for (std::size_t j = 0; j != 4; ++j) sum[quadric_products[i][j]] += a[i] * b[j];
}

/// Returns the ten cubics that the entries of an essential matrix satisfy.
[[nodiscard]] inline std::array<cubic, 10> constraints(const std::array<std::array<linear, 3>, 3>& e) {
  std::array<cubic, 10> all{};
  // The determinant.
  for (std::size_t k = 0; k != 3; ++k) {
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    quadric minor{};
    add_product(minor, e[1][a], e[2][b]);
    add_product(minor, e[1][b], e[2][a], -1.0);
    add_product(all[0], minor, e[0][k]);
  }
  // (E E^T - trace / 2) E.
  std::array<std::array<quadric, 3>, 3> square{};
  for (std::size_t i = 0; i != 3; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      for (std::size_t k = 0; k != 3; ++k) add_product(square[i][j], e[i][k], e[j][k]);
      square[j][i] = square[i][j];
    }
  quadric half_trace;
  for (std::size_t k = 0; k != 10; ++k) half_trace[k] = 0.5 * (square[0][0][k] + square[1][1][k] + square[2][2][k]);
  for (std::size_t i = 0; i != 3; ++i)
    for (std::size_t k = 0; k != 10; ++k) square[i][i][k] -= half_trace[k];
  for (std::size_t i = 0; i != 3; ++i)
    for (std::size_t j = 0; j != 3; ++j)
      for (std::size_t k = 0; k != 3; ++k) add_product(all[1 + 3 * i + j], square[i][k], e[k][j]);
  return all;
}

/// Refines `p` by Gauss-Newton on the cubics; returns false if it does not converge to a common root.
[[nodiscard]] inline bool polish(const std::array<cubic, 10>& cubics, vec3& p) {
  double last = 0.0;
  vec3 previous = p;
  for (int step = 0; step != 10; ++step) {
    std::array<std::array<double, 4>, 3> power;  // power[a][k] = p[a]^k
    for (std::size_t a = 0; a != 3; ++a) {
      power[a][0] = 1.0;
      for (std::size_t k = 1; k != 4; ++k) power[a][k] = power[a][k - 1] * p[static_cast<Eigen::Index>(a)];
    }
    double error = 0.0;
    mat3 normal = zeros<mat3>();
    vec3 gradient = zeros<vec3>();
    std::array<std::array<double, 4>, 20> terms;  // including their derivatives with respect to x, y and z
    for (std::size_t t = 0; t != 20; ++t) {
      const auto [i, j, k] = cubic_terms[t];
      const double x = power[0][i], y = power[1][j], z = power[2][k];
      terms[t] = {x * y * z, i != 0 ? i * power[0][i - 1U] * y * z : 0.0, j != 0 ? j * x * power[1][j - 1U] * z : 0.0,
                  k != 0 ? k * x * y * power[2][k - 1U] : 0.0};
    }
    for (const cubic& c : cubics) {
      std::array<double, 4> sum{};
      for (std::size_t t = 0; t != 20; ++t)
        for (std::size_t a = 0; a != 4; ++a) sum[a] += c[t] * terms[t][a];
      const vec3 by_p(sum[1], sum[2], sum[3]);
      error += sum[0] * sum[0];
      gradient += sum[0] * by_p;
      normal += by_p * transposed(by_p);
    }
    if (step != 0 && !(error < last)) break;
    last = error;
    previous = p;
    p -= inverse(normal) * gradient;
    if (error == 0.0 || !all_finite(p)) break;
  }
  p = previous;
  const double size = 1.0 + squared_norm(p);  // magnitude of the matrix
  return last <= 1e-16 * size * size * size;
}

/// Computes four orthonormal vectors that are orthogonal to the five rows; returns false if the rows are linearly
/// dependent.
[[nodiscard]] inline bool null_space(std::array<std::array<double, 9>, 5>& rows,
                                     std::array<std::array<double, 9>, 4>& basis) {
  std::array<std::size_t, 9> column{0, 1, 2, 3, 4, 5, 6, 7, 8};
  for (std::size_t k = 0; k != 5; ++k) {
    std::size_t row = k, best = k;
    for (std::size_t i = k; i != 5; ++i)
      for (std::size_t j = k; j != 9; ++j)
        if (std::fabs(rows[i][column[j]]) > std::fabs(rows[row][column[best]])) {
          row = i;
          best = j;
        }
    std::swap(rows[k], rows[row]);
    std::swap(column[k], column[best]);
    const double pivot = rows[k][column[k]];
    if (!(std::fabs(pivot) > 1e-12)) return false;
    for (double& x : rows[k]) x /= pivot;
    for (std::size_t i = 0; i != 5; ++i) {
      if (i == k) continue;
      const double factor = rows[i][column[k]];
      for (std::size_t j = 0; j != 9; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  for (std::size_t f = 0; f != 4; ++f) {
    basis[f].fill(0.0);
    basis[f][column[5 + f]] = 1.0;
    for (std::size_t i = 0; i != 5; ++i) basis[f][column[i]] = -rows[i][column[5 + f]];
    for (int twice = 0; twice != 2; ++twice) {
      for (std::size_t g = 0; g != f; ++g) {
        double along = 0.0;
        for (std::size_t j = 0; j != 9; ++j) along += basis[f][j] * basis[g][j];
        for (std::size_t j = 0; j != 9; ++j) basis[f][j] -= along * basis[g][j];
      }
      double squared = 0.0;
      for (const double x : basis[f]) squared += x * x;
      for (double& x : basis[f]) x /= std::sqrt(squared);
    }
  }
  return true;
}

/// Solves for the first ten terms: row i then represents `term i + rest = 0`. Returns false if the system is singular.
[[nodiscard]] inline bool eliminate(std::array<cubic, 10>& rows) {
  for (std::size_t k = 0; k != 10; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i != 10; ++i)
      if (std::fabs(rows[i][k]) > std::fabs(rows[best][k])) best = i;
    std::swap(rows[k], rows[best]);
    const double inverse = 1.0 / rows[k][k];
    if (!std::isfinite(inverse)) return false;
    for (std::size_t j = k; j != 20; ++j) rows[k][j] *= inverse;
    for (std::size_t i = 0; i != 10; ++i) {
      if (i == k) continue;
      const double factor = rows[i][k];
      for (std::size_t j = k; j != 20; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  return true;
}

}  // namespace epipolar_cubics

/// Returns all essential matrices with `second[i]^T E first[i] = 0`, for rays of any length. Empty if there are
/// infinitely many (for example if all rays are in one plane through the centre, or a ray is repeated), or if the rays
/// are not finite. Rays that differ only by a rotation are not treated as a failure, although every translation then
/// gives a solution. O(1), no allocation.
[[nodiscard]] inline five_point_solutions five_point(const std::array<vec3, 5>& first,
                                                     const std::array<vec3, 5>& second) {
  namespace poly = epipolar_cubics;
  five_point_solutions solutions;
  std::array<std::array<double, 9>, 5> rows;
  for (std::size_t i = 0; i != 5; ++i) {
    const vec3 a = normalized(vec3(first[i])), b = normalized(vec3(second[i]));
    if (!std::isfinite(sum_entries(a) + sum_entries(b))) return solutions;
    for (int row = 0; row != 3; ++row)
      for (int column = 0; column != 3; ++column)
        rows[i][static_cast<std::size_t>(3 * row + column)] = b[row] * a[column];
  }
  std::array<std::array<double, 9>, 4> basis;
  if (!poly::null_space(rows, basis)) return solutions;
  std::array<std::array<poly::linear, 3>, 3> e;
  for (std::size_t row = 0; row != 3; ++row)
    for (std::size_t column = 0; column != 3; ++column)
      for (std::size_t k = 0; k != 4; ++k) e[row][column][k] = basis[k][3 * row + column];
  const std::array<poly::cubic, 10> cubics = poly::constraints(e);
  std::array<poly::cubic, 10> c = cubics;
  if (!poly::eliminate(c)) return solutions;
  // Rows 4 to 9 express x^2 z, x^2, y^2 z, y^2, x y z and x y in terms of the rest; for each pair, one row minus z
  // times the other gives x p(z) + y q(z) + r(z) = 0 with p and q of degree 3 and r of degree 4.
  std::array<std::array<std::array<double, 5>, 3>, 3> b{};  // coefficients of z^k
  for (std::size_t i = 0; i != 3; ++i) {
    const std::size_t above = 4 + 2 * i;
    for (std::size_t part = 0; part != 3; ++part) {
      const std::size_t from = 10 + 3 * part, degree = part == 2 ? 3 : 2;
      for (std::size_t k = 0; k <= degree; ++k) {  // columns are in order of descending powers
        b[i][part][k] += c[above][from + degree - k];
        b[i][part][k + 1] -= c[above + 1][from + degree - k];
      }
    }
  }
  std::array<double, 11> determinant{};
  for (std::size_t k = 0; k != 3; ++k) {
    const std::size_t m = (k + 1) % 3, n = (k + 2) % 3;
    std::array<double, 9> minor{};
    for (std::size_t i = 0; i != 5; ++i)
      for (std::size_t j = 0; j != 5; ++j) minor[i + j] += b[1][m][i] * b[2][n][j] - b[1][n][i] * b[2][m][j];
    for (std::size_t i = 0; i != 9; ++i)
      for (std::size_t j = 0; j != 5; ++j)
        if (i + j <= 10) determinant[i + j] += minor[i] * b[0][k][j];
  }
  std::array<double, 10> roots{};
  const std::size_t count = real_roots<10>(determinant, roots);
  for (std::size_t r = 0; r != count; ++r) {
    const double z = roots[r];
    mat3 at;
    for (int i = 0; i != 3; ++i)
      for (int part = 0; part != 3; ++part) {
        const auto& p = b[static_cast<std::size_t>(i)][static_cast<std::size_t>(part)];
        at(i, part) = (((p[4] * z + p[3]) * z + p[2]) * z + p[1]) * z + p[0];
      }
    for (int i = 0; i != 3; ++i) set_row(at, i, normalized(row_of(at, i)));
    vec3 null = cross(row_of(at, 0), row_of(at, 1));
    for (const auto& [i, j] : {std::pair{0, 2}, std::pair{1, 2}})
      if (const vec3 other = cross(row_of(at, i), row_of(at, j)); squared_norm(other) > squared_norm(null))
        null = other;
    vec3 p(null.x() / null.z(), null.y() / null.z(), z);
    if (!all_finite(p)) continue;
    if (!epipolar_cubics::polish(cubics, p)) continue;
    mat3 essential;
    for (std::size_t row = 0; row != 3; ++row)
      for (std::size_t column = 0; column != 3; ++column) {
        const poly::linear& l = e[row][column];
        essential(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
            l[0] * p.x() + l[1] * p.y() + l[2] * p.z() + l[3];
      }
    essential *= std::sqrt(2.0) / norm(essential);
    if (all_finite(essential)) solutions.push_back(essential);
  }
  return solutions;
}

}  // namespace orbis::optimize::detail
