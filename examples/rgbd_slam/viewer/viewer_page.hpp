// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The page and the shaders of the viewer, which CMake generates from page.html and the files in shaders/.
#pragma once

namespace app {

extern const char* const viewer_page;  ///< self-contained HTML
/// GLSL sources without the first lines, which differ between window and browser.
extern const char *const voxel_vertex_shader, *const voxel_fragment_shader, *const line_vertex_shader,
                                                                                *const line_fragment_shader;

}  // namespace app
