// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of dense_cholesky.hpp: inline, or, with ORBIS_COMPILED, compiled once, by cmake/compiled/optimize.cpp.
#pragma once

#include <cassert>
#include <span>

#include <Eigen/Core>

#include <orbis/core/compiled_once.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>

namespace orbis::optimize::detail {

ORBIS_COMPILED_ONCE void dense_cholesky::solve(std::span<double> x) const {
  assert(x.size() == size_);
  const auto n = static_cast<Eigen::Index>(size_);
  const Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>> l(
      values_.data(), n, n, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride_)));
  Eigen::Map<Eigen::VectorXd> y(x.data(), n);
  l.triangularView<Eigen::Lower>().solveInPlace(y);
  l.triangularView<Eigen::Lower>().transpose().solveInPlace(y);
}

}  // namespace orbis::optimize::detail
