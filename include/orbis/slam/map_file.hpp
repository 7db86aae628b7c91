// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Maps in files.
///
/// A file is little-endian and the same bytes for the same map on every machine:
///
///     0   "orbismap"
///     8   version (u32), 1
///     12  the sections "size", "kfrm", "tree" and "land", each: its name (4 bytes), the length of its content (u64),
///         the content, CRC-32C of all three (u32)
///
/// Poses are tx ty tz qx qy qz qw (f64), numbers of keyframes and landmarks u32, ffffffff for none.
///
///     size  levels of the pyramid (u32), landmarks that make an edge (u32), scale factor (f64), numbers given to
///           keyframes and to landmarks so far
///     kfrm  for each number a byte: 0 and, of an erased keyframe, its heir and its pose seen from there; or 1 and time
///           stamp (f64), frame index (u64), pose, number of keypoints (u32), and of each of these x, y, size, angle,
///           response (f32), octave (i32), depth (f32), x and y of the ray (f64; NaN without one), descriptor (32
///           bytes)
///     tree  for each keyframe that is there: parent, number of loop edges (u32), their other ends
///     land  for each number the observations (u32): none and, of a dead landmark, what it became; or some and
///     position,
///           normal (3 f64 each), least and greatest distance (f64), descriptor (32 bytes), creating keyframe, times
///           visible, found (u32 each), whether the descriptor is up to date (a byte), and the observations: keyframe,
///           keypoint (u32)
///
/// What follows from these is not stored: the covisibility graph, the keypoints' grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <orbis/core/bits.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/detail/map/map_reader.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

namespace detail {

inline constexpr std::string_view map_magic = "orbismap";
inline constexpr std::uint32_t map_version = 1;
inline void put_pose(std::string& to, const se3& pose) {
  const auto& q = pose.rotation().unit_quaternion();
  put(to, pose.translation().x(), pose.translation().y(), pose.translation().z(), q.x(), q.y(), q.z(), q.w());
}
inline void put_descriptor(std::string& to, const features::binary_descriptor<256>& d) {
  for (const std::uint64_t w : d.words) put(to, w);
}
inline void put_keyframe(std::string& to, const keyframe& k) {
  put(to, k.timestamp, std::uint64_t{k.index});
  put_pose(to, k.T_world_camera);
  put(to, static_cast<std::uint32_t>(k.size()));
  for (std::size_t i = 0; i != k.size(); ++i) {
    const features::keypoint& p = k.features.keypoints[i];
    put(to, p.x, p.y, p.size, p.angle, p.response, std::int32_t{p.octave}, k.depth[i], k.rays[i].x(), k.rays[i].y());
    put_descriptor(to, k.features.descriptors[i]);
  }
}

inline void put_landmark(std::string& to, const landmark& l) {
  for (const vec3& v : {l.position, l.normal}) put(to, v.x(), v.y(), v.z());
  put(to, l.min_distance, l.max_distance);
  put_descriptor(to, l.descriptor);
  put(to, l.created, l.visible, l.found, static_cast<std::uint8_t>(l.has_current_descriptor));
  for (const observation& o : l.observations) put(to, o.keyframe, o.feature);
}

}  // namespace detail

/// A map as the bytes of a file.
[[nodiscard]] inline std::string map_bytes(const map& m) {
  using detail::put;
  std::string bytes(detail::map_magic);
  put(bytes, detail::map_version);
  detail::put_section(bytes, "size", [&](std::string& to) {
    const detail::map_content& all = m.content();
    put(to, static_cast<std::uint32_t>(all.levels), all.min_shared, all.scale_factor, m.keyframe_end(),
        m.landmark_end());
  });
  detail::put_section(bytes, "kfrm", [&](std::string& to) {
    for (keyframe_id id = 0; id != m.keyframe_end(); ++id) {
      put(to, static_cast<std::uint8_t>(m.has_keyframe(id)));
      if (m.has_keyframe(id)) {
        detail::put_keyframe(to, m.at(id));
      } else {
        const detail::erased_keyframe& e = m.content().erased.at(id);
        put(to, e.heir);
        detail::put_pose(to, e.T_heir_camera);
      }
    }
  });
  detail::put_section(bytes, "tree", [&](std::string& to) {
    for (const keyframe& k : m.keyframes()) {
      const auto& loops = m.tree().loop_edges(k.id);
      put(to, m.tree().parent(k.id), static_cast<std::uint32_t>(loops.size()));
      for (const keyframe_id other : loops) put(to, other);
    }
  });
  detail::put_section(bytes, "land", [&](std::string& to) {
    for (landmark_id id = 0; id != m.landmark_end(); ++id) {
      if (m.has_landmark(id)) {
        put(to, static_cast<std::uint32_t>(m.landmark_at(id).observations.size()));
        detail::put_landmark(to, m.landmark_at(id));
      } else {
        put(to, std::uint32_t{0}, m.became(id));
      }
    }
  });
  return bytes;
}

/// The map in `bytes`; `where` names them in errors. What it gives is whole (`validate`), whatever the bytes.
/// Errors: malformed (with the section and what is wrong in it), unsupported (another version).
[[nodiscard]] inline result<map> parse_map(std::span<const std::byte> bytes, const std::string& where = "bytes") {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  constexpr std::size_t head = detail::map_magic.size() + sizeof(detail::map_version);
  if (text.substr(0, detail::map_magic.size()) != detail::map_magic)
    return fail(errc::malformed, where, "not a map of orbis: it does not begin with \"orbismap\"");
  if (text.size() < head) return fail(errc::malformed, where, "ends before its version");
  if (const auto version = load_number<std::uint32_t>(text.data() + detail::map_magic.size());
      version != detail::map_version)
    return fail(errc::unsupported, where, "version " + std::to_string(version) + ", this reads version 1");

  detail::map_content parts;
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

/// Reads a file. Errors: not_found, unreadable, malformed, unsupported.
[[nodiscard]] inline result<map> read_map(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_map(std::as_bytes(std::span{*bytes}), path.string());
}

/// Writes what `map_bytes` gave into a file, whole or not at all. Errors: write_failed.
[[nodiscard]] inline result<void> write_map_bytes(const std::filesystem::path& path, const std::string& bytes) {
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

/// Writes a file, whole or not at all. Errors: write_failed.
[[nodiscard]] inline result<void> write_map(const std::filesystem::path& path, const map& m) {
  return write_map_bytes(path, map_bytes(m));
}

}  // namespace orbis::slam
