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

/// From above and aside, in perspective. What lies above `frame.cut` is left away.
[[nodiscard]] orbis::image<orbis::rgb8> draw_aslant(const std::vector<voxel>& voxels, const view_frame& frame,
                                                    coloring how, int width, int height);
/// From straight above, north up.
[[nodiscard]] orbis::image<orbis::rgb8> draw_from_above(const std::vector<voxel>& voxels, const view_frame& frame,
                                                        coloring how, int width, int height);

}  // namespace app
