// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of dense_cholesky.hpp: inline, or, with ORBIS_COMPILED, compiled once, by cmake/compiled/optimize.cpp.
#pragma once

#include <cassert>
#include <span>

#include <orbis/core/compiled_once.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>

namespace orbis::optimize::detail {

ORBIS_COMPILED_ONCE void dense_cholesky::solve(std::span<double> x) const {
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
