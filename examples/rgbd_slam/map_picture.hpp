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

/// Draws an oblique perspective view. Voxels above `frame.cut` are omitted. The view is fitted to `in_view`, so that
/// pictures with the same `in_view` have the same view.
[[nodiscard]] orbis::image<orbis::rgb8> draw_aslant(const std::vector<voxel>& voxels, const std::vector<voxel>& in_view,
                                                    const view_frame& frame, coloring how, int width, int height);

/// A view from above, and its scale in pixels per metre.
struct view_from_above {
  orbis::image<orbis::rgb8> picture;
  double pixels_per_metre;
};
/// Draws a view from above; the frame's y axis points up in the picture. Otherwise like `draw_aslant`.
[[nodiscard]] view_from_above draw_from_above(const std::vector<voxel>& voxels, const std::vector<voxel>& in_view,
                                              const view_frame& frame, coloring how, int width, int height);

}  // namespace app
