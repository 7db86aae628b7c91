// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The solvers of block_solvers.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/detail/sparse/block_solvers.hpp>
#include <orbis/optimize/detail/sparse/conjugate_gradients.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>

namespace orbis::optimize::detail {

template <int C>
template <class Options>
dense_block_solver<C>::dense_block_solver(const Options&) : cholesky_{dense_cholesky{}} {}

template <int C>
void dense_block_solver<C>::analyze(std::size_t size, std::span<const block_place> places) {
  size_ = size;
  places_.assign(places.begin(), places.end());
}

template <int C>
bool dense_block_solver<C>::factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
  dense_cholesky& to = *cholesky_;
  to.resize(C * size_);
  const auto put = [&](std::size_t row, std::size_t column, const block& b) {
    for (int c = 0; c != C; ++c)
      for (int r = 0; r != C; ++r)
        to(C * row + static_cast<std::size_t>(r), C * column + static_cast<std::size_t>(c)) = b(r, c);
  };
  for (std::size_t i = 0; i != size_; ++i) put(i, i, diagonal[i]);
  for (std::size_t k = 0; k != places_.size(); ++k)
    if (places_[k].row > places_[k].column)
      put(places_[k].row, places_[k].column, off_diagonal[k]);
    else
      put(places_[k].column, places_[k].row, transposed(off_diagonal[k]));
  return to.factor();
}

template <int C>
std::uint32_t dense_block_solver<C>::failed_block() const {
  return static_cast<std::uint32_t>(cholesky_->failed_row() / C);
}

template <int C>
void dense_block_solver<C>::solve(std::span<double> x) const {
  cholesky_->solve(x);
}

template <int C>
template <class Options>
sparse_block_solver<C>::sparse_block_solver(const Options&) : cholesky_{block_cholesky<C>{}} {}

template <int C>
void sparse_block_solver<C>::analyze(std::size_t size, std::span<const block_place> places) {
  cholesky_->analyze(size, places);
}

template <int C>
bool sparse_block_solver<C>::factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
  return cholesky_->factor(diagonal, off_diagonal);
}

template <int C>
std::uint32_t sparse_block_solver<C>::failed_block() const {
  return cholesky_->failed_block();
}

template <int C>
void sparse_block_solver<C>::solve(std::span<double> x) {
  cholesky_->solve(x);
}

template <int C>
std::size_t sparse_block_solver<C>::fill() const {
  std::size_t blocks = 0;
  for (const supernode& s : cholesky_->symbolic().supernodes)
    blocks += std::size_t{s.columns} * (std::size_t{s.columns} + s.rows);
  return blocks;
}

template <int C>
template <class Options>
iterative_block_solver<C>::iterative_block_solver(const Options& options)
    : gradients_{block_conjugate_gradients<C>{options.relative_tolerance, options.max_iterations}} {}

template <int C>
void iterative_block_solver<C>::analyze(std::size_t size, std::span<const block_place> places) {
  gradients_->analyze(size, places);
}

template <int C>
bool iterative_block_solver<C>::factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
  return gradients_->factor(diagonal, off_diagonal);
}

template <int C>
std::uint32_t iterative_block_solver<C>::failed_block() const {
  return gradients_->failed_block();
}

template <int C>
void iterative_block_solver<C>::solve(std::span<double> x) {
  gradients_->solve(x);
}

template <int C>
int iterative_block_solver<C>::iterations() const {
  return gradients_->iterations();
}

template <int C>
template <class Options>
automatic_block_solver<C>::automatic_block_solver(const Options& options)
    : dense_limit_{options.dense_limit},
      fill_limit_{options.fill_limit},
      dense_{options},
      sparse_{options},
      iterative_{options.iterative} {}

template <int C>
void automatic_block_solver<C>::analyze(std::size_t size, std::span<const block_place> places) {
  kind_ = kind::dense;
  if (size > dense_limit_) {
    sparse_.analyze(size, places);
    kind_ = sparse_.fill() > fill_limit_ ? kind::iterative : kind::sparse;
  }
  if (kind_ == kind::dense) dense_.analyze(size, places);
  if (kind_ == kind::iterative) iterative_.analyze(size, places);
}

template <int C>
bool automatic_block_solver<C>::factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
  if (kind_ == kind::dense) return dense_.factor(diagonal, off_diagonal);
  if (kind_ == kind::sparse) return sparse_.factor(diagonal, off_diagonal);
  return iterative_.factor(diagonal, off_diagonal);
}

template <int C>
void automatic_block_solver<C>::solve(std::span<double> x) {
  if (kind_ == kind::dense) dense_.solve(x);
  if (kind_ == kind::sparse) sparse_.solve(x);
  if (kind_ == kind::iterative) iterative_.solve(x);
}

template <int C>
std::uint32_t automatic_block_solver<C>::failed_block() const {
  if (kind_ == kind::dense) return dense_.failed_block();
  if (kind_ == kind::sparse) return sparse_.failed_block();
  return iterative_.failed_block();
}

template <int C>
int automatic_block_solver<C>::iterations() const {
  return iterative_.iterations();
}

}  // namespace orbis::optimize::detail
