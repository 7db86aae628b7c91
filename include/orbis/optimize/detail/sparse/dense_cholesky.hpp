// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cholesky factorisation of a dense symmetric positive definite matrix.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <orbis/core/rounded.hpp>
#include <orbis/optimize/detail/sparse/panel_kernels.hpp>

namespace orbis::optimize::detail {

/// Left-looking factorisation in panels of eight columns. Takes about n^3 / 6 multiplications; allocates nothing for a
/// matrix of the same size as the previous one. Every processor gives the same bits. Not thread-safe.
class dense_cholesky {
 public:
  /// Resizes to an n x n matrix of zeros.
  void resize(std::size_t n) {
    size_ = n;
    stride_ = (n + width - 1) / width * width;
    values_.assign(stride_ * stride_ + 2 * panel_slack, 0.0);
    product_stride_ = stride_ + panel_slack;
    product_.resize(product_stride_ * width);
    inverse_diagonal_.resize(stride_);
    given_.resize(stride_);
  }
  [[nodiscard]] std::size_t size() const { return size_; }

  /// Returns entry (row, column) of the matrix or, after `factor`, of its factor. Only the lower triangle is used.
  [[nodiscard]] double& operator()(std::size_t row, std::size_t column) { return values_[column * stride_ + row]; }
  [[nodiscard]] double* column(std::size_t c) { return values_.data() + c * stride_; }

  /// Replaces the matrix by its factor. Returns false if it is not positive definite: a pivot is not above `tolerance`
  /// times the diagonal entry of the matrix, or not finite; see `failed_row`.
  [[nodiscard]] bool factor(double tolerance = 1e-14) {
    for (std::size_t i = size_; i != stride_; ++i) (*this)(i, i) = 1.0;
    for (std::size_t i = 0; i != stride_; ++i) given_[i] = (*this)(i, i);
    for (std::size_t c = 0; c != stride_; c += width) {
      double* const top = column(c) + c;
      const std::size_t height = stride_ - c;
      if (c != 0) {
        const double* const left = values_.data() + c;
        kernels_.product(left, left, stride_, height, c, product_.data(), product_stride_);
        for (std::size_t j = 0; j != width; ++j) {
          double* const to = top + j * stride_;
          const double* const from = product_.data() + j * product_stride_;
          for (std::size_t i = 0; i != height; ++i) to[i] -= from[i];
        }
      }
      for (std::size_t j = 0; j != width; ++j)
        if (!factor_column(top, j, tolerance * given_[c + j], inverse_diagonal_[c + j])) {
          failed_row_ = c + j;
          return false;
        }
      kernels_.solve(top, inverse_diagonal_.data() + c, stride_, top + width, height - width);
    }
    return true;
  }

  /// The row whose pivot was not positive, after `factor` has returned false.
  [[nodiscard]] std::size_t failed_row() const { return failed_row_; }

  /// Solves in place: replaces the right-hand side in `x` with the solution. @pre the last `factor` returned true
  void solve(std::span<double> x) const;

 private:
  static constexpr std::size_t width = 8;

  [[nodiscard]] bool factor_column(double* top, std::size_t j, double least, double& inverse) const {
    for (std::size_t i = j; i != width; ++i)
      for (std::size_t k = 0; k != j; ++k)
        top[j * stride_ + i] -= rounded_product(top[k * stride_ + i], top[k * stride_ + j]);
    const double pivot = top[j * stride_ + j];
    if (!(pivot > 0.0 && pivot > least) || !std::isfinite(pivot)) return false;
    top[j * stride_ + j] = std::sqrt(pivot);
    inverse = 1.0 / top[j * stride_ + j];
    for (std::size_t i = j + 1; i != width; ++i) top[j * stride_ + i] *= inverse;
    return true;
  }

  panel_kernels<8> kernels_;
  std::size_t size_ = 0, stride_ = 0, product_stride_ = 0, failed_row_ = 0;
  std::vector<double> values_, product_, inverse_diagonal_, given_;
};

inline void dense_cholesky::solve(std::span<double> x) const {
  assert(x.size() == size_);
  for (std::size_t c = 0; c != size_; ++c) {
    const double* const l = values_.data() + c * stride_;
    x[c] /= l[c];
    for (std::size_t r = c + 1; r != size_; ++r) x[r] -= l[r] * x[c];
  }
  for (std::size_t c = size_; c-- != 0;) {
    const double* const l = values_.data() + c * stride_;
    double sum = x[c];
    for (std::size_t r = c + 1; r != size_; ++r) sum -= l[r] * x[r];
    x[c] = sum / l[c];
  }
}

}  // namespace orbis::optimize::detail
