// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Flying pixels of depth images: at the edge of a near surface before a far one, pixels that see both
/// measure something in between, where there is nothing.
///
/// The test works on the inverse of depth along the rows and columns of the image. Inverse depth is linear
/// over the image of a plane, however slanted, and its noise and quantisation are the same at every depth
/// for a camera that triangulates (sigma_z ~ z^2). A pixel flies if the surfaces to its two sides, each
/// extended to the pixel along its own slope, miss each other by a jump, and it lies between the two, clear
/// of both; unless enough of the pixels around it lie where it does, as on a narrow thing that really is
/// there. A missing measurement counts as infinitely far: the shadow beside a near surface is an edge, too.
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
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>

namespace orbis::cloud {

struct flying_pixel_options {
  /// Pixels to either side at which the surfaces are looked for: the widest transition that is recognised
  /// as a whole. 1 ... 8
  int reach = 2;
  double noise = 1.425e-3;    ///< deviation of inverse depth: sigma_z / z^2, 1 / metre; the default is a Kinect's
  double resolution = 0.001;  ///< least difference of depth that counts, metres
  double sigmas = 4.0;        ///< clear of a surface: by this many times the noise, or the resolution
  double jump = 3.0;          ///< an edge: by this many times as much
  double margin = 0.05;       ///< clear of a surface: by this part of the jump as well
  int support = 4;            ///< of the eight pixels around, this many at the same depth prove a thing
};

/// What was looked at and what was found.
struct flying_pixel_count {
  std::size_t valid = 0;    ///< pixels with a depth
  std::size_t removed = 0;  ///< of these
  friend bool operator==(const flying_pixel_count&, const flying_pixel_count&) = default;
};

/// Memory that calls can share, one at a time: for images of one size nothing is allocated after the first.
class flying_pixel_workspace {
 public:
  /// Inverse depth with `border` pixels around it of which nothing is known (NaN).
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
  /// One for each row.
  std::span<flying_pixel_count> counts(int height) {
    counts_.assign(static_cast<std::size_t>(height), {});
    return counts_;
  }
  static constexpr int lanes = 16;  ///< pixels that are tested at once

 private:
  image<float> inverse_;
  std::vector<flying_pixel_count> counts_;
  int border_ = 0;
  int width_ = 0;
};

namespace detail {

/// Reads a row of a depth image, metres.
struct depth_row_reader {
  const void* depth = nullptr;
  void (*read)(const void* depth, int y, int width, float* out) = nullptr;
};
template <camera::depth_source Depth>
[[nodiscard]] depth_row_reader reader_of(const Depth& depth) noexcept {
  return {&depth, [](const void* from, int y, int width, float* out) {
            const Depth& image = *static_cast<const Depth*>(from);
            for (int x = 0; x != width; ++x) out[x] = image(x, y);
          }};
}

/// `remove_flying_pixels` for any depth image.
template <execution_policy Policy>
flying_pixel_count read_without_flying_pixels(const Policy& policy, const depth_row_reader& depth,
                                              image_view<float> out, const flying_pixel_options& options,
                                              flying_pixel_workspace& workspace);

}  // namespace detail

/// Writes the depth in metres to `out`, 0 where there is none or the pixel flies. `out` may be the memory
/// that `depth` reads, if that holds metres. O(width * height); the same result for every policy and
/// processor.
/// @pre out is as large as depth; reach is 1 ... 8
template <execution_policy Policy, camera::depth_source Depth>
flying_pixel_count remove_flying_pixels(const Policy& policy, const Depth& depth, image_view<float> out,
                                        const flying_pixel_options& options, flying_pixel_workspace& workspace) {
  assert(out.width() == depth.width() && out.height() == depth.height());
  assert(options.reach >= 1 && options.reach <= 8);
  return detail::read_without_flying_pixels(detail::threads_of(policy), detail::reader_of(depth), out, options,
                                            workspace);
}

/// Removes flying pixels as above, with memory that is freed at the end.
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
