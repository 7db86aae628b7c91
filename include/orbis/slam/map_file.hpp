// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Maps in files.
///
/// A file is little-endian; equal maps give equal bytes on every machine:
///
///     0   "orbismap"
///     8   version (u32), 1
///     12  the sections "size", "kfrm", "tree" and "land", each: its name (4 bytes), the length of its content (u64),
///         the content, CRC-32C of all three (u32)
///
/// Poses are tx ty tz qx qy qz qw (f64); ids are u32, ffffffff for none.
///
///     size  levels of the pyramid (u32), shared landmarks that make an edge (u32), scale factor (f64), number of ids
///           given to keyframes (u32) and to landmarks (u32) so far
///     kfrm  for each keyframe id a byte. 0: it was erased; its replacement (id) and its pose relative to that. 1: time
///           stamp (f64), frame index (u64), pose, number of keypoints (u32), and for each keypoint x, y, size, angle,
///           response (f32), octave (i32), depth (f32), x and y of the ray (f64; NaN without one), descriptor (32
///           bytes)
///     tree  for each keyframe: parent (id), number of loop edges (u32), their other ends (ids)
///     land  for each landmark id the number of observations (u32). 0: it was removed; its replacement (id). Otherwise
///           position, normal (3 f64 each), least and greatest distance (f64), descriptor (32 bytes), keyframe that
///           created it (id), times visible, times found (u32 each), whether the descriptor is current (a byte), and
///           the observations: keyframe (id), keypoint (u32)
///
/// The covisibility graph and the grids of keypoints are not stored: they follow from the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/detail/map/map_reader.hpp>
#include <orbis/slam/detail/map/map_writer.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// The bytes of a map's file. O(map).
[[nodiscard]] inline std::string map_bytes(const map& m) { return detail::write_sections(m); }

/// The map in `bytes`; `where` names their origin in errors. The map is consistent (`validate`), whatever the bytes.
/// Errors: `malformed` (with the section and what is wrong in it), `unsupported` (another version).
[[nodiscard]] inline result<map> parse_map(std::span<const std::byte> bytes, const std::string& where = "bytes") {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  constexpr std::size_t head = detail::map_magic.size() + sizeof(detail::map_version);
  if (text.substr(0, detail::map_magic.size()) != detail::map_magic)
    return fail(errc::malformed, where, "not a map of orbis: it does not begin with \"orbismap\"");
  if (text.size() < head) return fail(errc::malformed, where, "ends before its version");
  if (const auto version = load_number<std::uint32_t>(text.data() + detail::map_magic.size());
      version != detail::map_version)
    return fail(errc::unsupported, where, "version " + std::to_string(version) + ", this reads version 1");

  detail::map_reader::content parts;
  detail::map_reader read{parts};
  detail::section_finder next{text, head};
  using section = std::pair<std::string_view, bool (detail::map_reader::*)(detail::section_reader)>;
  for (const auto& [name, take] :
       {section{"size", &detail::map_reader::sizes}, section{"kfrm", &detail::map_reader::keyframes},
        section{"tree", &detail::map_reader::tree}, section{"land", &detail::map_reader::landmarks}}) {
    const auto content = next.find(name);
    if (!content) return fail(errc::malformed, where, next.problem());
    if (!(read.*take)(*content)) return fail(errc::malformed, where, std::move(read.problem));
  }
  if (!next.at_end()) return fail(errc::malformed, where, next.problem());
  return map{std::move(parts)};
}

/// Reads a map from a file. Errors: `not_found`, `unreadable`, and those of `parse_map`.
[[nodiscard]] inline result<map> read_map(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_map(std::as_bytes(std::span{*bytes}), path.string());
}

/// Writes the result of `map_bytes` to a file; an existing file is replaced only once all is written.
/// Errors: `write_failed`.
[[nodiscard]] inline result<void> write_map_bytes(const std::filesystem::path& path, const std::string& bytes) {
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

/// Writes a map to a file, as `write_map_bytes`. Errors: `write_failed`.
[[nodiscard]] inline result<void> write_map(const std::filesystem::path& path, const map& m) {
  return write_map_bytes(path, map_bytes(m));
}

}  // namespace orbis::slam
