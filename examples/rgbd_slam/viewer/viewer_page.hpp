// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Texts that the viewer is made of; CMake makes them of page.html and of the files in shaders/.
#pragma once

namespace app {

extern const char* const viewer_page;  ///< HTML with all that it needs
/// GLSL without its first lines, which are not the same in a window and in a browser.
extern const char *const voxel_vertex_shader, *const voxel_fragment_shader, *const line_vertex_shader,
                                                                                *const line_fragment_shader;

}  // namespace app
