// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of a frame's pose from its depth image: aligns points of the frame with surfaces of keyframes.
///
/// Points are associated with surfaces by projection, and their distances to the planes are minimised. Sources: G.
/// Blais, M. D. Levine, "Registering multiview range data to create 3D computer objects", PAMI 17(8), 1995; Y. Chen, G.
/// Medioni, "Object modelling by registration of multiple range images", Image and Vision Computing 10(3), 1992. The
/// pose is not changed in directions that the surfaces do not constrain: J. Zhang, M. Kaess, S. Singh, "On degeneracy
/// of optimization-based state estimation problems", ICRA 2016.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/surface.hpp>
#include <orbis/slam/detail/depth/surface_samples.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>

namespace orbis::slam::detail {

/// A surface with its pose in the world frame.
struct placed_surface {
  const surface* seen = nullptr;
  se3 T_world_camera;
};

/// Maximum deviation of a point from its associated plane.
struct alignment_gate {
  double distance = 0.05;   ///< metres; the greater of this and `deviations` applies
  double deviations = 4.0;  ///< standard deviations; the greater of this and `distance` applies
  double cosine = 0.8;      ///< minimum cosine of the angle between the normals of both surfaces
};

/// A point of the frame and its associated plane.
struct plane_observation_of_row {
  optimize::point_to_plane seen;  ///< `measured` is in the camera frame at the time of the row
  double time = 0.0;              ///< time of the row relative to the frame, seconds
};

/// Counts of associated samples.
struct association {
  std::size_t visible = 0;     ///< number of samples that project onto a known surface
  std::size_t consistent = 0;  ///< number of visible samples within the gate
  [[nodiscard]] double share() const noexcept {
    return visible == 0 ? 0.0 : static_cast<double>(consistent) / static_cast<double>(visible);
  }
};

/// Finds the planes for samples at a given pose: for each sample, the plane of the first surface that agrees with it.
/// Every `stride`-th sample is used. O(samples * surfaces).
template <camera::camera_model Camera>
association associate(std::span<const surface_sample> samples, std::size_t stride,
                      std::span<const placed_surface> surfaces, const moving_pose& at, const camera::shutter& shutter,
                      const camera_rig<Camera>& rig, const alignment_gate& gate,
                      std::vector<plane_observation_of_row>& to) {
  to.clear();
  association count;
  struct placed {
    mat3 rotation;  // from the frame to the surface
    vec3 translation;
    mat3 to_world;
  };
  constexpr std::size_t most_surfaces = 4;
  std::array<placed, most_surfaces> place;
  const std::size_t surface_count = std::min(surfaces.size(), most_surfaces);
  for (std::size_t k = 0; k != surface_count; ++k) {
    const se3 T = surfaces[k].T_world_camera.inverse() * at.T_world_camera;
    place[k] = {T.rotation_matrix(), T.translation(), surfaces[k].T_world_camera.rotation_matrix()};
  }
  for (std::size_t i = 0; i < samples.size(); i += stride) {
    const surface_sample& s = samples[i];
    const double time = shutter.depth_time(s.row, rig.camera().height());
    const vec3 point = moved_by(at.twist, time, s.point);
    bool visible = false;
    for (std::size_t k = 0; k != surface_count; ++k) {
      const vec3 there = place[k].rotation * point + place[k].translation;
      const auto pixel = there.z() > 0.0 ? rig.camera().project(there) : std::nullopt;
      const surface_cell* const cell = pixel ? surfaces[k].seen->at(*pixel) : nullptr;
      if (cell == nullptr || !cell->is_there()) continue;
      visible = true;
      const vec3 normal = cell->normal();
      const double off = dot(normal, there - cell->point());
      const double deviation = std::max(0.002, s.point.z() * s.point.z() / rig.model.bf * std::abs(s.normal.z()));
      if (std::abs(off) > std::max(gate.distance, gate.deviations * deviation) ||
          dot(normal, place[k].rotation * s.normal) < gate.cosine)
        continue;
      ++count.consistent;
      to.push_back({{s.point, surfaces[k].T_world_camera * cell->point(), place[k].to_world * normal,
                     1.0 / (deviation * deviation)},
                    time});
      break;
    }
    count.visible += visible ? 1 : 0;
  }
  return count;
}

/// The cost of the plane residuals as a quadratic function of a motion of the camera frame
/// (`exp(step) * T_camera_world`), excluding the directions that the planes do not constrain.
struct depth_equations {
  pose_quadratic term;     ///< the cost, scaled down if there are more than `points` planes
  int determined = 0;      ///< number of determined pose directions, out of six
  double least = 0.0;      ///< mean squared normal component in the least determined direction
  double deviation = 0.0;  ///< root mean square of the residuals, in standard deviations
};

/// Builds the equations for the given planes. `points`: maximum number of independent points; if there are more, their
/// weights are reduced accordingly. `weakest`: a direction counts as unconstrained if the mean squared normal component
/// along it is below this value; rotations are scaled to metres by the mean depth of the points. O(planes).
[[nodiscard]] inline depth_equations build_equations(std::span<const plane_observation_of_row> planes,
                                                     const moving_pose& at, double points, double weakest) {
  depth_equations e;
  e.term.at = at;
  if (planes.empty()) return e;
  constexpr double width = 2.0;  // of the Huber loss
  std::array<mat6, 3> h{zeros<mat6>(), zeros<mat6>(), zeros<mat6>()};
  std::array<vec6, 2> g{zeros<vec6>(), zeros<vec6>()};
  double weights = 0.0, squares = 0.0, range = 0.0, cost = 0.0;
  for (const plane_observation_of_row& o : planes) {
    optimize::point_to_plane seen = o.seen;
    seen.measured = moved_by(at.twist, o.time, seen.measured);
    matrix<1, 6> right;
    const auto r = seen.linearize(at.T_world_camera, right);
    if (!r) continue;
    const vec6 j = -transposed(right);  // a left step d of T_camera_world is a right step -d of T_world_camera
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

  // Eigenvalues are comparable if radians are scaled to metres at the mean range.
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
  for (int i = 0; i != 6; ++i)  // undo the scaling of the gradient
    for (int k = 0; k != 6; ++k) keep(i, k) *= scale[k] / scale[i];
  const double share = std::min(1.0, points / n);
  for (mat6& m : h) m = share * (keep * m * transposed(keep));
  for (vec6& v : g) v = share * (keep * v);
  set_parts(e.term, h, g);
  e.term.cost = share * cost;
  return e;
}

/// Returns the motion of the camera frame that minimises the cost in the determined directions; zero in all others.
[[nodiscard]] inline vec6 solve_step(const depth_equations& e) {
  const symmetric_eigen<6> h = eigen_of_symmetric<6>(block<6, 6>(e.term.h, 0, 0));
  vec6 step = zeros<vec6>();
  for (int i = 6 - e.determined; i < 6; ++i)  // the others are zero
    if (const vec6 v = column_of(h.vectors, i); h.values[i] > 0.0)
      step -= v * (dot(v, head<6>(e.term.g)) / h.values[i]);
  return step;
}

}  // namespace orbis::slam::detail
