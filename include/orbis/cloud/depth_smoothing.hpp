// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smoothing of depth images that preserves edges and slants.
///
/// Inverse depth is linear over the image of a plane of any slant, so the mean of two pixels on opposite sides of a
/// pixel, at the same distance, measures the inverse depth of the pixel itself. Each pixel becomes the mean of itself
/// and of all such pairs around it that agree with it within the noise. A pair across an edge does not agree.
///
/// Sources: C. Tomasi, R. Manduchi, "Bilateral filtering for gray and color images", ICCV 1998; its use on depth images
/// before they are mapped: R. A. Newcombe et al., "KinectFusion: real-time dense surface mapping and tracking", ISMAR
/// 2011. The pairs replace its constant model of the surface by a linear one.
#pragma once

#include <cassert>

#include <orbis/camera/depth.hpp>
#include <orbis/cloud/detail/depth_row_reader.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>

namespace orbis::cloud {

/// Parameters of `smooth_depth`.
struct depth_smoothing_options {
  int radius = 3;             ///< maximum distance of the pixels of a pair from the pixel, pixels; 1 ... 8
  double noise = 1.425e-3;    ///< standard deviation of inverse depth, sigma_z / z^2, 1 / metre; default: a Kinect's
  double resolution = 0.001;  ///< quantisation step of depth, metres
  /// Maximum difference between the mean of a pair and the pixel, in multiples of the difference's standard deviation.
  double sigmas = 2.0;
  /// Maximum relative change of inverse depth per pixel on a surface: the tangent of its steepest slant divided by the
  /// focal length in pixels. Default: 75 degrees at 500 pixels.
  double steepest = 0.0075;
};

namespace detail {

/// `smooth_depth` on a type-erased depth image.
template <execution_policy Policy>
void write_smoothed_depth(const Policy& policy, const depth_row_reader& depth, image_view<float> out,
                          const depth_smoothing_options& options, image<float>& memory);

}  // namespace detail

/// Writes the smoothed depth in metres to `out`; 0 where depth is missing. `memory`: working memory, allocated by the
/// first call for images of a size. `out` may be the memory that `depth` reads, if that holds metres. O(width * height
/// * radius^2); the same result for every policy and processor.
/// @pre out is as large as depth; radius is 1 ... 8
template <execution_policy Policy, camera::depth_source Depth>
void smooth_depth(const Policy& policy, const Depth& depth, image_view<float> out,
                  const depth_smoothing_options& options, image<float>& memory) {
  assert(out.width() == depth.width() && out.height() == depth.height());
  assert(options.radius >= 1 && options.radius <= 8);
  detail::write_smoothed_depth(detail::as_parallel(policy), detail::make_row_reader(depth), out, options, memory);
}

/// Like the overload with working memory, but allocates it.
template <execution_policy Policy, camera::depth_source Depth>
void smooth_depth(const Policy& policy, const Depth& depth, image_view<float> out,
                  const depth_smoothing_options& options = {}) {
  image<float> memory;
  smooth_depth(policy, depth, out, options, memory);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/depth_smoothing-inl.hpp>
#endif
