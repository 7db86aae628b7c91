// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of map_file.hpp.
#pragma once

#include <cstdint>
#include <ostream>
#include <string_view>
#include <utility>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/detail/map/map_content.hpp>
#include <orbis/slam/detail/map/map_reader.hpp>
#include <orbis/slam/map_file.hpp>

namespace orbis::slam {
namespace detail {

inline constexpr std::string_view map_magic = "orbismap";
inline constexpr std::uint32_t map_version = 4;

template <class = void>
inline void put_pose(std::string& to, const se3& pose) {
  const auto& q = pose.rotation().unit_quaternion();
  put(to, pose.translation().x(), pose.translation().y(), pose.translation().z(), q.x(), q.y(), q.z(), q.w());
}
template <class = void>
inline void put_descriptor(std::string& to, const features::binary_descriptor<256>& d) {
  for (const std::uint64_t w : d.words) put(to, w);
}
template <class = void>
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

template <class = void>
inline void put_landmark(std::string& to, const landmark& l) {
  put(to, static_cast<std::uint32_t>(l.observations.size()));
  for (const vec3& v : {l.position, l.normal}) put(to, v.x(), v.y(), v.z());
  put(to, l.min_distance, l.max_distance);
  put_descriptor(to, l.descriptor);
  put(to, l.created.value(), l.visible, l.found, static_cast<std::uint8_t>(l.has_current_descriptor));
  for (const observation& o : l.observations) put(to, o.keyframe.value(), o.feature);
}

/// Returns the bytes of the whole file.
template <class = void>
[[nodiscard]] std::string write_sections(const map& m) {
  std::string bytes(map_magic);
  put(bytes, map_version);
  const bool leaves_out_erased = m.landmark_end() > most_landmarks_of_file;
  const std::uint32_t landmark_ids =
      leaves_out_erased ? static_cast<std::uint32_t>(m.landmark_count()) : m.landmark_end().value();
  put_section(bytes, "size", [&](std::string& to) {
    const auto& all = m.content();
    put(to, static_cast<std::uint32_t>(all.levels), all.min_shared, all.scale_factor, m.keyframe_end().value(),
        landmark_ids, static_cast<std::uint32_t>(all.sensor), std::uint32_t{all.scale_is_known});
  });
  put_section(bytes, "kfrm", [&](std::string& to) {
    for (keyframe_id id = 0; id != m.keyframe_end(); ++id) {
      if (const keyframe_id next = m.next_remembered(id); next != id) {
        put(to, forgotten_keyframes, next - id);
        if ((id = next) == m.keyframe_end()) break;
      }
      if (m.has_keyframe(id)) {
        put(to, kept_keyframe);
        put_keyframe(to, m.at(id));
      } else {
        put(to, gone_keyframe);
        const erased_keyframe& e = m.content().erased.at(id);
        put(to, e.replacement.value());
        const double scale = e.replacement == no_id ? 1.0 : m.scale(e.replacement);
        put_pose(to, scaled(e.T_replacement_camera, scale));  // all scales of a map read from a file are 1
      }
    }
  });
  put_section(bytes, "tree", [&](std::string& to) {
    for (const keyframe& k : m.keyframes()) {
      const auto& loops = m.tree().loop_edges(k.id);
      put(to, m.tree().parent(k.id).value(), static_cast<std::uint32_t>(loops.size()));
      for (const keyframe_id other : loops) put(to, other.value());
    }
  });
  put_section(bytes, "land", [&](std::string& to) {
    if (leaves_out_erased) {
      for (const landmark& l : m.landmarks()) put_landmark(to, l);
      return;
    }
    const auto is_gone = [&m](landmark_id id) { return m.replacement(id) == no_id; };
    for (landmark_id id = 0; id != m.landmark_end();) {
      // Erased ids are written as runs if the map has forgotten them, otherwise individually.
      landmark_id next = m.landmarks().next_known_id(id);
      while (next != m.landmark_end() && is_gone(next)) next = m.landmarks().next_known_id(next + 1);
      if (next != id) put(to, run_of_gone, next - id);
      if (next == m.landmark_end()) break;
      if (m.has_landmark(next))
        put_landmark(to, m.landmark_at(next));
      else
        put(to, std::uint32_t{0}, m.replacement(next).value());
      id = next + 1;
    }
  });
  return bytes;
}

}  // namespace detail

ORBIS_LAZY_INLINE std::string map_bytes(const map& m) { return detail::write_sections(m); }

ORBIS_LAZY_INLINE result<map> parse_map(std::span<const std::byte> bytes, const std::string& where) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  constexpr std::size_t head = detail::map_magic.size() + sizeof(detail::map_version);
  if (text.substr(0, detail::map_magic.size()) != detail::map_magic)
    return fail(errc::malformed, where, "not an orbis map: it does not begin with \"orbismap\"");
  if (text.size() < head) return fail(errc::malformed, where, "the file ends before the version number");
  const auto version = load_number<std::uint32_t>(text.data() + detail::map_magic.size());
  if (version == 0 || version > detail::map_version)
    return fail(errc::unsupported, where,
                "version " + std::to_string(version) + "; only versions 1 to 4 are supported");

  detail::map_reader::content parts;
  detail::map_reader read{parts, version};
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

ORBIS_LAZY_INLINE result<map> read_map(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return fail(bytes.error());
  return parse_map(std::as_bytes(std::span{*bytes}), path.string());
}

ORBIS_LAZY_INLINE result<void> write_map_bytes(const std::filesystem::path& path, const std::string& bytes) {
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

ORBIS_LAZY_INLINE result<void> write_map(const std::filesystem::path& path, const map& m) {
  return write_map_bytes(path, map_bytes(m));
}

}  // namespace orbis::slam
