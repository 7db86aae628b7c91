// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pose of a frame from its depth: its points against the surfaces of keyframes.
///
/// Points meet surfaces by projection, and their distances from the planes there are minimised. Sources: G. Blais, M.
/// D. Levine, "Registering multiview range data to create 3D computer objects", PAMI 17(8), 1995; Y. Chen, G. Medioni,
/// "Object modelling by registration of multiple range images", Image and Vision Computing 10(3), 1992. What the
/// surfaces leave free is left alone: J. Zhang, M. Kaess, S. Singh, "On degeneracy of optimization-based state
/// estimation problems", ICRA 2016.
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
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/surface.hpp>
#include <orbis/slam/detail/depth/surface_samples.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>

namespace orbis::slam::detail {

/// A surface where it stands in the world.
struct placed_surface {
  const surface* seen = nullptr;
  se3 T_world_camera;
};

/// How far a point may be from the plane that it is compared with.
struct alignment_gate {
  double distance = 0.05;   ///< metres ...
  double deviations = 4.0;  ///< ... or so many standard deviations, if that is more
  double cosine = 0.8;      ///< of the angle between the directions of both surfaces, at least
};

/// A point of the frame and the plane that it lies on.
struct plane_observation_of_row {
  optimize::point_to_plane seen;  ///< `measured` in the camera frame of the row's time
  double time = 0.0;              ///< of the row, relative to the frame, seconds
};

/// What became of the samples.
struct association {
  std::size_t visible = 0;     ///< samples that project to where a surface is known
  std::size_t consistent = 0;  ///< of these, those within the gate
  [[nodiscard]] double share() const noexcept {
    return visible == 0 ? 0.0 : static_cast<double>(consistent) / static_cast<double>(visible);
  }
};

/// Finds the planes that samples lie on, given a pose: for each those of the first surface that agrees with it.
/// `stride`: of the samples every how many-th is looked at. O(samples * surfaces).
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

/// The residuals of the planes to second order in a motion of the camera frame (`exp(step) * T_camera_world`), without
/// the directions that they leave free.
struct depth_equations {
  pose_quadratic term;     ///< the information is that of so many independent points as is allowed, at most
  int determined = 0;      ///< directions of the pose, of six
  double least = 0.0;      ///< what the normals have in the direction that they determine least, mean square
  double deviation = 0.0;  ///< root mean square of the residuals, standard deviations
};

/// `points`: how many points the term may count as; more are weighed down to this. `weakest`: the mean square of what
/// the normals have in a direction, below which it counts as free; rotations as if the points were at their mean
/// depth, which is what turns an angle into metres. O(planes).
[[nodiscard]] depth_equations equations_of(std::span<const plane_observation_of_row> planes, const moving_pose& at,
                                           double points, double weakest);

/// The motion of the camera frame to the least cost, where the planes determine one; zero in all other directions.
[[nodiscard]] vec6 step_of(const depth_equations& e);

}  // namespace orbis::slam::detail

#ifndef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/alignment_functions.hpp>
#endif
