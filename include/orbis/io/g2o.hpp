// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs in g2o's text format: `VERTEX_SE3:QUAT id x y z qx qy qz qw`, `EDGE_SE3:QUAT from to
/// x y z qx qy qz qw` followed by the upper triangle of the 6 x 6 information matrix, row by row, and
/// `FIX id ...`. Metres; the rotational part of the information is about the quaternion's vector part.
///
/// Source: R. Kuemmerle et al., "g2o: a general framework for graph optimization", ICRA 2011, and
/// https://github.com/RainerKuemmerle/g2o/wiki/File-Format.
#pragma once

#include <charconv>
#include <cstddef>
#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>
#include <system_error>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/files/g2o_parser.hpp>
#include <orbis/io/g2o_graph.hpp>

namespace orbis::io {

/// The graph in `text`; vertices and edges may come in any order. `where` names the source in errors;
/// quaternions of any positive norm are normalised. Text without lines gives an empty graph.
/// Errors, with the line: malformed; unsupported (a kind of vertex or edge that is not in three
/// dimensions with poses alone).
[[nodiscard]] inline result<g2o_graph> parse_g2o(std::string_view text, const std::filesystem::path& where = {}) {
  return detail::g2o_parser{where}.parse(text);
}

/// Reads a g2o file; see `parse_g2o`. Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<g2o_graph> read_g2o(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_g2o(*text, path);
}

/// The graph as text, with as many digits as it takes to read the same numbers back.
/// @pre ids and fixed have one entry for each vertex
[[nodiscard]] inline std::string format_g2o(const g2o_graph& graph) {
  std::string text;
  const auto add = [&](auto value) {
    char buffer[32];
    const auto [end, failure] = std::to_chars(buffer, buffer + sizeof buffer, value);
    text += ' ';
    if (failure == std::errc{}) text.append(buffer, end);
  };
  const auto add_pose = [&](const se3& pose) {
    const auto& q = pose.rotation().unit_quaternion();
    for (int i = 0; i != 3; ++i) add(pose.translation()[i]);
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) add(value);
  };
  for (std::size_t i = 0; i != graph.vertices.size(); ++i) {
    text += "VERTEX_SE3:QUAT";
    add(graph.ids[i]);
    add_pose(graph.vertices[i]);
    text += '\n';
    if (graph.fixed[i] == 0) continue;
    text += "FIX";
    add(graph.ids[i]);
    text += '\n';
  }
  for (const g2o_edge& edge : graph.edges) {
    text += "EDGE_SE3:QUAT";
    add(graph.ids[edge.from]);
    add(graph.ids[edge.to]);
    add_pose(edge.measurement);
    for (int row = 0; row != 6; ++row)
      for (int column = row; column != 6; ++column) add(edge.information(row, column));
    text += '\n';
  }
  return text;
}

/// Writes a g2o file, whole or not at all. Errors: write_failed.
inline result<void> write_g2o(const std::filesystem::path& path, const g2o_graph& graph) {
  const std::string text = format_g2o(graph);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io
