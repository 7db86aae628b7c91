// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of alignment.hpp that no camera enters: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/slam_motion.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/slam/detail/depth/alignment.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>

namespace orbis::slam::detail {

ORBIS_COMPILED_ONCE depth_equations equations_of(std::span<const plane_observation_of_row> planes,
                                                 const moving_pose& at, double points, double weakest) {
  depth_equations e;
  e.term.at = at;
  if (planes.empty()) return e;
  constexpr double width = 2.0;  // of Huber's loss
  std::array<mat6, 3> h{zeros<mat6>(), zeros<mat6>(), zeros<mat6>()};
  std::array<vec6, 2> g{zeros<vec6>(), zeros<vec6>()};
  double weights = 0.0, squares = 0.0, range = 0.0, cost = 0.0;
  for (const plane_observation_of_row& o : planes) {
    optimize::point_to_plane seen = o.seen;
    seen.measured = moved_by(at.twist, o.time, seen.measured);
    matrix<1, 6> right;
    const auto r = seen.linearize(at.T_world_camera, right);
    if (!r) continue;
    const vec6 j = -transposed(right);  // a step of the camera from the left is one of its pose from the right, back
    const double error = std::abs((*r)[0]);
    const double weight = error <= width ? 1.0 : width / error;
    cost += 0.5 * weight * error * error;
    squares += error * error;
    weights += weight * seen.information;
    range += norm(seen.measured);
    const mat6 a = weight * j * transposed(j);
    const vec6 b = weight * (*r)[0] * j;
    h[0] += a, h[1] -= o.time * a, h[2] += o.time * o.time * a;
    g[0] += b, g[1] -= o.time * b;
  }
  const auto n = static_cast<double>(planes.size());
  e.deviation = std::sqrt(squares / n);

  // Eigenvalues where a radian counts as the metres at the mean range.
  vec6 scale = filled<vec6>(1);
  for (int i = 3; i != 6; ++i) scale[i] = n / range;
  mat6 scaled;
  for (int i = 0; i != 6; ++i)
    for (int k = 0; k != 6; ++k) scaled(i, k) = scale[i] * h[0](i, k) * scale[k] / weights;
  const symmetric_eigen<6> directions = eigen_of_symmetric<6>(scaled);
  e.least = directions.values[0];
  mat6 keep = zeros<mat6>();
  for (int i = 0; i != 6; ++i) {
    if (!(directions.values[i] > weakest)) continue;
    ++e.determined;
    const vec6 v = column_of(directions.vectors, i);
    keep += outer_product(v, v);
  }
  for (int i = 0; i != 6; ++i)  // of scaled gradients: of gradients
    for (int k = 0; k != 6; ++k) keep(i, k) *= scale[k] / scale[i];
  const double share = std::min(1.0, points / n);
  for (mat6& m : h) m = share * (keep * m * transposed(keep));
  for (vec6& v : g) v = share * (keep * v);
  set_parts(e.term, h, g);
  e.term.cost = share * cost;
  return e;
}

ORBIS_COMPILED_ONCE vec6 step_of(const depth_equations& e) {
  const symmetric_eigen<6> h = eigen_of_symmetric<6>(block<6, 6>(e.term.h, 0, 0));
  vec6 step = zeros<vec6>();
  for (int i = 6 - e.determined; i < 6; ++i)  // the others are zero
    if (const vec6 v = column_of(h.vectors, i); h.values[i] > 0.0)
      step -= v * (dot(v, head<6>(e.term.g)) / h.values[i]);
  return step;
}

}  // namespace orbis::slam::detail
