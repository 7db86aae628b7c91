// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The library's own file format, `.orbis`: the values of any sensor model bit for bit, or only which voxels are free
/// and which occupied, in a third of the bytes of `.bt`. Files are little-endian and checksummed; the same map gives
/// the same bytes on every machine.
///
/// A file is 8 bytes of magic, a version (u32), and sections: a tag of four letters, a length (u64),
/// that many bytes, and the CRC-32C of all that (u32). Sections whose tag is not known are passed over.
///
///     "head"  resolution (f64), tree depth (u8), value type (u8), whether free and occupied is all
///             (u8), state of the root (u8), scale, hit, miss, lower bound, upper bound, threshold of
///             occupancy (f64 each), number of inner nodes (u64)
///     "vals"  numbers of distinct values of free and of occupied leaves (u32 each), the values
///     "tree"  the nodes: see tree_coder, rank_coder
///     "pad "  zeros
///     "end "  nothing
///
/// A map that codes so well that a file would hold more than four inner nodes for each byte is padded
/// to that: so a reader can refuse whatever claims more, and takes at most 4 KB for each byte given
/// and 512 KB.
#pragma once

#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/octree/detail/files/compact_tree.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::octree {

/// How values are stored.
enum class compact_value : std::uint8_t { float32 = 1, float64 = 2, int8 = 3, int16 = 4, int32 = 5 };

/// A sensor model whose maps these files can hold: values of 64 bits only if floating-point.
template <class M>
concept compact_model = sensor_model<M> && sizeof(typename M::value_type) <= 8 &&
                        (std::floating_point<typename M::value_type> || sizeof(typename M::value_type) <= 4);

struct compact_options {
  /// Keep only which voxels are free and which occupied, as `.bt` does. Reading gives them the model's
  /// bounds.
  bool occupancy_only = false;
};

/// The header of a file.
struct compact_info {
  double resolution = 0;  ///< metres
  int tree_depth = 0;
  compact_value value{};
  bool occupancy_only = false;
  /// Of the sensor model, in its units; `scale`: of these for 1.0 of log-odds.
  double scale = 1, hit = 0, miss = 0, clamp_min = 0, clamp_max = 0, occupancy_threshold = 0;
  std::size_t inner_nodes = 0;
};

namespace detail {

inline constexpr std::string_view compact_magic = "\x89orbis\r\n";
inline constexpr std::uint32_t compact_version = 1;
inline constexpr std::size_t inner_nodes_per_byte = 4;

template <class T>
inline constexpr compact_value compact_value_of = std::floating_point<T> ? (sizeof(T) == 4 ? compact_value::float32
                                                                                           : compact_value::float64)
                                                  : sizeof(T) == 1       ? compact_value::int8
                                                  : sizeof(T) == 2       ? compact_value::int16
                                                                         : compact_value::int32;

/// Appends a number's bytes, the lowest first.
template <class T>
void put(std::string& out, T number) {
  const auto bits = std::bit_cast<value_bits<T>>(number);
  for (std::size_t i = 0; i != sizeof(T); ++i)
    out += static_cast<char>(static_cast<std::uint64_t>(bits) >> (8 * i) & 0xffU);
}
/// Takes a number off the front. @pre in.size() >= sizeof(T)
template <class T>
[[nodiscard]] T take(std::string_view& in) noexcept {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i != sizeof(T); ++i) bits |= std::uint64_t{static_cast<unsigned char>(in[i])} << (8 * i);
  in.remove_prefix(sizeof(T));
  return std::bit_cast<T>(static_cast<value_bits<T>>(bits));
}

inline void put_section(std::string& out, std::string_view tag, std::string_view content) {
  const std::size_t begin = out.size();
  out += tag;
  put(out, std::uint64_t{content.size()});
  out += content;
  put(out, crc32c(std::as_bytes(std::span{out}).subspan(begin)));
}

/// The sections we know, empty where there are none.
struct compact_sections {
  std::optional<std::string_view> head, values, tree;
};

[[nodiscard]] inline result<compact_sections> take_apart(std::string_view bytes, const std::string& where) {
  constexpr std::size_t frame = 4 + 8 + 4;
  if (bytes.substr(0, compact_magic.size()) != compact_magic)
    return fail(errc::malformed, where, "is not a compact map file");
  bytes.remove_prefix(compact_magic.size());
  if (bytes.size() < 4) return fail(errc::malformed, where, "ends before its version");
  if (const auto version = take<std::uint32_t>(bytes); version != compact_version)
    return fail(errc::unsupported, where,
                "is of version " + std::to_string(version) + ", not " + std::to_string(compact_version));
  compact_sections sections;
  for (;;) {
    if (bytes.size() < frame) return fail(errc::malformed, where, "ends within its sections");
    std::string_view rest = bytes.substr(4);
    const auto length = take<std::uint64_t>(rest);
    if (length > bytes.size() - frame) return fail(errc::malformed, where, "a section is longer than the file");
    const std::string_view section = bytes.substr(0, static_cast<std::size_t>(length) + frame - 4);
    std::string_view sum = bytes.substr(section.size(), 4);
    if (take<std::uint32_t>(sum) != crc32c(std::as_bytes(std::span{section})))
      return fail(errc::malformed, where, "a checksum does not match");
    bytes.remove_prefix(section.size() + 4);
    const std::string_view tag = section.substr(0, 4);
    if (tag == "end ") break;
    const auto keep = [&](std::optional<std::string_view>& known) {
      const bool is_first = !known;
      known = section.substr(frame - 4);
      return is_first;
    };
    if ((tag == "head" && !keep(sections.head)) || (tag == "vals" && !keep(sections.values)) ||
        (tag == "tree" && !keep(sections.tree)))
      return fail(errc::malformed, where, "a section comes twice");
  }
  if (!bytes.empty())
    return fail(errc::malformed, where, std::to_string(bytes.size()) + " bytes behind the last section");
  return sections;
}

struct compact_head {
  compact_info info;
  coded_state root{};
};

[[nodiscard]] inline result<compact_head> read_head(const compact_sections& sections, std::size_t file_size,
                                                    const std::string& where) {
  if (!sections.head || sections.head->size() != 68)
    return fail(errc::malformed, where, "has no head that makes sense");
  std::string_view in = *sections.head;
  compact_head head;
  compact_info& info = head.info;
  info.resolution = take<double>(in);
  info.tree_depth = take<std::uint8_t>(in);
  info.value = static_cast<compact_value>(take<std::uint8_t>(in));
  const auto occupancy_only = take<std::uint8_t>(in);
  const auto root = take<std::uint8_t>(in);
  for (double* const constant :
       {&info.scale, &info.hit, &info.miss, &info.clamp_min, &info.clamp_max, &info.occupancy_threshold})
    *constant = take<double>(in);
  const auto nodes = take<std::uint64_t>(in);
  if (!std::isfinite(info.resolution) || info.resolution <= 0.0)
    return fail(errc::malformed, where, "the resolution is not a positive number");
  if (info.tree_depth <= chunk_level - 1 || info.tree_depth > max_tree_depth)
    return fail(errc::unsupported, where, "has " + std::to_string(info.tree_depth) + " levels");
  if (info.value < compact_value::float32 || info.value > compact_value::int32)
    return fail(errc::unsupported, where, "has values of an unknown type");
  if (occupancy_only > 1 || root > 3) return fail(errc::malformed, where, "the head contradicts itself");
  head.root = static_cast<coded_state>(root);
  info.occupancy_only = occupancy_only != 0;
  if ((head.root == coded_state::inner) != (nodes != 0))
    return fail(errc::malformed, where, "the head contradicts itself");
  if (nodes > inner_nodes_per_byte * file_size)
    return fail(errc::malformed, where, "declares more nodes than a file of its size has");
  info.inner_nodes = static_cast<std::size_t>(nodes);
  return head;
}

template <class T>
[[nodiscard]] result<value_lists<T>> read_values(const compact_sections& sections, const std::string& where) {
  if (!sections.values || sections.values->size() < 8) return fail(errc::malformed, where, "has no list of values");
  std::string_view in = *sections.values;
  const std::uint64_t free = take<std::uint32_t>(in), occupied = take<std::uint32_t>(in);
  if (in.size() != (free + occupied) * sizeof(T))
    return fail(errc::malformed, where, "has another number of values than declared");
  value_lists<T> lists;
  for (const auto& [list, count] : {std::pair{&lists[0], free}, std::pair{&lists[1], occupied}}) {
    list->resize(static_cast<std::size_t>(count));
    for (T& value : *list) {
      value = take<T>(in);
      if constexpr (std::floating_point<T>)
        if (!std::isfinite(value)) return fail(errc::malformed, where, "a value that is not finite");
      if (value == T{}) value = T{};  // -0 is 0
    }
  }
  return lists;
}

}  // namespace detail

/// The bytes of a file. O(known voxels).
template <compact_model Model>
[[nodiscard]] std::string compact_bytes(const occupancy_octree<Model>& map, const compact_options& options = {}) {
  using T = typename Model::value_type;
  const detail::tree_lists<Model> lists{map.store(), map.tree_depth(), options.occupancy_only};
  detail::value_lists<T> values;
  std::vector<std::uint32_t> rank;
  if (!options.occupancy_only)
    std::tie(values, rank) = lists.values().ranked([](T v) { return is_occupied<Model>(v) ? 1U : 0U; });

  std::string head, list;
  detail::put(head, map.resolution());
  detail::put(head, static_cast<std::uint8_t>(map.tree_depth()));
  detail::put(head, static_cast<std::uint8_t>(detail::compact_value_of<T>));
  detail::put(head, static_cast<std::uint8_t>(options.occupancy_only));
  detail::put(head, static_cast<std::uint8_t>(lists.root()));
  detail::put(head, static_cast<double>(units_per_log_odds<Model>));
  for (const T constant : {Model::hit, Model::miss, Model::clamp_min, Model::clamp_max, Model::occupancy_threshold})
    detail::put(head, static_cast<double>(constant));
  detail::put(head, std::uint64_t{lists.inner_nodes()});
  detail::put(list, static_cast<std::uint32_t>(values[0].size()));
  detail::put(list, static_cast<std::uint32_t>(values[1].size()));
  for (const auto& kind : values)
    for (const T value : kind) detail::put(list, value);

  std::string bytes{detail::compact_magic};
  detail::put(bytes, detail::compact_version);
  detail::put_section(bytes, "head", head);
  if (!options.occupancy_only) detail::put_section(bytes, "vals", list);
  detail::put_section(bytes, "tree", detail::encode_tree(lists, map.tree_depth(), rank, values));
  if (const std::size_t least = lists.inner_nodes() / detail::inner_nodes_per_byte; bytes.size() < least)
    detail::put_section(bytes, "pad ", std::string(least - bytes.size(), '\0'));
  detail::put_section(bytes, "end ", {});
  return bytes;
}

/// Writes a file, whole or not at all. Errors: write_failed.
template <compact_model Model>
[[nodiscard]] result<void> write_compact(const occupancy_octree<Model>& map, const std::filesystem::path& path,
                                         const compact_options& options = {}) {
  const std::string bytes = compact_bytes(map, options);
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}
template <compact_model Model>
[[nodiscard]] result<void> write_compact(const occupancy_octree<Model>& map, std::ostream& out,
                                         const compact_options& options = {}) {
  const std::string bytes = compact_bytes(map, options);
  if (!out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return fail(errc::write_failed, "stream", "cannot be written");
  return {};
}

/// Reads the header of a file. Verifies the checksums and does not read the nodes. O(bytes). Errors: malformed,
/// unsupported (another version, depth or type).
[[nodiscard]] inline result<compact_info> read_compact_info(std::span<const std::byte> bytes,
                                                            const std::string& where = "bytes") {
  const auto sections = detail::take_apart(detail::as_chars(bytes), where);
  if (!sections) return fail(sections.error());
  const auto head = detail::read_head(*sections, bytes.size(), where);
  if (!head) return fail(head.error());
  return head->info;
}

/// Reads the bytes of a file; `where` names them in errors. The model's values must be of the file's
/// type and scale; its other constants may differ, as with `.ot`. Where a file holds occupancy only,
/// any model will do. Errors: malformed (damaged, truncated, not such a file), unsupported (another
/// version, depth, type or scale).
template <compact_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_compact(std::span<const std::byte> bytes,
                                                           const std::string& where = "bytes") {
  using T = typename Model::value_type;
  const auto sections = detail::take_apart(detail::as_chars(bytes), where);
  if (!sections) return fail(sections.error());
  const auto head = detail::read_head(*sections, bytes.size(), where);
  if (!head) return fail(head.error());
  const compact_info& info = head->info;
  detail::value_lists<T> values;
  if (!info.occupancy_only) {
    if (info.value != detail::compact_value_of<T> || info.scale != static_cast<double>(units_per_log_odds<Model>))
      return fail(errc::unsupported, where, "holds values of another type or scale than the sensor model's");
    auto listed = detail::read_values<T>(*sections, where);
    if (!listed) return fail(listed.error());
    values = *std::move(listed);
  }
  if (!sections->tree) return fail(errc::malformed, where, "has no tree");
  detail::tree_decoder<Model> decoder{std::as_bytes(std::span{*sections->tree}), info.tree_depth, info.occupancy_only,
                                      values, info.inner_nodes};
  if (!decoder.read(head->root)) return fail(errc::malformed, where, decoder.problem());
  if (decoder.inner_nodes() != info.inner_nodes)
    return fail(errc::malformed, where,
                "holds " + std::to_string(decoder.inner_nodes()) + " inner nodes, but declares " +
                    std::to_string(info.inner_nodes));
  return occupancy_octree<Model>{info.resolution, info.tree_depth, std::move(decoder.store())};
}
/// Reads a file. Errors: not_found, unreadable, and those above.
template <compact_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_compact(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return read_compact<Model>(std::as_bytes(std::span{*bytes}), path.string());
}
/// Reads a stream to its end.
template <compact_model Model = log_odds<>>
[[nodiscard]] result<occupancy_octree<Model>> read_compact(std::istream& in) {
  const auto bytes = detail::read_stream(in);
  if (!bytes) return fail(bytes.error());
  return read_compact<Model>(std::as_bytes(std::span{*bytes}), "stream");
}

}  // namespace orbis::octree
