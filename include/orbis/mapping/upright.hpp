// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which way is up in a depth image, so that a map can begin upright.
///
/// @code
///   const mapping::upright_view view = mapping::find_upright(frame.depth_metres(), camera::ray_table{camera});
///   options.initial_pose = se3{view.R_world_camera, zeros<vec3>()};   // of slam::rgbd_system
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string_view>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/detail/upright/planar_blocks.hpp>
#include <orbis/mapping/detail/upright/up_vote.hpp>

namespace orbis::mapping {

/// What the direction of up was found from.
enum class upright_source {
  gravity,  ///< measured, and given by the caller
  floor,    ///< a floor, tables or a ceiling in the depth image, with or without walls
  walls,    ///< at least two walls in different directions, and not enough of a floor
  assumed   ///< nothing: the camera is taken to be held level, its -y axis up
};

/// The name of a source: "gravity", "floor", "walls", "assumed".
[[nodiscard]] constexpr std::string_view to_string(upright_source source) noexcept {
  switch (source) {
    case upright_source::gravity: return "gravity";
    case upright_source::floor: return "floor";
    case upright_source::walls: return "walls";
    case upright_source::assumed: return "assumed";
  }
  return "unknown";
}

struct upright_options {
  /// Where gravity pulls, in the camera's frame (x right, y down, z forward), of any length: minus what an
  /// accelerometer at rest measures. Not finite or zero: as if it were not given.
  std::optional<vec3> gravity_camera{};
  double max_tilt = 50.0 * std::numbers::pi / 180.0;  ///< radians between up and the camera's -y axis, at most
  double min_support = 0.06;  ///< share of the image's blocks with depth that have to fix the direction
};

struct upright_view {
  /// Turns vectors of the camera's frame into an upright world: z up, x the horizontal part of where the camera looks.
  so3 R_world_camera;
  upright_source source = upright_source::assumed;
  /// From 0 (assumed) to 1 (gravity): how large a share of the image's blocks with depth fixes the direction. Where it
  /// is above 0.2, the error was below 2 degrees in what we tried.
  double confidence = 0.0;

  /// The direction of up in the camera's frame; a unit vector.
  [[nodiscard]] vec3 up_camera() const { return R_world_camera.inverse() * vec3(0.0, 0.0, 1.0); }
};

/// The rotation to a world with z up, in which the camera looks along x as far as that is horizontal: with `up_camera`
/// a unit vector of the camera's frame. A camera that looks straight up or down has the top of its image, or the
/// bottom, along x.
[[nodiscard]] inline so3 upright_rotation(const vec3& up_camera) {
  vec3 ahead = vec3(0.0, 0.0, 1.0) - up_camera.z() * up_camera;
  if (norm(ahead) < 1e-3) {
    ahead = vec3(0.0, up_camera.z() > 0 ? 1.0 : -1.0, 0.0);
    ahead -= dot(up_camera, ahead) * up_camera;
  }
  ahead = normalized(ahead);
  return so3{rows(ahead, cross(up_camera, ahead), up_camera)};
}

/// The upright world of a depth image: from gravity where it is given, else from planes.
///
/// Planes are fitted to the blocks of a grid of some hundreds, in inverse depth, where a plane is linear and the noise
/// of a disparity sensor is even. Each block votes for the directions along its normal (a floor, a table, a ceiling)
/// and across it (a wall); directions beyond `max_tilt` are left out, and those far from the camera's -y axis weigh
/// less. The best of them is refined by least squares over the blocks that agree: the eigenvector of the smallest
/// eigenvalue of `sum(wall normals n n^T) - sum(floor normals n n^T)`. If the image does not fix a direction (nothing
/// flat, one wall only), the camera is taken to be level, and the source says so.
///
/// Source: the vote of normals for a frame of right angles is after J. Straub, O. Freifeld, G. Rosman, J. J. Leonard,
/// J. W. Fisher III, "The Manhattan frame model: Manhattan world inference in the space of surface normals", T-PAMI 40,
/// 2018; here only up has to be found, so walls need not be at right angles.
///
/// O(pixels), a few milliseconds for 640 x 480. @pre depth and rays have the same size
template <camera::depth_source Depth>
[[nodiscard]] upright_view find_upright(const Depth& depth, const camera::ray_table& rays,
                                        const upright_options& options = {}) {
  assert(depth.width() == rays.width() && depth.height() == rays.height());
  if (options.gravity_camera && options.gravity_camera->allFinite() && norm(*options.gravity_camera) > 0)
    return {upright_rotation(-options.gravity_camera->normalized()), upright_source::gravity, 1.0};
  const detail::planar_blocks blocks = detail::find_planar_blocks(depth, rays);
  const std::optional<detail::found_up> found = detail::vote_for_up(blocks.normals, options.max_tilt);
  const double all = static_cast<double>(std::max<std::size_t>(blocks.with_depth, 1));
  if (!found || found->fixing < options.min_support * all)
    return {upright_rotation(-vec3(0.0, 1.0, 0.0)), upright_source::assumed, 0.0};
  const bool floor_suffices = found->along >= options.min_support * all;
  return {upright_rotation(found->up), floor_suffices ? upright_source::floor : upright_source::walls,
          std::min(1.0, found->fixing / all)};
}

}  // namespace orbis::mapping
