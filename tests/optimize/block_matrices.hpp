// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random block-sparse matrices for the tests of their factorisation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/sparse/block_ordering.hpp>

namespace orbis::test {

using places = std::vector<optimize::detail::block_place>;

/// The edges of a `width` x `height` grid, either way round.
inline places grid_places(std::uint32_t width, std::uint32_t height) {
  places edges;
  for (std::uint32_t y = 0; y != height; ++y)
    for (std::uint32_t x = 0; x != width; ++x) {
      const std::uint32_t i = y * width + x;
      if (x + 1 != width) edges.push_back({i, i + 1});
      if (y + 1 != height) edges.push_back({i + width, i});
    }
  return edges;
}

/// `count` different places among `size` blocks.
inline places random_places(random_bits& random, std::uint32_t size, std::size_t count) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  places chosen;
  while (chosen.size() < count) {
    const std::uint32_t a = random.below(size), b = random.below(size);
    if (a != b && seen.insert({std::min(a, b), std::max(a, b)}).second) chosen.push_back({a, b});
  }
  return chosen;
}

/// A positive definite matrix with these places, as J^T J with a row of blocks for each.
template <int B>
struct block_matrix {
  std::vector<matrix<B, B>> diagonal, off_diagonal;

  block_matrix(random_bits& random, std::size_t size, const places& at, double least = 0.01)
      : diagonal(size, least * matrix<B, B>::Identity()) {
    const auto draw = [&] {
      matrix<B, B> m;
      for (int i = 0; i != B * B; ++i) m(i / B, i % B) = random.normal();
      return m;
    };
    for (const optimize::detail::block_place& p : at) {
      const matrix<B, B> a = draw(), b = draw();
      diagonal[p.row] += a.transpose() * a;
      diagonal[p.column] += b.transpose() * b;
      off_diagonal.push_back(a.transpose() * b);
    }
  }
  [[nodiscard]] Eigen::MatrixXd dense(const places& at) const {
    const auto row = [](std::size_t i) { return static_cast<Eigen::Index>(B * i); };
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(row(diagonal.size()), row(diagonal.size()));
    for (std::size_t i = 0; i != diagonal.size(); ++i) m.template block<B, B>(row(i), row(i)) = diagonal[i];
    for (std::size_t k = 0; k != at.size(); ++k) {
      m.template block<B, B>(row(at[k].row), row(at[k].column)) = off_diagonal[k];
      m.template block<B, B>(row(at[k].column), row(at[k].row)) = off_diagonal[k].transpose();
    }
    return m;
  }
};

}  // namespace orbis::test
