// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// OctoMap's files: `.bt` (free or occupied, 2 bits per child) and `.ot` (log-odds as float32).
///
/// What is written is byte for byte what OctoMap writes for the same map after pruning. Reading
/// takes memory in proportion to the bytes given, whatever they claim.
#pragma once

#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <istream>
#include <iterator>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/octree/occupancy_octree.hpp>

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

/// Nodes in `.bt` order: an inner node is two bits for each child.
struct bt_writer {
  std::string bytes;
  std::size_t nodes = 0;
  float threshold;
  int root_level;

  void leaf(const voxel_key& key, int level, float value) {
    ++nodes;
    if (level != root_level) return;
    // A root without children cannot be written: its children are.
    std::array<node_entry<float>, 8> children;
    children.fill({node_kind::leaf, value});
    nodes += children.size() - 1;
    inner(key, level, value, children);
  }
  void inner(const voxel_key&, int, float, const std::array<node_entry<float>, 8>& children) {
    ++nodes;
    unsigned bits = 0;
    for (unsigned i = 0; i != 8; ++i) {
      const node_entry<float>& c = children[i];
      const unsigned code = c.kind == node_kind::none    ? 0U
                            : c.kind == node_kind::inner ? 3U
                            : c.value >= threshold       ? 2U
                                                         : 1U;
      bits |= code << (2 * i);
    }
    bytes += static_cast<char>(bits & 0xffU);
    bytes += static_cast<char>(bits >> 8U);
  }
};

/// Nodes in `.ot` order: the value, and a bit for each child.
struct ot_writer {
  std::string bytes;
  std::size_t nodes = 0;

  void put(float value, unsigned children) {
    ++nodes;
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (unsigned shift = 0; shift != 32; shift += 8) bytes += static_cast<char>(bits >> shift & 0xffU);
    bytes += static_cast<char>(children);
  }
  void leaf(const voxel_key&, int, float value) { put(value, 0); }
  void inner(const voxel_key&, int, float value, const std::array<node_entry<float>, 8>& children) {
    unsigned bits = 0;
    for (unsigned i = 0; i != 8; ++i) bits |= static_cast<unsigned>(children[i].kind != node_kind::none) << i;
    put(value, bits);
  }
};

struct octomap_file {
  double resolution = 0.0;
  std::size_t nodes = 0;
  std::string_view data;
};

/// Takes the header apart. Comments, CRLF and keywords in any order are accepted.
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
      if (value != "OcTree")
        return fail(errc::unsupported, where, "holds a tree of type \"" + std::string{value.substr(0, 40)} + "\"");
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
      return fail(errc::malformed, where, "unknown word \"" + std::string{word.substr(0, 40)} + "\" in the header");
    }
  }
  if (!has_id || !has_size || file.resolution <= 0.0)
    return fail(errc::malformed, where, "the header lacks id, size or res");
  file.data = bytes;
  return file;
}

/// Reads the nodes behind the header, in preorder, into a map.
template <class Map>
struct node_reader {
  Map& map;
  std::string_view data;
  std::size_t nodes = 0;
  const char* problem = nullptr;

  [[nodiscard]] bool give_up(const char* why) {
    problem = why;
    return false;
  }
  [[nodiscard]] unsigned take() {
    const auto byte = static_cast<unsigned char>(data.front());
    data.remove_prefix(1);
    return byte;
  }
  [[nodiscard]] bool read_bt(const voxel_key& key, int depth) {
    ++nodes;
    if (data.size() < 2) return give_up("the data ends early");
    unsigned bits = take();
    bits |= take() << 8U;
    if (bits == 0) return give_up("an inner node without children");
    using model = typename Map::model;
    for (unsigned i = 0; i != 8; ++i, bits >>= 2U) {
      const voxel_key child = child_key(key, i, node_cells(default_tree_depth - depth - 1));
      const unsigned code = bits & 3U;
      if (code == 3) {
        if (depth + 1 == default_tree_depth) return give_up("nodes below the deepest level");
        if (!read_bt(child, depth + 1)) return false;
      } else if (code != 0) {
        ++nodes;
        map.set_unknown_node(child, depth + 1, code == 2 ? model::clamp_max : model::clamp_min);
      }
    }
    return true;
  }
  [[nodiscard]] bool read_ot(const voxel_key& key, int depth) {
    ++nodes;
    if (data.size() < 5) return give_up("the data ends early");
    std::uint32_t value = 0;
    for (unsigned shift = 0; shift != 32; shift += 8) value |= std::uint32_t{take()} << shift;
    const unsigned children = take();
    if (children == 0) {
      const auto log_odds = std::bit_cast<float>(value);
      if (!std::isfinite(log_odds)) return give_up("a value that is not finite");
      map.set_unknown_node(key, depth, log_odds);
      return true;
    }
    if (depth == default_tree_depth) return give_up("nodes below the deepest level");
    for (unsigned i = 0; i != 8; ++i)
      if ((children >> i & 1U) != 0 && !read_ot(child_key(key, i, node_cells(default_tree_depth - depth - 1)), depth + 1)) return false;
    return true;
  }
};

template <class Model, class Read>
[[nodiscard]] result<occupancy_octree<Model>> read_octomap(std::string_view bytes, std::string_view magic,
                                                           const std::string& where, Read&& read) {
  const auto file = parse_header(bytes, magic, where);
  if (!file) return fail(file.error());
  occupancy_octree<Model> map{file->resolution};
  node_reader<occupancy_octree<Model>> reader{map, file->data};
  if (file->nodes != 0 && !read(reader)) return fail(errc::malformed, where, reader.problem);
  if (reader.nodes != file->nodes)
    return fail(errc::malformed, where,
                "holds " + std::to_string(reader.nodes) + " nodes, but declares " + std::to_string(file->nodes));
  if (!reader.data.empty())
    return fail(errc::malformed, where, std::to_string(reader.data.size()) + " bytes behind the last node");
  return map;
}

[[nodiscard]] inline std::string_view as_chars(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline result<std::string> read_stream(std::istream& in) {
  std::string bytes{std::istreambuf_iterator<char>{in}, {}};
  if (in.bad()) return fail(errc::unreadable, "stream", "cannot be read");
  return bytes;
}
[[nodiscard]] inline result<void> write_bytes(const std::string& bytes, const std::filesystem::path& path) {
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}
[[nodiscard]] inline result<void> write_bytes(const std::string& bytes, std::ostream& out) {
  if (!out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return fail(errc::write_failed, "stream", "cannot be written");
  return {};
}

}  // namespace detail

/// A sensor model whose maps OctoMap's files can hold.
template <class M>
concept octomap_model = sensor_model<M> && std::same_as<typename M::value_type, float>;

/// The bytes of a `.bt` file: every voxel free or occupied, whichever is likelier; pruned.
template <octomap_model Model>
[[nodiscard]] std::string bt_bytes(const occupancy_octree<Model>& map) {
  detail::bt_writer writer{{}, 0, Model::occupancy_threshold, map.tree_depth()};
  map.visit_tree([](float v) { return is_occupied<Model>(v) ? Model::clamp_max : Model::clamp_min; }, writer);
  return detail::octomap_header(detail::bt_magic, writer.nodes, map.resolution()) + writer.bytes;
}
/// The bytes of an `.ot` file: the pruned octree with all its log-odds.
template <octomap_model Model>
[[nodiscard]] std::string ot_bytes(const occupancy_octree<Model>& map) {
  detail::ot_writer writer;
  map.visit_tree(writer);
  return detail::octomap_header(detail::ot_magic, writer.nodes, map.resolution()) + writer.bytes;
}

/// Writes a `.bt` file, whole or not at all. Errors: write_failed.
template <octomap_model Model>
[[nodiscard]] result<void> write_bt(const occupancy_octree<Model>& map, const std::filesystem::path& path) {
  return detail::write_bytes(bt_bytes(map), path);
}
template <octomap_model Model>
[[nodiscard]] result<void> write_bt(const occupancy_octree<Model>& map, std::ostream& out) {
  return detail::write_bytes(bt_bytes(map), out);
}
/// Writes an `.ot` file, whole or not at all. Errors: write_failed.
template <octomap_model Model>
[[nodiscard]] result<void> write_ot(const occupancy_octree<Model>& map, const std::filesystem::path& path) {
  return detail::write_bytes(ot_bytes(map), path);
}
template <octomap_model Model>
[[nodiscard]] result<void> write_ot(const occupancy_octree<Model>& map, std::ostream& out) {
  return detail::write_bytes(ot_bytes(map), out);
}

/// Reads the bytes of a `.bt` file; `where` names them in errors. Leaves get the model's bounds.
/// Errors: malformed (damaged, truncated, not such a file), unsupported (another type of tree).
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_bt(std::span<const std::byte> bytes,
                                                      const std::string& where = "bytes") {
  return detail::read_octomap<Model>(detail::as_chars(bytes), detail::bt_magic, where,
                                     [](auto& reader) { return reader.read_bt({}, 0); });
}
/// Reads the bytes of an `.ot` file. Inner values are not read: they follow from the leaves.
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_ot(std::span<const std::byte> bytes,
                                                      const std::string& where = "bytes") {
  return detail::read_octomap<Model>(detail::as_chars(bytes), detail::ot_magic, where,
                                     [](auto& reader) { return reader.read_ot({}, 0); });
}
/// Reads a file. Errors: not_found, unreadable, and those above.
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_bt(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return read_bt<Model>(std::as_bytes(std::span{*bytes}), path.string());
}
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_ot(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return read_ot<Model>(std::as_bytes(std::span{*bytes}), path.string());
}
/// Reads a stream to its end.
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_bt(std::istream& in) {
  const auto bytes = detail::read_stream(in);
  if (!bytes) return fail(bytes.error());
  return read_bt<Model>(std::as_bytes(std::span{*bytes}), "stream");
}
template <octomap_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_ot(std::istream& in) {
  const auto bytes = detail::read_stream(in);
  if (!bytes) return fail(bytes.error());
  return read_ot<Model>(std::as_bytes(std::span{*bytes}), "stream");
}

}  // namespace orbis::octree
