// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Solvers of the reduced system of bundle adjustment, a symmetric matrix of C x C blocks.
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

namespace orbis::optimize::detail {

/// `dense_cholesky` for blocks.
template <int C>
class dense_block_solver {
 public:
  using block = matrix<C, C>;
  template <class Options>
  explicit dense_block_solver(const Options&) {}

  void analyze(std::size_t size, std::span<const block_place> places) {
    size_ = size;
    places_.assign(places.begin(), places.end());
  }
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
    cholesky_.resize(C * size_);
    for (std::size_t i = 0; i != size_; ++i) put(i, i, diagonal[i]);
    for (std::size_t k = 0; k != places_.size(); ++k)
      if (places_[k].row > places_[k].column)
        put(places_[k].row, places_[k].column, off_diagonal[k]);
      else
        put(places_[k].column, places_[k].row, transposed(off_diagonal[k]));
    return cholesky_.factor();
  }
  [[nodiscard]] std::uint32_t failed_block() const { return static_cast<std::uint32_t>(cholesky_.failed_row() / C); }
  void solve(std::span<double> x) const { cholesky_.solve(x); }
  [[nodiscard]] static int iterations() { return 0; }

 private:
  void put(std::size_t row, std::size_t column, const block& b) {
    for (int c = 0; c != C; ++c)
      for (int r = 0; r != C; ++r)
        cholesky_(C * row + static_cast<std::size_t>(r), C * column + static_cast<std::size_t>(c)) = b(r, c);
  }
  std::size_t size_ = 0;
  std::vector<block_place> places_;
  dense_cholesky cholesky_;
};

/// `block_cholesky` without damping.
template <int C>
class sparse_block_solver : private block_cholesky<C> {
 public:
  template <class Options>
  explicit sparse_block_solver(const Options&) {}
  using block_cholesky<C>::analyze;
  using block_cholesky<C>::solve;
  using block_cholesky<C>::failed_block;
  using block_cholesky<C>::symbolic;
  [[nodiscard]] bool factor(std::span<const matrix<C, C>> diagonal, std::span<const matrix<C, C>> off_diagonal) {
    return block_cholesky<C>::factor(diagonal, off_diagonal);
  }
  [[nodiscard]] static int iterations() { return 0; }
};

/// `block_conjugate_gradients` by the names of its options.
template <int C>
class iterative_block_solver : public block_conjugate_gradients<C> {
 public:
  template <class Options>
  explicit iterative_block_solver(const Options& options)
      : block_conjugate_gradients<C>{options.relative_tolerance, options.max_iterations} {}
};

enum class block_solver_kind { dense, sparse, iterative };

/// One of the three, chosen by size and fill.
template <int C>
class automatic_block_solver {
 public:
  using kind = block_solver_kind;
  template <class Options>
  explicit automatic_block_solver(const Options& options)
      : dense_limit_{options.dense_limit},
        fill_limit_{options.fill_limit},
        dense_{options},
        sparse_{options},
        iterative_{options.iterative} {}

  [[nodiscard]] kind chosen() const { return kind_; }

  void analyze(std::size_t size, std::span<const block_place> places);
  [[nodiscard]] bool factor(std::span<const matrix<C, C>> diagonal, std::span<const matrix<C, C>> off_diagonal);
  void solve(std::span<double> x);
  [[nodiscard]] std::uint32_t failed_block();
  [[nodiscard]] int iterations() const { return iterative_.iterations(); }

 private:
  template <class F>
  void with(const F& f) {
    if (kind_ == kind::dense) f(dense_);
    if (kind_ == kind::sparse) f(sparse_);
    if (kind_ == kind::iterative) f(iterative_);
  }

  std::size_t dense_limit_, fill_limit_;
  kind kind_ = kind::dense;
  dense_block_solver<C> dense_;
  sparse_block_solver<C> sparse_;
  iterative_block_solver<C> iterative_;
};

template <int C>
void automatic_block_solver<C>::analyze(std::size_t size, std::span<const block_place> places) {
  kind_ = kind::dense;
  if (size > dense_limit_) {
    kind_ = kind::sparse;
    sparse_.analyze(size, places);
    std::size_t blocks = 0;
    for (const supernode& s : sparse_.symbolic().supernodes)
      blocks += std::size_t{s.columns} * (std::size_t{s.columns} + s.rows);
    if (blocks > fill_limit_) kind_ = kind::iterative;
  }
  if (kind_ == kind::dense) dense_.analyze(size, places);
  if (kind_ == kind::iterative) iterative_.analyze(size, places);
}

template <int C>
bool automatic_block_solver<C>::factor(std::span<const matrix<C, C>> diagonal,
                                       std::span<const matrix<C, C>> off_diagonal) {
  bool definite = false;
  with([&](auto& s) { definite = s.factor(diagonal, off_diagonal); });
  return definite;
}

template <int C>
void automatic_block_solver<C>::solve(std::span<double> x) {
  with([&](auto& s) { s.solve(x); });
}

template <int C>
std::uint32_t automatic_block_solver<C>::failed_block() {
  std::uint32_t block = 0;
  with([&](auto& s) { block = s.failed_block(); });
  return block;
}

}  // namespace orbis::optimize::detail
