// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Parser of g2o's text format.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/g2o_graph.hpp>

namespace orbis::io::detail {

/// Reads the file line by line; edges refer to vertices by id until all vertices are known.
class g2o_parser {
 public:
  explicit g2o_parser(const std::filesystem::path& where) : where_{where} {}

  [[nodiscard]] result<g2o_graph> parse(std::string_view text) {
    for_each_line(text, [&](std::string_view line, std::size_t number) {
      number_ = number;
      return read_line(line);
    });
    if (problem_.empty()) resolve();
    if (!problem_.empty()) return fail(code_, at_line(where_, number_), std::move(problem_));
    return std::move(graph_);
  }

 private:
  struct named_edge {
    std::int64_t from, to;
    std::size_t line;
  };

  bool reject(std::string why, errc code = errc::malformed) {
    problem_ = std::move(why);
    code_ = code;
    return false;
  }

  bool read_line(std::string_view line) {
    const std::string_view tag = next_field(line);
    if (tag == "VERTEX_SE3:QUAT") return read_vertex(line);
    if (tag == "EDGE_SE3:QUAT") return read_edge(line);
    if (tag == "FIX") return read_fix(line);
    if (tag.starts_with("PARAMS_")) return true;  // sensor parameters, which the supported edges do not use
    return reject(in_quotes(tag) + " is not one of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX", errc::unsupported);
  }

  bool read_vertex(std::string_view line) {
    std::int64_t id = 0;
    se3 pose;
    if (!read_id(line, id) || !read_pose(line, pose) || !ends(line)) return false;
    if (!index_.emplace(id, static_cast<std::uint32_t>(graph_.ids.size())).second)
      return reject("vertex " + std::to_string(id) + " is defined twice");
    graph_.ids.push_back(id);
    graph_.vertices.push_back(pose);
    return true;
  }

  bool read_edge(std::string_view line) {
    named_edge named{0, 0, number_};
    g2o_edge edge;
    if (!read_id(line, named.from) || !read_id(line, named.to) || !read_pose(line, edge.measurement)) return false;
    for (int row = 0; row != 6; ++row)
      for (int column = row; column != 6; ++column) {
        if (!read_number(line, edge.information(row, column),
                         "an edge must have 21 numbers for its information matrix"))
          return false;
        edge.information(column, row) = edge.information(row, column);
      }
    if (!ends(line)) return false;
    graph_.edges.push_back(edge);
    named_.push_back(named);
    return true;
  }

  bool read_fix(std::string_view line) {
    do {
      std::int64_t id = 0;
      if (!read_id(line, id)) return false;
      fixed_.push_back({id, id, number_});
    } while (!trimmed(line).empty());
    return true;
  }

  bool read_id(std::string_view& line, std::int64_t& id) {
    const std::string_view field = next_field(line);
    if (field.empty()) return reject("the id of a vertex is missing");
    return parse_number(field, id) || reject(in_quotes(field) + " is not the id of a vertex");
  }
  bool read_number(std::string_view& line, double& value, const char* expected) {
    const std::string_view field = next_field(line);
    if (field.empty()) return reject(std::string{"the line ends early: "} + expected);
    if (!parse_number(field, value)) return reject(in_quotes(field) + " is not a number");
    return std::isfinite(value) || reject(in_quotes(field) + " is not a finite number");
  }
  bool read_pose(std::string_view& line, se3& pose) {
    double v[7];
    for (double& value : v)
      if (!read_number(line, value, "a pose must have 7 numbers: x y z qx qy qz qw")) return false;
    const so3::quaternion q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-6) || !std::isfinite(q.norm())) return reject("the quaternion is zero or too large");
    pose = se3(so3(q), vec3(v[0], v[1], v[2]));
    return true;
  }
  bool ends(std::string_view line) {
    const std::string_view rest = next_field(line);
    return rest.empty() || reject("the line continues after its last number: " + in_quotes(rest));
  }

  void resolve() {
    graph_.fixed.assign(graph_.ids.size(), 0);
    const auto find = [&](std::int64_t id, std::size_t line, std::uint32_t& index) {
      const auto at = index_.find(id);
      if (at == index_.end()) {
        number_ = line;
        return reject("vertex " + std::to_string(id) + " is not defined in the file");
      }
      index = at->second;
      return true;
    };
    for (std::size_t k = 0; k != named_.size(); ++k)
      if (!find(named_[k].from, named_[k].line, graph_.edges[k].from) ||
          !find(named_[k].to, named_[k].line, graph_.edges[k].to))
        return;
    for (const named_edge& f : fixed_) {
      std::uint32_t index = 0;
      if (!find(f.from, f.line, index)) return;
      graph_.fixed[index] = 1;
    }
  }

  const std::filesystem::path& where_;
  g2o_graph graph_;
  std::unordered_map<std::int64_t, std::uint32_t> index_;
  std::vector<named_edge> named_, fixed_;
  std::size_t number_ = 0;
  std::string problem_;
  errc code_ = errc::malformed;
};

}  // namespace orbis::io::detail
