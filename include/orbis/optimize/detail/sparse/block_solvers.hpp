// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Solvers of the reduced system of bundle adjustment, a symmetric matrix of C x C blocks: what they are, without their
/// code, which is in reduced_solvers.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/boxed.hpp>

namespace orbis::optimize::detail {

/// The place of one block off the diagonal of a symmetric matrix; (column, row) is implied.
struct block_place {
  std::uint32_t row = 0;
  std::uint32_t column = 0;
  friend bool operator==(const block_place&, const block_place&) = default;
};

class dense_cholesky;
template <int B>
requires(B >= 1) class block_cholesky;
template <int B>
class block_conjugate_gradients;

/// `dense_cholesky` for blocks.
template <int C>
class dense_block_solver {
 public:
  using block = matrix<C, C>;
  template <class Options>
  explicit dense_block_solver(const Options&);

  void analyze(std::size_t size, std::span<const block_place> places);
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal);
  [[nodiscard]] std::uint32_t failed_block() const;
  void solve(std::span<double> x) const;
  [[nodiscard]] static int iterations() { return 0; }

 private:
  std::size_t size_ = 0;
  std::vector<block_place> places_;
  boxed<dense_cholesky> cholesky_;
};

/// `block_cholesky` without damping.
template <int C>
class sparse_block_solver {
 public:
  using block = matrix<C, C>;
  template <class Options>
  explicit sparse_block_solver(const Options&);

  void analyze(std::size_t size, std::span<const block_place> places);
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal);
  [[nodiscard]] std::uint32_t failed_block() const;
  void solve(std::span<double> x);
  [[nodiscard]] static int iterations() { return 0; }
  /// The number of blocks of the factor.
  [[nodiscard]] std::size_t fill() const;

 private:
  boxed<block_cholesky<C>> cholesky_;
};

/// `block_conjugate_gradients` by the names of its options.
template <int C>
class iterative_block_solver {
 public:
  using block = matrix<C, C>;
  template <class Options>
  explicit iterative_block_solver(const Options& options);

  void analyze(std::size_t size, std::span<const block_place> places);
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal);
  [[nodiscard]] std::uint32_t failed_block() const;
  void solve(std::span<double> x);
  [[nodiscard]] int iterations() const;

 private:
  boxed<block_conjugate_gradients<C>> gradients_;
};

enum class block_solver_kind { dense, sparse, iterative };

/// One of the three, chosen by size and fill.
template <int C>
class automatic_block_solver {
 public:
  using block = matrix<C, C>;
  using kind = block_solver_kind;
  template <class Options>
  explicit automatic_block_solver(const Options& options);

  [[nodiscard]] kind chosen() const { return kind_; }

  void analyze(std::size_t size, std::span<const block_place> places);
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal);
  void solve(std::span<double> x);
  [[nodiscard]] std::uint32_t failed_block() const;
  [[nodiscard]] int iterations() const;

 private:
  std::size_t dense_limit_, fill_limit_;
  kind kind_ = kind::dense;
  dense_block_solver<C> dense_;
  sparse_block_solver<C> sparse_;
  iterative_block_solver<C> iterative_;
};

}  // namespace orbis::optimize::detail
