// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Voxels as shaded cubes, drawn in software.
#pragma once

#include <vector>

#include <orbis/core/image.hpp>

#include "results.hpp"
#include "view_frame.hpp"

namespace app {

enum class coloring { camera, height };

/// Draws views of maps: an oblique perspective one and one from above, in which the frame's y axis points up. Voxels
/// above `frame.cut` are omitted. The views are fitted to `in_view`, so that all maps are shown in the same views.
class map_painter {
 public:
  map_painter(const std::vector<voxel>& in_view, const view_frame& frame);

  [[nodiscard]] orbis::image<orbis::rgb8> draw_aslant(const std::vector<voxel>& voxels, coloring how);
  [[nodiscard]] orbis::image<orbis::rgb8> draw_from_above(const std::vector<voxel>& voxels, coloring how);
  /// The scale of the view from above.
  [[nodiscard]] double pixels_per_metre() const;

 private:
  /// A pinhole camera that looks along `forward`; x right, y down.
  struct eye {
    orbis::vec3 position, right, down, forward;
    double focal;
    int width, height;

    /// Returns the pixel and the depth.
    [[nodiscard]] orbis::vec3 see(const orbis::vec3& p) const;
  };
  /// A camera at an azimuth and elevation (radians) from the points, at the smallest distance that shows them all.
  [[nodiscard]] static eye look_at(const std::vector<orbis::vec3>& points, double azimuth, double elevation,
                                   double field, int width, int height);
  [[nodiscard]] orbis::image<orbis::rgb8> draw(const std::vector<voxel>& voxels, coloring how, const eye& e);

  view_frame frame_;
  eye aslant_, from_above_;
  // The surface on which views are drawn; members so that their memory is reused.
  std::vector<orbis::rgb8> colors_;
  std::vector<float> inverse_depths_;
};

}  // namespace app
