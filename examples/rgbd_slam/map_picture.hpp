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

/// From above and aside, in perspective. What lies above `frame.cut` is left away. The picture is as large
/// as to hold `in_view`: where that is the same, so is the view.
[[nodiscard]] orbis::image<orbis::rgb8> draw_aslant(const std::vector<voxel>& voxels, const std::vector<voxel>& in_view,
                                                    const view_frame& frame, coloring how, int width, int height);
/// From straight above, the frame's y axis up.
[[nodiscard]] orbis::image<orbis::rgb8> draw_from_above(const std::vector<voxel>& voxels,
                                                        const std::vector<voxel>& in_view, const view_frame& frame,
                                                        coloring how, int width, int height);

}  // namespace app
