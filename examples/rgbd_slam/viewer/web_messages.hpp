// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Messages to the page in the browser. Numbers are little-endian, as in typed arrays on all machines with a browser.
#pragma once

#include <cstdint>
#include <string>

#include "viewer/scene.hpp"

namespace app {

/// The scene's numbers, names and revisions as JSON. `session`: identifies the server to which the revisions belong.
[[nodiscard]] std::string state_json(const viewer_scene& scene, std::uint64_t session);

/// The message for a frame: u32 length of the JSON, the JSON, u32 number of features, for each u16 x, y (eighths of a
/// pixel) and u16 tracked, then the image as JPEG. Features and image are omitted if `frame` is null.
[[nodiscard]] std::string frame_message(const std::string& json, const shown_frame* frame);

/// The message for a graph: u32 number of keyframes, for each the 3 x 4 matrix T_world_camera (12 f32, row by row); u32
/// number of edges, for each u32 a, b, kind (0 covisible, 1 tree, 2 loop); u32 number of points on the path, for each
/// f32 x, y, z, u32 1 if it is not connected to the previous point, else 0.
[[nodiscard]] std::string graph_message(const shown_graph& graph);

/// The header of the message for voxels: f32 resolution, floor, ceiling (metres), u32 revision, u32 number of blocks,
/// then the blocks.
[[nodiscard]] std::string voxel_header(const shown_voxels& voxels, std::size_t blocks);
/// A block in the message for voxels: i32 x, y, z (in blocks), u32 number of cubes, for each u8 x, y, z, level, r, g,
/// b, 0.
[[nodiscard]] std::string block_message(const block_index& index, const voxel_block& block);

}  // namespace app
