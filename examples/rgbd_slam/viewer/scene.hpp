// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The contents of the viewer as plain data, built by `scene_builder` and drawn by a `viewer_backend`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace app {

/// The corners of the camera's frustum: rays through the corners of the image at z = 1, in the camera frame, clockwise
/// from the top left.
using frustum_rays = std::array<orbis::vec3f, 4>;

struct shown_feature {
  float x = 0.0F, y = 0.0F;  ///< pixels
  bool tracked = false;      ///< true if the feature observes a known landmark
};

/// The newest frame.
struct shown_frame {
  std::uint64_t number = 0;  ///< index of the frame in the recording
  std::string state;         ///< tracking state
  std::optional<orbis::se3> T_world_camera;
  std::shared_ptr<const orbis::image<orbis::rgb8>> image;  ///< never null
  std::vector<shown_feature> features;                     ///< empty if the frame was not tracked
};

enum class edge_kind : std::uint8_t { covisible, tree, loop };

/// An edge between two keyframes.
struct shown_edge {
  std::uint32_t a = 0, b = 0;
  edge_kind kind = edge_kind::covisible;
};

struct trail_point {
  orbis::vec3f position;
  bool begins = false;  ///< not connected to the previous point, because tracking was lost between them
};

/// The current keyframe poses and the path of the camera.
struct shown_graph {
  std::uint64_t revision = 0;  ///< increases with every change
  std::vector<orbis::se3> keyframes;
  std::vector<shown_edge> edges;
  std::vector<trail_point> trail;
};

/// An occupied cube with an edge of 2^level voxels, given by the coordinates of its lowest voxel in its block.
struct shown_voxel {
  std::uint8_t x = 0, y = 0, z = 0, level = 0;
  orbis::rgb8 color{};
  friend bool operator==(const shown_voxel&, const shown_voxel&) = default;
};

/// The index of a block of 32^3 voxels; the world's origin is the corner of block (0, 0, 0).
using block_index = std::array<std::int32_t, 3>;
inline constexpr int block_voxels = 32;

struct voxel_block {
  std::uint64_t revision = 0;  ///< revision of `shown_voxels` at the last change
  std::vector<shown_voxel> voxels;
};

/// The occupied voxels in blocks, so that unchanged blocks are not sent again. Blocks that became empty remain in the
/// list.
struct shown_voxels {
  std::uint64_t revision = 0;  ///< increases with every change
  double resolution = 0.0;     ///< metres
  std::size_t count = 0;       ///< number of cubes
  float floor = 0.0F;          ///< lower and upper limits of the height of nearly all cubes, metres
  float ceiling = 0.0F;
  std::map<block_index, voxel_block> blocks;
  std::string absent;  ///< the reason why there are no voxels; empty otherwise
};

struct shown_numbers {
  std::size_t frames = 0;  ///< number of frames in the recording
  double tracking_ms = 0.0, tracking_p95_ms = 0.0;
  std::size_t insertions = 0;
  double insert_ms = 0.0, insert_p95_ms = 0.0;  ///< time taken to insert a keyframe into the octree
  std::size_t behind_frames = 0;                ///< maximum number of frames tracked between creation and insertion
  std::size_t corrections = 0;
  double correction_ms = 0.0;  ///< time taken by the last correction
};

struct viewer_scene {
  std::string title;
  frustum_rays camera{};
  std::optional<shown_frame> frame;
  shown_graph graph;
  shown_voxels voxels;
  shown_numbers numbers;
  bool is_over = false;  ///< no more frames follow
};

}  // namespace app
