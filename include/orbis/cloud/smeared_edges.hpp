// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of the depth that a moving camera measures at edges.
///
/// A depth camera that moves while it captures an image measures means over its motion. Surfaces stay surfaces, but the
/// edge between two of them becomes a ramp where there is no surface. Along the direction of the motion in the image,
/// the ramp is as long as the motion.
///
/// Inverse depth is linear over the image of a plane, so the sum of the inverse depths of the pixels one motion before
/// and one motion after a pixel, minus twice that of the pixel itself, is 0 on a plane of any slant. This second
/// difference is positive at one end of a ramp and negative at the other; where two surfaces meet without an edge, it
/// has one sign. A pixel is removed if both signs occur within half a motion of it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/cloud/detail/depth_row_reader.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

struct smeared_edge_options {
  double noise = 1.425e-3;    ///< standard deviation of inverse depth, sigma_z / z^2, 1 / metre; default: a Kinect's
  double resolution = 0.001;  ///< quantisation step of depth, metres
  double sigmas = 2.5;        ///< minimum second difference at the ends of a ramp, in standard deviations of it
};

/// Working memory that calls can share: nothing is allocated after the first call for images of a size. Not
/// thread-safe.
struct smeared_edge_workspace {
  static constexpr int edge = 32;  ///< edge of a block, pixels
  struct block {
    int x = 0, y = 0;         ///< motion of the image during the exposure, pixels; at most `edge` along each axis
    std::uint8_t signs = 0;   ///< of all pixels
    std::size_t removed = 0;  ///< number of pixels
    [[nodiscard]] int length() const noexcept { return std::max(std::abs(x), std::abs(y)); }
  };

  std::vector<block> blocks;  ///< of the image, row by row
  int width = 0, height = 0;  ///< of the last image
  image<float> inverse;       ///< inverse depths; 0 where depth is unknown
  image<std::uint8_t> signs;  ///< of significant second differences; 1: positive, 2: negative
};

namespace detail {

/// `remove_smeared_edges` on a type-erased depth image, with the motions of the blocks in `workspace`.
template <execution_policy Policy>
std::size_t read_without_smeared_edges(const Policy& policy, const depth_row_reader& depth, image_view<float> out,
                                       const smeared_edge_options& options, smeared_edge_workspace& workspace);

/// The motion during `exposure` in the image of the block around a pixel, whose nearest surface has the inverse depth
/// `inverse`. 0 if the camera model does not cover the block.
template <camera::camera_model Camera>
[[nodiscard]] smeared_edge_workspace::block motion_in_image(const Camera& camera, const vec6& twist, double exposure,
                                                            const vec2& pixel, double inverse) {
  const auto ray = camera.unproject(pixel);
  if (!ray) return {};
  const auto after = camera.project(camera::moved_by(twist, exposure, *ray, inverse));
  if (!after) return {};
  const auto limited = [](double d) {
    return static_cast<int>(
        std::lround(std::clamp<double>(d, -smeared_edge_workspace::edge, smeared_edge_workspace::edge)));
  };
  return {limited((*after)[0] - pixel[0]), limited((*after)[1] - pixel[1])};
}

}  // namespace detail

/// Writes the depth in metres to `out`, 0 where depth is missing or smeared over an edge. Returns the number of removed
/// pixels. `twist`: twist of the camera in its own frame, per second, translation first. `exposure`: time during which
/// the depth image was captured, seconds. `out` may be the memory that `depth` reads, if that holds metres. Motions of
/// less than two pixels are ignored. O(width * height * motion); the same result for every policy.
/// @pre depth and out have the camera's size; twist and exposure are finite
template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
std::size_t remove_smeared_edges(const Policy& policy, const Depth& depth, const Camera& camera, const vec6& twist,
                                 double exposure, image_view<float> out, const smeared_edge_options& options,
                                 smeared_edge_workspace& workspace) {
  assert(depth.width() == camera.width() && depth.height() == camera.height());
  assert(out.width() == depth.width() && out.height() == depth.height());
  assert(all_finite(twist) && std::isfinite(exposure));
  constexpr int edge = smeared_edge_workspace::edge, step = 4;
  workspace.blocks.clear();
  for (int y0 = 0; y0 < depth.height(); y0 += edge)
    for (int x0 = 0; x0 < depth.width(); x0 += edge) {
      const int x1 = std::min(depth.width(), x0 + edge), y1 = std::min(depth.height(), y0 + edge);
      double inverse = 0.0;  // translation moves the nearest surface farthest
      for (int y = y0; y < y1; y += step)
        for (int x = x0; x < x1; x += step)
          if (const float z = depth(x, y); z > 0.0F) inverse = std::max(inverse, 1.0 / static_cast<double>(z));
      workspace.blocks.push_back(
          detail::motion_in_image(camera, twist, exposure, vec2(0.5 * (x0 + x1 - 1), 0.5 * (y0 + y1 - 1)), inverse));
    }
  return detail::read_without_smeared_edges(detail::as_parallel(policy), detail::make_row_reader(depth), out, options,
                                            workspace);
}

/// Like the overload with a workspace, but allocates it.
template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
std::size_t remove_smeared_edges(const Policy& policy, const Depth& depth, const Camera& camera, const vec6& twist,
                                 double exposure, image_view<float> out, const smeared_edge_options& options = {}) {
  smeared_edge_workspace workspace;
  return remove_smeared_edges(policy, depth, camera, twist, exposure, out, options, workspace);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/smeared_edges-inl.hpp>
#endif
