// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs in the form of g2o's text format.
#pragma once

#include <cstdint>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// An edge: `measurement` is the pose of vertex `to` in the frame of vertex `from`; both are indices. The first three
/// rows of `information` refer to the translation, the others to the vector part of the quaternion.
struct g2o_edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  se3 measurement;
  mat6 information = identity<mat6>();
};

/// A graph of poses, in metres.
struct g2o_graph {
  std::vector<std::int64_t> ids;    ///< the vertices' ids in the file
  std::vector<se3> vertices;        ///< poses in the world frame, in the file's order
  std::vector<std::uint8_t> fixed;  ///< one per vertex: nonzero if the file marks it as fixed
  std::vector<g2o_edge> edges;      ///< in the file's order
};

}  // namespace orbis::io
