// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs as g2o's text format has them.
#pragma once

#include <cstdint>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// `measurement` is the pose of vertex `to` in the frame of vertex `from`; both are indices. `information` is that of
/// the translation, then of the vector part of the quaternion.
struct g2o_edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  se3 measurement;
  mat6 information = identity<mat6>();
};

/// A graph of poses, in metres.
struct g2o_graph {
  std::vector<std::int64_t> ids;    ///< of the vertices, as the file names them
  std::vector<se3> vertices;        ///< poses in the world, in the file's order
  std::vector<std::uint8_t> fixed;  ///< one for each vertex: whether the file fixes it
  std::vector<g2o_edge> edges;      ///< in the file's order
};

}  // namespace orbis::io
