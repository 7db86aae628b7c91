// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cholesky factorisation of a sparse symmetric positive definite matrix of `B x B` blocks.
///
/// Left-looking and supernodal: columns of the factor with the same structure form one dense panel, and all operations
/// are products of panels. Source: E. Ng, B. W. Peyton, "Block sparse Cholesky algorithms on advanced uniprocessor
/// computers", SIAM J. Sci. Comput. 14(5), 1993.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/rounded.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/detail/sparse/block_symbolic.hpp>
#include <orbis/optimize/detail/sparse/panel_kernels.hpp>

namespace orbis::optimize::detail {

/// Analyses the structure once; factorisation and solution for any values then allocate nothing. Results are
/// bit-identical on all processors. Not thread-safe.
template <int B>
requires(B >= 1) class block_cholesky {
 public:
  using block = matrix<B, B>;

  /// Analyses matrices of `size` blocks per side with blocks on the diagonal and at `places`.
  /// @pre every place has indices less than `size` and is off the diagonal, and no place is repeated
  void analyze(std::size_t size, std::span<const block_place> places);

  [[nodiscard]] const block_symbolic& symbolic() const { return symbolic_; }

  /// Factorises the matrix with `diagonal[i]` at (i, i), `damping` added to its diagonal, and `off_diagonal[k]` at
  /// `places[k]`. Returns false if the matrix is not positive definite: a pivot is not above `tolerance` times the
  /// diagonal entry of the matrix, or not finite; see `failed_block`.
  /// @pre the spans have the analysed sizes; `damping` is empty or has one entry per row
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal,
                            std::span<const double> damping = {}, double tolerance = 1e-14);

  /// The block whose pivot was not positive, after `factor` has returned false.
  [[nodiscard]] std::uint32_t failed_block() const { return failed_block_; }

  /// Solves in place: replaces the right-hand side in `x` with the solution. @pre the last `factor` returned true
  void solve(std::span<double> x);

 private:
  static constexpr std::size_t width = static_cast<std::size_t>(B);

  struct panel {
    std::size_t begin = 0;
    std::size_t stride = 0;  ///< distance between columns
  };
  /// Storage position of a block off the diagonal.
  struct target {
    std::size_t begin = 0, stride = 0;
    bool transposed = false;
  };

  [[nodiscard]] static std::ptrdiff_t offset(std::size_t k) { return static_cast<std::ptrdiff_t>(width * k); }
  [[nodiscard]] double* panel_data(std::size_t s) { return values_.data() + panels_[s].begin; }

  /// Returns the index in `values_` of block (row, column) of the factor, in the order of elimination.
  [[nodiscard]] std::size_t at(std::uint32_t row, std::uint32_t column) const {
    const std::uint32_t s = symbolic_.supernode_of[column];
    const supernode& node = symbolic_.supernodes[s];
    std::size_t place = row - node.first;
    if (place >= node.columns) {
      const std::span<const std::uint32_t> rows = symbolic_.rows_of(node);
      place = node.columns + static_cast<std::size_t>(std::lower_bound(rows.begin(), rows.end(), row) - rows.begin());
    }
    return panels_[s].begin + width * (place + (column - node.first) * panels_[s].stride);
  }

  void fill(std::span<const block> diagonal, std::span<const block> off_diagonal, std::span<const double> damping) {
    std::fill(values_.begin(), values_.end(), 0.0);
    for (std::uint32_t k = 0; k != symbolic_.size(); ++k) {
      const std::uint32_t i = symbolic_.order[k];
      const std::size_t stride = panels_[symbolic_.supernode_of[k]].stride;
      double* const to = values_.data() + at(k, k);
      put(diagonal[i], to, stride);
      if (!damping.empty())
        for (std::size_t j = 0; j != width; ++j) to[j * stride + j] += damping[width * i + j];
    }
    for (std::size_t k = 0; k != targets_.size(); ++k) {
      const target& t = targets_[k];
      double* const to = values_.data() + t.begin;
      if (t.transposed)
        put(transposed(off_diagonal[k]), to, t.stride);
      else
        put(off_diagonal[k], to, t.stride);
    }
  }
  static void put(const block& from, double* to, std::size_t stride) {
    for (std::size_t c = 0; c != width; ++c) std::copy_n(from.data() + width * c, width, to + c * stride);
  }

  /// Finds, for each row of the factor, its block row in the panel of `s`.
  void find_places(std::size_t s) {
    const supernode& node = symbolic_.supernodes[s];
    for (std::uint32_t c = 0; c != node.columns; ++c) place_of_row_[node.first + c] = c;
    std::uint32_t place = node.columns;
    for (const std::uint32_t row : symbolic_.rows_of(node)) place_of_row_[row] = place++;
  }

  /// Subtracts the contribution of an earlier supernode from the panel of `s`.
  void apply(const supernode_update& u, std::size_t s) {
    const supernode& source = symbolic_.supernodes[u.source];
    const supernode& node = symbolic_.supernodes[s];
    const std::span<const std::uint32_t> rows = symbolic_.rows_of(source);
    const double* const from = panel_data(u.source) + width * source.columns;
    for (std::uint32_t j = u.begin; j != u.end; ++j) {
      const double* const a = from + width * j;
      kernels_.product(a, a, panels_[u.source].stride, width * (source.rows - j), width * source.columns,
                       product_.data(), product_stride_);
      double* const column = panel_data(s) + width * (rows[j] - node.first) * panels_[s].stride;
      for (std::uint32_t i = j; i != source.rows; ++i)
        subtract(product_.data() + width * (i - j), width, column + width * place_of_row_[rows[i]], panels_[s].stride);
    }
  }

  /// Computes `to -= from` for N columns of `height` rows.
  void subtract(const double* from, std::size_t height, double* to, std::size_t stride) const {
    for (std::size_t c = 0; c != width; ++c)
      for (std::size_t r = 0; r != height; ++r) to[c * stride + r] -= from[c * product_stride_ + r];
  }

  [[nodiscard]] bool factor_panel(std::size_t s, std::span<const block> diagonal, std::span<const double> damping,
                                  double tolerance) {
    const supernode& node = symbolic_.supernodes[s];
    const std::size_t stride = panels_[s].stride;
    for (std::size_t c = 0; c != node.columns; ++c) {
      double* const top = panel_data(s) + width * (c * stride + c);
      const std::size_t height = width * (node.columns - c + node.rows);
      if (c != 0) {
        const double* const a = panel_data(s) + width * c;
        kernels_.product(a, a, stride, height, width * c, product_.data(), product_stride_);
        subtract(product_.data(), height, top, stride);
      }
      const std::uint32_t i = symbolic_.order[node.first + c];
      double* const inverse = inverse_diagonal_.data() + width * (node.first + c);
      for (std::size_t j = 0; j != width; ++j) {
        const double given = diagonal[i].data()[width * j + j] + (damping.empty() ? 0.0 : damping[width * i + j]);
        if (!factor_column(top, stride, j, tolerance * given, inverse[j])) {
          failed_block_ = i;
          return false;
        }
      }
      kernels_.solve(top, inverse, stride, top + width, height - width);
    }
    return true;
  }

  /// Factorises column j of a diagonal block; returns false if its pivot is not above `least`.
  [[nodiscard]] static bool factor_column(double* top, std::size_t stride, std::size_t j, double least,
                                          double& inverse) {
    for (std::size_t i = j; i != width; ++i)
      for (std::size_t k = 0; k != j; ++k)
        top[j * stride + i] -= rounded_product(top[k * stride + i], top[k * stride + j]);
    const double pivot = top[j * stride + j];
    if (!(pivot > 0.0 && pivot > least) || !std::isfinite(pivot)) return false;
    top[j * stride + j] = std::sqrt(pivot);
    inverse = 1.0 / top[j * stride + j];
    for (std::size_t i = j + 1; i != width; ++i) top[j * stride + i] *= inverse;
    return true;
  }

  void forward(std::size_t s) {
    const supernode& node = symbolic_.supernodes[s];
    const std::size_t stride = panels_[s].stride;
    const std::size_t height = width * (node.columns + node.rows);
    double* const x = ordered_.data() + offset(node.first);
    double* const change = product_.data();  // change of all rows below the current column
    std::fill_n(change, height, 0.0);
    for (std::size_t c = 0; c != node.columns; ++c) {
      const double* const top = panel_data(s) + width * c * stride;
      double solved[width];
      for (std::size_t j = 0; j != width; ++j) {
        const std::size_t row = width * c + j;
        double value = x[row] - change[row];
        for (std::size_t k = 0; k != j; ++k) value -= rounded_product(top[k * stride + row], solved[k]);
        x[row] = solved[j] = value * inverse_diagonal_[width * node.first + row];
      }
      for (std::size_t i = width * (c + 1); i != height; ++i)
        for (std::size_t j = 0; j != width; ++j) change[i] += rounded_product(top[j * stride + i], solved[j]);
    }
    const std::span<const std::uint32_t> rows = symbolic_.rows_of(node);
    for (std::size_t i = 0; i != rows.size(); ++i)
      for (std::size_t r = 0; r != width; ++r) ordered_[width * rows[i] + r] -= change[width * (node.columns + i) + r];
  }

  void backward(std::size_t s) {
    const supernode& node = symbolic_.supernodes[s];
    const std::size_t stride = panels_[s].stride;
    const std::size_t height = width * (node.columns + node.rows);
    double* const x = product_.data();  // solution for the panel's rows
    std::copy_n(ordered_.begin() + offset(node.first), width * node.columns, x);
    const std::span<const std::uint32_t> rows = symbolic_.rows_of(node);
    for (std::size_t i = 0; i != rows.size(); ++i)
      std::copy_n(ordered_.begin() + offset(rows[i]), B, x + width * (node.columns + i));
    for (std::size_t c = node.columns; c-- != 0;) {
      const double* const top = panel_data(s) + width * c * stride;
      double sum[width] = {};
      for (std::size_t i = width * (c + 1); i != height; ++i)
        for (std::size_t j = 0; j != width; ++j) sum[j] += rounded_product(top[j * stride + i], x[i]);
      for (std::size_t j = width; j-- != 0;) {
        const std::size_t row = width * c + j;
        double value = x[row] - sum[j];
        for (std::size_t k = j + 1; k != width; ++k)
          value -= rounded_product(top[j * stride + width * c + k], x[width * c + k]);
        x[row] = value * inverse_diagonal_[width * node.first + row];
      }
    }
    std::copy_n(x, width * node.columns, ordered_.begin() + offset(node.first));
  }

  panel_kernels<B> kernels_;
  block_symbolic symbolic_;
  std::vector<panel> panels_;
  std::vector<target> targets_;
  std::vector<double> values_;   // the panels, column-major
  std::vector<double> product_;  // product of panels, before it is subtracted
  std::size_t product_stride_ = 0;
  std::vector<double> inverse_diagonal_;  // reciprocals of the diagonal of the factor
  std::vector<double> ordered_;           // the right-hand side in the order of elimination
  std::vector<std::uint32_t> place_of_row_;
  std::uint32_t failed_block_ = 0;
};

template <int B>
requires(B >= 1) void block_cholesky<B>::analyze(std::size_t size, std::span<const block_place> places) {
  symbolic_ = analyze_blocks(size, places);
  panels_.clear();
  std::size_t total = 0, tallest = 0;
  for (const supernode& s : symbolic_.supernodes) {
    const std::size_t height = width * (std::size_t{s.columns} + s.rows);
    panels_.push_back({total, (height + 7) / 8 * 8});
    total += panels_.back().stride * width * s.columns;
    tallest = std::max(tallest, height);
  }
  values_.assign(total + 2 * panel_slack, 0.0);
  product_.assign((tallest + 2 * panel_slack) * width, 0.0);
  product_stride_ = (tallest + panel_slack) / panel_slack * panel_slack;
  inverse_diagonal_.assign(width * size, 0.0);
  ordered_.assign(width * size, 0.0);
  place_of_row_.assign(size, 0);

  targets_.clear();
  for (const block_place& p : places) {
    const std::uint32_t row = symbolic_.position[p.row], column = symbolic_.position[p.column];
    const std::uint32_t lower = std::max(row, column), upper = std::min(row, column);
    targets_.push_back({at(lower, upper), panels_[symbolic_.supernode_of[upper]].stride, row < column});
  }
}

template <int B>
requires(B >= 1) bool block_cholesky<B>::factor(std::span<const block> diagonal, std::span<const block> off_diagonal,
                                                std::span<const double> damping, double tolerance) {
  assert(diagonal.size() == symbolic_.size() && off_diagonal.size() == targets_.size());
  assert(damping.empty() || damping.size() == width * symbolic_.size());
  fill(diagonal, off_diagonal, damping);
  for (std::size_t s = 0; s != symbolic_.supernodes.size(); ++s) {
    find_places(s);
    for (const supernode_update& u : symbolic_.updates_of(s)) apply(u, s);
    if (!factor_panel(s, diagonal, damping, tolerance)) return false;
  }
  return true;
}

template <int B>
requires(B >= 1) void block_cholesky<B>::solve(std::span<double> x) {
  assert(x.size() == ordered_.size());
  for (std::size_t k = 0; k != symbolic_.size(); ++k)
    std::copy_n(x.begin() + offset(symbolic_.order[k]), B, ordered_.begin() + offset(k));
  for (std::size_t s = 0; s != symbolic_.supernodes.size(); ++s) forward(s);
  for (std::size_t s = symbolic_.supernodes.size(); s != 0; --s) backward(s - 1);
  for (std::size_t k = 0; k != symbolic_.size(); ++k)
    std::copy_n(ordered_.begin() + offset(k), B, x.begin() + offset(symbolic_.order[k]));
}

#ifdef ORBIS_COMPILED  // instantiated in cmake/compiled/optimize_kernels.cpp
extern template class block_cholesky<6>;
extern template class block_cholesky<7>;
extern template class block_cholesky<9>;
#endif

}  // namespace orbis::optimize::detail
