// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of files.hpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>

#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/octree/detail/files/octomap_readers.hpp>
#include <orbis/octree/detail/files/octomap_writers.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>

namespace orbis::octree {

namespace detail {

inline constexpr std::string_view bt_magic = "# Octomap OcTree binary file";
inline constexpr std::string_view ot_magic = "# Octomap OcTree file";

[[nodiscard]] inline std::string octomap_header(std::string_view magic, std::size_t nodes, double resolution) {
  char number[32];
  const auto printed = std::to_chars(std::begin(number), std::end(number), resolution, std::chars_format::general, 6);
  std::string header{magic};
  header += "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\nsize ";
  header += std::to_string(nodes);
  header += "\nres ";
  header.append(number, printed.ptr);
  header += "\ndata\n";
  return header;
}

struct octomap_file {
  double resolution = 0.0;
  std::size_t nodes = 0;
  std::string_view data;
};

/// Parses the header. Accepts comments, CRLF and keywords in any order.
[[nodiscard]] inline result<octomap_file> parse_header(std::string_view bytes, std::string_view magic,
                                                       const std::string& where) {
  const auto next_line = [&]() -> std::optional<std::string_view> {
    const auto end = bytes.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(end + 1);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    return line;
  };
  const auto first = next_line();
  if (!first || first->substr(0, magic.size()) != magic)
    return fail(errc::malformed, where, "does not start with \"" + std::string{magic} + "\"");

  octomap_file file;
  bool has_id = false, has_size = false;
  for (;;) {
    const auto line = next_line();
    if (!line) return fail(errc::malformed, where, "the header ends before \"data\"");
    if (line->empty() || line->front() == '#') continue;
    const auto gap = std::min(line->find(' '), line->size());
    const std::string_view word = line->substr(0, gap);
    std::string_view value = line->substr(gap);
    while (!value.empty() && value.front() == ' ') value.remove_prefix(1);
    const char* const end = value.data() + value.size();
    if (word == "data") break;
    if (word == "id") {
      if (value != "OcTree") return fail(errc::unsupported, where, "contains a tree of type " + in_quotes(value));
      has_id = true;
    } else if (word == "size") {
      const auto parsed = std::from_chars(value.data(), end, file.nodes);
      if (parsed.ec != std::errc{} || parsed.ptr != end) return fail(errc::malformed, where, "size is not a number");
      has_size = true;
    } else if (word == "res") {
      const auto parsed = std::from_chars(value.data(), end, file.resolution);
      if (parsed.ec != std::errc{} || parsed.ptr != end || !std::isfinite(file.resolution) || file.resolution <= 0.0)
        return fail(errc::malformed, where, "the resolution is not a positive number");
    } else {
      return fail(errc::malformed, where, "unknown keyword " + in_quotes(word) + " in the header");
    }
  }
  if (!has_id || !has_size || file.resolution <= 0.0)
    return fail(errc::malformed, where, "the header lacks id, size or res");
  file.data = bytes;
  return file;
}

/// Reads a file whose nodes `Reader` can parse.
template <class Model, class Reader>
[[nodiscard]] result<occupancy_octree<Model>> read_octomap(std::string_view bytes, std::string_view magic,
                                                           const std::string& where) {
  const auto file = parse_header(bytes, magic, where);
  if (!file) return fail(file.error());
  brick_store<float> store;
  Reader reader{{store, std::as_bytes(std::span{file->data})}};
  if (file->nodes != 0 && !reader.read({}, default_tree_depth)) return fail(errc::malformed, where, reader.problem);
  if (reader.nodes != file->nodes)
    return fail(errc::malformed, where,
                "contains " + std::to_string(reader.nodes) + " nodes, but declares " + std::to_string(file->nodes));
  if (!reader.left.empty())
    return fail(errc::malformed, where, "has " + std::to_string(reader.left.size()) + " bytes after the last node");
  return occupancy_octree<Model>{file->resolution, default_tree_depth, std::move(store)};
}

[[nodiscard]] inline std::string_view as_chars(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline std::string whole_file(std::string_view magic, const octomap_nodes& nodes,
                                            const voxel_grid& grid) {
  assert(grid.depth() == default_tree_depth);
  std::string bytes = octomap_header(magic, nodes.nodes, grid.resolution());
  bytes.reserve(bytes.size() + nodes.bytes.size());
  return bytes.append(nodes.bytes.view());
}
template <class Writer, class Map>
[[nodiscard]] result<void> write_octomap(const Map& map, std::string_view magic, const std::filesystem::path& path) {
  if (map.tree_depth() != default_tree_depth)
    return fail(errc::unsupported, path.string(),
                "the tree has " + std::to_string(map.tree_depth()) + " levels, but OctoMap's files need 16");
  return write_file_atomically(path, [&](std::ostream& out) {
    const octomap_nodes nodes = Writer{map.store(), map.tree_depth()}.write();
    const std::string header = octomap_header(magic, nodes.nodes, map.resolution());
    out.write(header.data(), static_cast<std::streamsize>(header.size()));
    out.write(nodes.bytes.view().data(), static_cast<std::streamsize>(nodes.bytes.size()));
  });
}

}  // namespace detail

template <octomap_model Model>
std::string bt_bytes(const occupancy_octree<Model>& map) {
  const detail::octomap_nodes nodes = detail::bt_writer<Model>{map.store(), map.tree_depth()}.write();
  return detail::whole_file(detail::bt_magic, nodes, map.grid());
}

template <octomap_model Model>
std::string ot_bytes(const occupancy_octree<Model>& map) {
  const detail::octomap_nodes nodes = detail::ot_writer{map.store(), map.tree_depth()}.write();
  return detail::whole_file(detail::ot_magic, nodes, map.grid());
}

template <octomap_model Model>
result<void> write_bt(const occupancy_octree<Model>& map, const std::filesystem::path& path) {
  return detail::write_octomap<detail::bt_writer<Model>>(map, detail::bt_magic, path);
}

template <octomap_model Model>
result<void> write_ot(const occupancy_octree<Model>& map, const std::filesystem::path& path) {
  return detail::write_octomap<detail::ot_writer>(map, detail::ot_magic, path);
}

template <octomap_model Model>
result<occupancy_octree<Model>> read_bt(std::span<const std::byte> bytes, const std::string& where) {
  return detail::read_octomap<Model, detail::bt_reader<Model>>(detail::as_chars(bytes), detail::bt_magic, where);
}

template <octomap_model Model>
result<occupancy_octree<Model>> read_ot(std::span<const std::byte> bytes, const std::string& where) {
  return detail::read_octomap<Model, detail::ot_reader>(detail::as_chars(bytes), detail::ot_magic, where);
}

template <octomap_model Model>
result<occupancy_octree<Model>> read_bt(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return read_bt<Model>(std::as_bytes(std::span{*bytes}), path.string());
}

template <octomap_model Model>
result<occupancy_octree<Model>> read_ot(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return read_ot<Model>(std::as_bytes(std::span{*bytes}), path.string());
}

}  // namespace orbis::octree
