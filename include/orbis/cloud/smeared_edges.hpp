// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removal of the depth that a moving camera measures at edges.
///
/// A depth camera averages over its motion during the exposure. Planes stay planes, but an edge becomes a ramp between
/// two surfaces, where there is no surface. Along the direction of the motion in the image, the ramp is as long as the
/// motion.
///
/// Let m be the motion of the image during the exposure, in pixels. The inverse depth at x - m plus that at x + m minus
/// twice that at x is 0 where the image shows a plane, because inverse depth is linear there. This second difference is
/// positive at one end of a ramp and negative at the other; a crease between two planes has one sign. A pixel is
/// removed if both signs occur along m within a distance of half of m, plus one pixel for rounding.
///
/// The test does not see whether an edge is blurred: if the image moved by less than m, the pixels next to sharp edges
/// are removed too. Objects that are narrower than m are removed, because all of their pixels are near two edges.
#pragma once

#include <algorithm>
#include <array>
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

/// Thresholds of `remove_smeared_edges`; finite and not negative.
struct smeared_edge_options {
  double noise = 1.425e-3;    ///< standard deviation of inverse depth, sigma_z / z^2, 1 / metre; default: a Kinect's
  double resolution = 0.001;  ///< quantisation step of depth, metres
  double sigmas = 2.5;        ///< smallest significant second difference, in multiples of its standard deviation
};

/// Working memory that calls can share: nothing is allocated after the first call for images of a size. Not
/// thread-safe.
struct smeared_edge_workspace {
  static constexpr int block_size = 32;  ///< edge of a block, pixels
  struct block {
    int x = 0, y = 0;         ///< motion of the image during the exposure, pixels; at most `block_size` along each axis
    std::size_t removed = 0;  ///< number of removed pixels
    [[nodiscard]] int length() const noexcept { return std::max(std::abs(x), std::abs(y)); }
  };

  std::vector<block> blocks;  ///< blocks of the image, row by row
  image<std::uint8_t> signs;  ///< signs of the second differences, with a border of one block; 1: positive, 2: negative
};

namespace detail {

/// `remove_smeared_edges` on a type-erased depth image, with the motions of the blocks in `workspace`.
template <execution_policy Policy>
std::size_t read_without_smeared_edges(const Policy& policy, const depth_row_reader& depth, image_view<float> out,
                                       const smeared_edge_options& options, smeared_edge_workspace& workspace);

/// The motion during `exposure` in the image of the block around a pixel that shows a surface with the inverse depth
/// `inverse`. 0 if the camera model does not cover the pixel, or does not cover the surface after the motion.
template <camera::camera_model Camera>
[[nodiscard]] smeared_edge_workspace::block motion_in_image(const Camera& camera, const vec6& twist, double exposure,
                                                            const vec2& pixel, double inverse) {
  const auto ray = camera.unproject(pixel);
  if (!ray) return {};
  const auto after = camera.project(camera::moved_by(twist, exposure, *ray, inverse));
  if (!after || !all_finite(*after)) return {};
  const auto limited = [](double d) {
    constexpr double most = smeared_edge_workspace::block_size;
    return static_cast<int>(std::lround(std::clamp(d, -most, most)));
  };
  return {limited((*after)[0] - pixel[0]), limited((*after)[1] - pixel[1])};
}

/// Inverse depth of the near surfaces in a block: an eighth of its pixels with a depth are nearer, so that single wrong
/// depths have no effect. 0 if it has no depth. Uses every fourth pixel of every fourth row.
template <camera::depth_source Depth>
[[nodiscard]] double near_inverse_depth(const Depth& depth, int x0, int y0, int x1, int y1) {
  constexpr int step = 4, most = smeared_edge_workspace::block_size / step;
  std::array<float, std::size_t{most} * most> z{};
  std::size_t count = 0;
  for (int y = y0; y < y1; y += step)
    for (int x = x0; x < x1; x += step)
      if (const float metres = depth(x, y); metres > 0.0F) z[count++] = metres;
  if (count == 0) return 0.0;
  const auto near = z.begin() + static_cast<std::ptrdiff_t>(count / 8);
  std::nth_element(z.begin(), near, z.begin() + static_cast<std::ptrdiff_t>(count));
  return 1.0 / static_cast<double>(*near);
}

}  // namespace detail

/// Writes the depth in metres to `out`, 0 where depth is missing or smeared over an edge. Returns the number of removed
/// pixels. `twist`: twist of the camera in its own frame, per second, translation first. `exposure`: time during which
/// the depth image was captured, seconds. `out` may be the memory that `depth` reads, if that holds metres. A motion of
/// the image that rounds to less than two pixels is ignored; the near surfaces of blocks of 32 x 32 pixels determine
/// it. O(width * height * motion); the same result for every policy.
/// @pre depth and out have the camera's size; twist and exposure are finite
template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
std::size_t remove_smeared_edges(const Policy& policy, const Depth& depth, const Camera& camera, const vec6& twist,
                                 double exposure, image_view<float> out, const smeared_edge_options& options,
                                 smeared_edge_workspace& workspace) {
  assert(depth.width() == camera.width() && depth.height() == camera.height());
  assert(out.width() == depth.width() && out.height() == depth.height());
  assert(all_finite(twist) && std::isfinite(exposure));
  constexpr int size = smeared_edge_workspace::block_size;
  workspace.blocks.clear();
  for (int y0 = 0; y0 < depth.height(); y0 += size)
    for (int x0 = 0; x0 < depth.width(); x0 += size) {
      const int x1 = std::min(depth.width(), x0 + size), y1 = std::min(depth.height(), y0 + size);
      const vec2 center(0.5 * (x0 + x1 - 1), 0.5 * (y0 + y1 - 1));
      workspace.blocks.push_back(
          detail::motion_in_image(camera, twist, exposure, center, detail::near_inverse_depth(depth, x0, y0, x1, y1)));
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
