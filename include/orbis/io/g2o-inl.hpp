// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of g2o.hpp.
#pragma once

#include <charconv>
#include <cstddef>
#include <ostream>
#include <system_error>

#include <orbis/core/file.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/files/g2o_parser.hpp>
#include <orbis/io/g2o.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE result<g2o_graph> parse_g2o(std::string_view text, const std::filesystem::path& where) {
  return detail::g2o_parser{where}.parse(text);
}

ORBIS_LAZY_INLINE result<g2o_graph> read_g2o(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_g2o(*text, path);
}

ORBIS_LAZY_INLINE std::string format_g2o(const g2o_graph& graph) {
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

ORBIS_LAZY_INLINE result<void> write_g2o(const std::filesystem::path& path, const g2o_graph& graph) {
  const std::string text = format_g2o(graph);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io
