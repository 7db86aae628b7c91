// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Solvers of the reduced system of bundle adjustment: dense, block-sparse, iterative, and the choice
/// among them.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/detail/sparse/conjugate_gradients.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>

namespace orbis::optimize {

/// Of symmetric matrices of C x C blocks. `s.analyze(size, places)` says which blocks below the diagonal
/// there are, `s.factor(diagonal, off_diagonal)` what is in them and whether that is positive definite
/// (else `s.failed_block()` is a block row where it is not), `s.solve(x)` replaces the right-hand side.
/// `s.iterations()` is how many an iterative solver has done in all.
template <class S, int C>
concept block_solver = requires(S& s, std::size_t size, std::span<const block_place> places,
                                std::span<const matrix<C, C>> blocks, std::span<double> x) {
  {s.analyze(size, places)};
  { s.factor(blocks, blocks) } -> std::same_as<bool>;
  { s.failed_block() } -> std::convertible_to<std::uint32_t>;
  {s.solve(x)};
  { s.iterations() } -> std::convertible_to<int>;
};

/// A family of solvers: `typename R::template solver<C>`, made of an `R`, for every block size.
template <class R>
concept reduced_solver = std::copyable<R> && block_solver < typename R::template solver<6>,
6 > &&std::constructible_from<typename R::template solver<6>, const R&>;

/// Dense: best up to some hundred cameras that all see the same things. (size)^3 / 3 multiplications.
struct dense_reduced_solver {
  template <int C>
  class solver {
   public:
    using block = matrix<C, C>;
    explicit solver(const dense_reduced_solver&) {}

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
          put(places_[k].column, places_[k].row, off_diagonal[k].transpose());
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
};

/// Block-sparse Cholesky in a fill-reducing order: hundreds to thousands of cameras along a way.
struct sparse_reduced_solver {
  template <int C>
  class solver : private block_cholesky<C> {
   public:
    explicit solver(const sparse_reduced_solver&) {}
    using block_cholesky<C>::analyze;
    using block_cholesky<C>::solve;
    using block_cholesky<C>::failed_block;
    using block_cholesky<C>::symbolic;
    [[nodiscard]] bool factor(std::span<const matrix<C, C>> diagonal, std::span<const matrix<C, C>> off_diagonal) {
      return block_cholesky<C>::factor(diagonal, off_diagonal);
    }
    [[nodiscard]] static int iterations() { return 0; }
  };
};

/// Conjugate gradients preconditioned with the diagonal blocks: thousands of cameras, steps that need
/// not be exact.
struct iterative_reduced_solver {
  double relative_tolerance = 1e-6;  ///< of the residual's norm
  int max_iterations = 500;

  template <int C>
  class solver : public block_conjugate_gradients<C> {
   public:
    explicit solver(const iterative_reduced_solver& options)
        : block_conjugate_gradients<C>{options.relative_tolerance, options.max_iterations} {}
  };
};

/// Dense below `dense_limit` cameras, block-sparse while its factor has at most `fill_limit` blocks,
/// iterative beyond.
struct automatic_reduced_solver {
  std::size_t dense_limit = 100;
  std::size_t fill_limit = 2'000'000;
  iterative_reduced_solver iterative{};

  enum class kind { dense, sparse, iterative };

  template <int C>
  class solver {
   public:
    explicit solver(const automatic_reduced_solver& options)
        : dense_limit_{options.dense_limit},
          fill_limit_{options.fill_limit},
          dense_{dense_reduced_solver{}},
          sparse_{sparse_reduced_solver{}},
          iterative_{options.iterative} {}

    [[nodiscard]] kind chosen() const { return kind_; }

    void analyze(std::size_t size, std::span<const block_place> places) {
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
    [[nodiscard]] bool factor(std::span<const matrix<C, C>> diagonal, std::span<const matrix<C, C>> off_diagonal) {
      bool definite = false;
      with([&](auto& s) { definite = s.factor(diagonal, off_diagonal); });
      return definite;
    }
    void solve(std::span<double> x) {
      with([&](auto& s) { s.solve(x); });
    }
    [[nodiscard]] std::uint32_t failed_block() {
      std::uint32_t block = 0;
      with([&](auto& s) { block = s.failed_block(); });
      return block;
    }
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
    dense_reduced_solver::solver<C> dense_;
    sparse_reduced_solver::solver<C> sparse_;
    iterative_reduced_solver::solver<C> iterative_;
  };
};

static_assert(reduced_solver<dense_reduced_solver> && reduced_solver<sparse_reduced_solver>);
static_assert(reduced_solver<iterative_reduced_solver> && reduced_solver<automatic_reduced_solver>);

}  // namespace orbis::optimize
