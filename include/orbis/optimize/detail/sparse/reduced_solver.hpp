// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The solver of the reduced system of bundle adjustment.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/detail/sparse/conjugate_gradients.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize::detail {

/// Solves symmetric systems of C x C blocks by one of three methods, chosen by size and fill. Reuses its memory.
template <int C>
class reduced_solver {
 public:
  using block = matrix<C, C>;
  enum class kind { dense, sparse, iterative };

  explicit reduced_solver(const reduced_solver_options& options)
      : options_{options}, iterative_{options.relative_tolerance, options.max_iterations} {}

  [[nodiscard]] kind chosen() const { return kind_; }

  /// Analyses a matrix; `places`: positions of the blocks off the diagonal.
  void analyze(std::size_t size, std::span<const block_place> places) {
    size_ = size;
    places_.assign(places.begin(), places.end());
    kind_ = kind::dense;
    if (size > options_.dense_limit) {
      sparse_.analyze(size, places);
      std::size_t fill = 0;  // number of blocks of the factor
      for (const supernode& s : sparse_.symbolic().supernodes)
        fill += std::size_t{s.columns} * (std::size_t{s.columns} + s.rows);
      kind_ = fill > options_.fill_limit ? kind::iterative : kind::sparse;
    }
    if (kind_ == kind::iterative) iterative_.analyze(size, places);
  }

  /// Sets the blocks; returns false if the matrix is not positive definite.
  /// @pre the spans outlive the calls to `solve`
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
    if (kind_ == kind::sparse) return sparse_.factor(diagonal, off_diagonal);
    if (kind_ == kind::iterative) return iterative_.factor(diagonal, off_diagonal);
    dense_.resize(C * size_);
    const auto put = [&](std::size_t row, std::size_t column, const block& b) {
      for (int c = 0; c != C; ++c)
        for (int r = 0; r != C; ++r)
          dense_(C * row + static_cast<std::size_t>(r), C * column + static_cast<std::size_t>(c)) = b(r, c);
    };
    for (std::size_t i = 0; i != size_; ++i) put(i, i, diagonal[i]);
    for (std::size_t k = 0; k != places_.size(); ++k)
      if (places_[k].row > places_[k].column)
        put(places_[k].row, places_[k].column, off_diagonal[k]);
      else
        put(places_[k].column, places_[k].row, transposed(off_diagonal[k]));
    return dense_.factor();
  }
  /// The block row at which the matrix was found not to be positive definite, after `factor` has returned false.
  [[nodiscard]] std::uint32_t failed_block() const {
    if (kind_ == kind::sparse) return sparse_.failed_block();
    if (kind_ == kind::iterative) return iterative_.failed_block();
    return static_cast<std::uint32_t>(dense_.failed_row() / C);
  }

  /// Replaces the right-hand side by the solution.
  void solve(std::span<double> x) {
    if (kind_ == kind::dense) dense_.solve(x);
    if (kind_ == kind::sparse) sparse_.solve(x);
    if (kind_ == kind::iterative) iterative_.solve(x);
  }
  /// The number of iterations of the iterative solver so far.
  [[nodiscard]] int iterations() const { return iterative_.iterations(); }

 private:
  reduced_solver_options options_;
  kind kind_ = kind::dense;
  std::size_t size_ = 0;
  std::vector<block_place> places_;
  dense_cholesky dense_;
  block_cholesky<C> sparse_;
  block_conjugate_gradients<C> iterative_;
};

}  // namespace orbis::optimize::detail
