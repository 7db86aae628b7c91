// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conjugate gradients on a sparse symmetric matrix of blocks.
///
/// Source: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>
#include <orbis/optimize/detail/sum_over.hpp>

namespace orbis::optimize::detail {

/// Conjugate gradients, preconditioned with the inverses of the diagonal blocks. One iteration takes O(blocks). Reuses
/// its memory; refers to the blocks passed to `factor` until the last `solve`. Not thread-safe.
template <int B>
class block_conjugate_gradients {
 public:
  using block = matrix<B, B>;
  using vector = matrix<B>;

  /// Stops when the norm of the residual is below `relative_tolerance` times that of the right-hand side.
  block_conjugate_gradients(double relative_tolerance, int max_iterations)
      : tolerance_{relative_tolerance}, max_iterations_{max_iterations} {}

  void analyze(std::size_t size, std::span<const block_place> places) {
    size_ = size;
    places_.assign(places.begin(), places.end());
    inverse_.resize(size);
    for (auto* v : {&residual_, &direction_, &image_, &preconditioned_, &solution_}) v->assign(B * size, 0.0);
  }

  /// Sets the matrix; returns false if a diagonal block is not positive definite.
  /// @pre the spans outlive the calls to `solve`
  [[nodiscard]] bool factor(std::span<const block> diagonal, std::span<const block> off_diagonal) {
    assert(diagonal.size() == size_ && off_diagonal.size() == places_.size());
    diagonal_ = diagonal;
    off_diagonal_ = off_diagonal;
    for (std::size_t i = 0; i != size_; ++i) {
      small_cholesky<B> factors;
      const bool is_definite = factors.set(diagonal[i]) && factors.factor(0.0) > 0.0;
      if (is_definite) inverse_[i] = factors.inverse();
      if (!is_definite || !all_finite(inverse_[i])) {
        failed_block_ = static_cast<std::uint32_t>(i);
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] std::uint32_t failed_block() const { return failed_block_; }

  /// Replaces the right-hand side by an approximate solution. If the matrix turns out not to be positive definite, the
  /// result is the last iterate before this was detected.
  void solve(std::span<double> x) {
    assert(x.size() == B * size_);
    residual_.assign(x.begin(), x.end());
    solution_.assign(x.size(), 0.0);
    const double wanted = tolerance_ * tolerance_ * dot(residual_, residual_);
    precondition();
    direction_ = preconditioned_;
    double along = dot(residual_, preconditioned_);
    for (int k = 0; k != max_iterations_ && along > 0.0; ++k) {
      ++iterations_;
      multiply();
      const double curvature = dot(direction_, image_);
      if (!(curvature > 0.0)) break;
      const double length = along / curvature;
      for (std::size_t i = 0; i != x.size(); ++i) {
        solution_[i] += length * direction_[i];
        residual_[i] -= length * image_[i];
      }
      if (dot(residual_, residual_) <= wanted) break;
      precondition();
      const double next = dot(residual_, preconditioned_);
      const double turn = next / along;
      along = next;
      for (std::size_t i = 0; i != x.size(); ++i) direction_[i] = preconditioned_[i] + turn * direction_[i];
    }
    std::copy(solution_.begin(), solution_.end(), x.begin());
  }

  [[nodiscard]] int iterations() const { return iterations_; }

 private:
  static constexpr std::size_t width = static_cast<std::size_t>(B);
  [[nodiscard]] static vector at(const std::vector<double>& v, std::size_t i) {
    vector part;
    std::copy_n(v.data() + width * i, width, part.data());
    return part;
  }
  static void put(const vector& part, std::vector<double>& v, std::size_t i) {
    std::copy_n(part.data(), width, v.data() + width * i);
  }
  [[nodiscard]] static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    return sum_over(a.size(), [&](std::size_t i) { return a[i] * b[i]; });
  }
  void precondition() {
    for (std::size_t i = 0; i != size_; ++i) put(inverse_[i] * at(residual_, i), preconditioned_, i);
  }
  void multiply() {
    for (std::size_t i = 0; i != size_; ++i) put(diagonal_[i] * at(direction_, i), image_, i);
    for (std::size_t k = 0; k != places_.size(); ++k) {
      const auto& [row, column] = places_[k];
      put(at(image_, row) + off_diagonal_[k] * at(direction_, column), image_, row);
      put(at(image_, column) + transposed_product(off_diagonal_[k], at(direction_, row)), image_, column);
    }
  }

  double tolerance_;
  int max_iterations_;
  int iterations_ = 0;
  std::uint32_t failed_block_ = 0;
  std::size_t size_ = 0;
  std::vector<block_place> places_;
  std::span<const block> diagonal_, off_diagonal_;
  std::vector<block> inverse_;
  std::vector<double> residual_, direction_, image_, preconditioned_, solution_;
};

}  // namespace orbis::optimize::detail
