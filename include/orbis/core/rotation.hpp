// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Making rotations of matrices that are not quite.
#pragma once

#include <limits>

#include <Eigen/LU>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis {

/// The rotation whose matrix is closest to `m` (least sum of squared differences). Errors:
/// degenerate, where `m` mirrors (determinant below 0), is singular to rounding, or is not finite.
///
/// Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point
/// patterns", PAMI 13(4), 1991.
[[nodiscard]] inline result<so3> nearest_rotation(const mat3& m) {
  const double size = m.cwiseAbs().maxCoeff();
  if (!m.allFinite()) return fail(errc::degenerate, "rotation matrix", "is not finite");
  const double determinant = size > 0.0 ? mat3(m / size).determinant() : 0.0;
  if (determinant < 0.0) return fail(errc::degenerate, "rotation matrix", "mirrors: its determinant is negative");
  if (!(determinant > 16.0 * std::numeric_limits<double>::epsilon()))
    return fail(errc::degenerate, "rotation matrix", "is singular");
  const auto [u, values, v] = singular_values_of<3>(m);
  return so3{mat3(u * v.transpose())};
}

}  // namespace orbis
