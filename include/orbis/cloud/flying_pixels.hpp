// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Detection of flying pixels in depth images: at the edge of a near surface in front of a far one, pixels that see
/// both surfaces measure a depth between them, where there is no surface.
///
/// The test works on inverse depth along the rows and columns of the image. Inverse depth is linear over the image of a
/// plane of any slant, and for a triangulating camera (sigma_z ~ z^2) its noise and quantisation are the same at every
/// depth. A pixel is flying if the surfaces on its two sides, each extrapolated to the pixel along its own slope,
/// differ by a jump, and the pixel lies between the two, at a distance from both. It is kept if enough of the pixels
/// around it have the same depth, as on a thin real object. A missing measurement counts as infinitely far, because the
/// shadow next to a near surface is also an edge.
///
/// Sources: M. Reynolds, J. Dobos, L. Peel, T. Weyrich, G. J. Brostow, "Capturing time-of-flight data with
/// confidence", CVPR 2011; A. Sabov, J. Krueger, "Identification and correction of flying pixels in range
/// camera data", SCCG 2008. For the noise: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect
/// depth data for indoor mapping applications", Sensors 12, 2012.
#pragma once

#include <cassert>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/cloud/detail/depth_row_reader.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>

namespace orbis::cloud {

struct flying_pixel_options {
  /// Distance in pixels at which the surfaces on either side are sampled, which is also the maximum width of a
  /// transition that is detected completely. 1 ... 8
  int reach = 2;
  double noise = 1.425e-3;    ///< standard deviation of inverse depth, sigma_z / z^2, 1 / metre; default: a Kinect's
  double resolution = 0.001;  ///< smallest significant depth difference, metres
  double sigmas = 4.0;        ///< minimum distance from a surface, in multiples of the noise or the resolution
  double jump = 3.0;          ///< minimum size of an edge, in multiples of the minimum distance given by `sigmas`
  double margin = 0.05;       ///< minimum distance from a surface, as a fraction of the jump
  int support = 4;            ///< a pixel is kept if at least this number of its eight neighbours have the same depth
};

/// Counts of the examined and the removed pixels.
struct flying_pixel_count {
  std::size_t valid = 0;    ///< number of pixels with a depth
  std::size_t removed = 0;  ///< number of valid pixels that were removed as flying
  friend bool operator==(const flying_pixel_count&, const flying_pixel_count&) = default;
};

/// Buffers that successive calls can share: nothing is allocated after the first call for images of the same size. Not
/// thread-safe.
class flying_pixel_workspace {
 public:
  /// Returns the buffer for inverse depth, with a border of `border` unknown pixels (NaN).
  image_view<float> inverse(int width, int height, int border) {
    const int padded_width = width + 2 * border + lanes;
    const int padded_height = height + 2 * border;
    if (inverse_.width() != padded_width || inverse_.height() != padded_height || border_ != border ||
        width_ != width) {
      inverse_ = image<float>(padded_width, padded_height, std::numeric_limits<float>::quiet_NaN());
      border_ = border;
      width_ = width;
    }
    return inverse_;
  }
  /// Returns one counter per row.
  std::span<flying_pixel_count> counts(int height) {
    counts_.assign(static_cast<std::size_t>(height), {});
    return counts_;
  }
  static constexpr int lanes = 16;  ///< number of pixels tested at once

 private:
  image<float> inverse_;
  std::vector<flying_pixel_count> counts_;
  int border_ = 0;
  int width_ = 0;
};

namespace detail {

/// `remove_flying_pixels` on a type-erased depth image.
template <execution_policy Policy>
flying_pixel_count read_without_flying_pixels(const Policy& policy, const depth_row_reader& depth,
                                              image_view<float> out, const flying_pixel_options& options,
                                              flying_pixel_workspace& workspace);

}  // namespace detail

/// Writes the depth in metres to `out`, 0 where depth is missing or the pixel is flying. `out` may be the memory that
/// `depth` reads, if that holds metres. O(width * height); the same result for every policy and processor.
/// @pre out is as large as depth; reach is 1 ... 8
template <execution_policy Policy, camera::depth_source Depth>
flying_pixel_count remove_flying_pixels(const Policy& policy, const Depth& depth, image_view<float> out,
                                        const flying_pixel_options& options, flying_pixel_workspace& workspace) {
  assert(out.width() == depth.width() && out.height() == depth.height());
  assert(options.reach >= 1 && options.reach <= 8);
  return detail::read_without_flying_pixels(detail::as_parallel(policy), detail::make_row_reader(depth), out, options,
                                            workspace);
}

/// Like the overload with a workspace, but uses temporary buffers.
template <execution_policy Policy, camera::depth_source Depth>
flying_pixel_count remove_flying_pixels(const Policy& policy, const Depth& depth, image_view<float> out,
                                        const flying_pixel_options& options = {}) {
  flying_pixel_workspace workspace;
  return remove_flying_pixels(policy, depth, out, options, workspace);
}

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/flying_pixels-inl.hpp>
#endif
