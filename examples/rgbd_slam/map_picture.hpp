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

/// A view from above, and its scale in pixels per metre.
struct view_from_above {
  orbis::image<orbis::rgb8> picture;
  double pixels_per_metre;
};

/// Draws views of maps. Voxels above `frame.cut` are omitted. Each view is fitted to `in_view`, so that pictures of
/// several maps of the same size show the same view.
class map_painter {
 public:
  map_painter(const std::vector<voxel>& in_view, const view_frame& frame);

  /// Draws an oblique perspective view.
  [[nodiscard]] orbis::image<orbis::rgb8> draw_aslant(const std::vector<voxel>& voxels, coloring how, int width,
                                                      int height);
  /// Draws a view from above; the frame's y axis points up in the picture.
  [[nodiscard]] view_from_above draw_from_above(const std::vector<voxel>& voxels, coloring how, int width, int height);

 private:
  view_frame frame_;
  std::vector<orbis::vec3> in_view_;
  // The surface on which views are drawn; a member so that its memory is reused.
  std::vector<orbis::rgb8> colors_;
  std::vector<float> inverse_depths_;
};

}  // namespace app
