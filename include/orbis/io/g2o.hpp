// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs in g2o's text format: `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `EDGE_SE3:QUAT from to
/// x y z qx qy qz qw` followed by the upper triangle of the 6 x 6 information matrix, row by row, and
/// `FIX id ...`. Lengths are in metres; the rotational part of the information refers to the quaternion's vector part.
///
/// Source: R. Kuemmerle et al., "g2o: a general framework for graph optimization", ICRA 2011, and
/// https://github.com/RainerKuemmerle/g2o/wiki/File-Format.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/g2o_graph.hpp>

namespace orbis::io {

/// The graph in `text`; vertices and edges may be in any order. `where` names the source in errors; quaternions of any
/// positive norm are normalised. Text without lines gives an empty graph. Errors, with the line number: malformed;
/// unsupported (a vertex or edge type other than those for 3D poses).
ORBIS_LAZY [[nodiscard]] result<g2o_graph> parse_g2o(std::string_view text, const std::filesystem::path& where = {});

/// Reads a g2o file; see `parse_g2o`. Errors: not_found, unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<g2o_graph> read_g2o(const std::filesystem::path& path);

/// The graph as text, with enough digits to recover the same numbers.
/// @pre ids and fixed have one entry per vertex
ORBIS_LAZY [[nodiscard]] std::string format_g2o(const g2o_graph& graph);

/// Writes a g2o file atomically. Errors: write_failed.
ORBIS_LAZY result<void> write_g2o(const std::filesystem::path& path, const g2o_graph& graph);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/g2o-inl.hpp>
#endif
