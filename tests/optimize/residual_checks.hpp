// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Checks of residuals of bundle adjustment.
#pragma once

#include <orbis/optimize/bundle_problem.hpp>

#include "support.hpp"
#include "support/catch.hpp"

namespace orbis::test {

/// `linearize` against central differences, relative to the size of each Jacobian.
template <optimize::bundle_residual R>
void check_jacobians(const R& residual, const typename R::camera_state& state, const vec3& point,
                     const optimize::bundle_observation& o) {
  constexpr int size = R::camera_manifold::dimension;
  const typename R::camera_manifold manifold{};
  matrix<R::dimension, size> by_camera, numeric_camera;
  matrix<R::dimension, 3> by_point, numeric_point;
  const auto r = residual.linearize(residual.prepare(state), point, o, by_camera, by_point);
  REQUIRE(r);
  REQUIRE((*r - *residual.residual(residual.prepare(state), point, o)).norm() <= 1e-12 * (1.0 + r->norm()));
  const double h = 1e-5;
  for (int i = 0; i != size; ++i) {
    const auto at = [&](double step) {
      const auto moved = manifold.retract(state, matrix<size>(step * matrix<size>::Unit(i)));
      return *residual.residual(residual.prepare(moved), point, o);
    };
    numeric_camera.col(i) = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
  }
  for (int i = 0; i != 3; ++i) {
    const auto at = [&](double step) {
      return *residual.residual(residual.prepare(state), vec3(point + step * vec3::Unit(i)), o);
    };
    numeric_point.col(i) = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
  }
  for (int i = 0; i != size; ++i)
    CHECK((by_camera.col(i) - numeric_camera.col(i)).norm() <= 1e-6 * (1e-2 + by_camera.col(i).norm()));
  CHECK((by_point - numeric_point).norm() <= 1e-6 * by_point.norm());
}

}  // namespace orbis::test
