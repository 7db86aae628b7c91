// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reads the sections of a map file and checks their consistency. `map_file.hpp` describes the format.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/map/file_sections.hpp>
#include <orbis/slam/detail/map/map_content.hpp>

namespace orbis::slam::detail {

/// Upper bound for all coordinates, metres: sums and products remain finite.
inline constexpr double farthest = 1e12;
/// Upper bound for the coordinates of rays at z = 1: their products with a depth, and their squares, are finite.
inline constexpr double farthest_aside = 1e30;
inline constexpr std::size_t bytes_of_keypoint = 76, bytes_of_observation = 8;

/// Reads a pose exactly as written; empty if the numbers are not a valid pose.
template <class = void>
[[nodiscard]] inline std::optional<se3> take_pose(section_reader& from) {
  std::array<double, 7> v{};
  for (double& x : v) x = from.take<double>();
  const basic_so3<double>::quaternion q(v[6], v[3], v[4], v[5]);
  const vec3 t(v[0], v[1], v[2]);
  if (!(largest_magnitude(t) < farthest) || !(std::abs(q.squaredNorm() - 1.0) < 1e-6)) return std::nullopt;
  return se3(so3::from_unit_quaternion(q), t);
}
template <class = void>
[[nodiscard]] inline features::binary_descriptor<256> take_descriptor(section_reader& from) {
  features::binary_descriptor<256> d;
  for (std::uint64_t& w : d.words) w = from.take<std::uint64_t>();
  return d;
}
template <class = void>
[[nodiscard]] inline vec3 take_vec3(section_reader& from) {
  const double x = from.take<double>(), y = from.take<double>();
  return {x, y, from.take<double>()};
}

/// Reads a map section by section. Each function returns true if the section is valid and consistent with the preceding
/// ones; otherwise `problem` describes the error.
template <class = void>
class basic_map_reader {
 public:
  using content = map_content<features::binary_descriptor<256>>;
  basic_map_reader(content& to, std::uint32_t version) : to_{to}, version_{version} {}

  std::string problem;

  bool sizes(section_reader in) {
    const auto levels = in.take<std::uint32_t>();
    to_.min_shared = in.take<std::uint32_t>();
    to_.scale_factor = in.take<double>();
    keyframe_ids_ = in.take<std::uint32_t>();
    landmark_ids_ = in.take<std::uint32_t>();
    if (keyframe_ids_ > most_keyframes_of_file || landmark_ids_ > most_landmarks_of_file)
      return wrong("more ids than a file can hold");
    const auto sensor = version_ < 2 ? 0 : in.take<std::uint32_t>();
    if (sensor > static_cast<std::uint32_t>(sensor_kind::monocular))
      return wrong("invalid sensor kind " + std::to_string(sensor));
    const auto scale_is_known = version_ < 2 ? 1 : in.take<std::uint32_t>();
    if (scale_is_known > 1) return wrong("invalid scale flag");
    to_.sensor = static_cast<sensor_kind>(sensor);
    to_.scale_is_known = scale_is_known == 1;
    to_.levels = static_cast<int>(levels);
    if (levels == 0 || levels > 64) return wrong("invalid number of pyramid levels: " + std::to_string(levels));
    if (!(to_.scale_factor > 1.0 && to_.scale_factor < 100.0)) return wrong("invalid scale factor");
    return ends(in, "size");
  }

  bool keyframes(section_reader in) {
    for (keyframe_id id = 0; id != keyframe_ids_; id = to_.keyframes.end_id()) {
      const std::string name = "keyframe " + to_string(id);
      const auto state = in.take<std::uint8_t>();
      if (in.ended()) return wrong(name + ": the section ends before it");
      if (state > (version_ >= 4 ? forgotten_keyframes : kept_keyframe)) return wrong(name + ": invalid state");
      if (!(state == kept_keyframe ? keyframe_at(in, id) : state == gone_keyframe ? erased(in, id) : forgotten(in, id)))
        return wrong(name + ": " + problem);
    }
    return check_replacements() && ends(in, "kfrm");
  }

  bool tree(section_reader in) {
    std::map<keyframe_id, std::vector<keyframe_id>> children;
    std::vector<std::pair<keyframe_id, keyframe_id>> loops;
    keyframe_id root;
    for (const keyframe& k : to_.keyframes) {
      const std::string name = "keyframe " + to_string(k.id);
      const keyframe_id parent = in.take<std::uint32_t>();
      const auto count = in.take<std::uint32_t>();
      if (in.ended() || in.left() / sizeof(keyframe_id) < count) return wrong(name + ": the section ends within it");
      if (parent != no_id && !to_.keyframes.contains(parent)) return wrong(name + ": its parent does not exist");
      if (parent == no_id && std::exchange(root, k.id) != no_id) return wrong(name + ": more than one root");
      if (parent != no_id) children[parent].push_back(k.id);
      keyframe_id last;
      for (std::uint32_t i = 0; i != count; ++i) {
        const keyframe_id other = in.take<std::uint32_t>();
        if (other == k.id || !to_.keyframes.contains(other) || (last != no_id && other <= last))
          return wrong(name + ": invalid loop edge to keyframe " + to_string(other));
        loops.emplace_back(k.id, last = other);
      }
    }
    if (root != no_id) to_.tree.add(root, no_id);
    std::vector<keyframe_id> open(root != no_id ? 1 : 0, root);
    while (!open.empty()) {
      const keyframe_id parent = open.back();
      open.pop_back();
      const auto below = children.find(parent);
      if (below == children.end()) continue;
      for (const keyframe_id child : below->second) {
        to_.tree.add(child, parent);
        open.push_back(child);
      }
    }
    if (to_.tree.size() != to_.keyframes.size()) return wrong("the tree does not connect all keyframes");
    for (const auto& [a, b] : loops)
      if (a < b) to_.tree.add_loop_edge(a, b);
    for (const auto& [a, b] : loops)
      if (const auto& ends = to_.tree.loop_edges(a); !std::binary_search(ends.begin(), ends.end(), b))
        return wrong("keyframe " + to_string(a) + ": a loop edge has no reverse edge");
    std::size_t both_ways = 0;
    for (const keyframe& k : to_.keyframes) both_ways += to_.tree.loop_edges(k.id).size();
    if (both_ways != loops.size()) return wrong("a loop edge has no reverse edge");
    return ends(in, "tree");
  }

  bool landmarks(section_reader in) {
    to_.landmarks.adopt(true);
    for (landmark_id id = 0; id != landmark_ids_; id = to_.landmarks.end_id()) {
      const auto count = in.take<std::uint32_t>();
      const bool is_run = version_ >= 3 && count == run_of_gone;
      const bool whole = is_run ? gone(in, id) : count == 0 ? removed(in, id) : landmark_at(in, id, count);
      if (in.ended()) problem = "the section ends within it";
      if (!whole || in.ended()) return wrong("landmark " + to_string(id) + ": " + problem);
    }
    to_.landmarks.adopt(false);
    for (const auto& [id, replacement] : replacements_)
      if (!to_.landmarks.contains(replacement))
        return wrong("landmark " + to_string(id) + ": its replacement does not exist");
    return ends(in, "land");
  }

 private:
  bool wrong(std::string what) {
    problem = std::move(what);
    return false;
  }
  bool ends(const section_reader& in, std::string_view name) {
    if (in.ended() || in.left() != 0)
      return wrong("section \"" + std::string(name) + "\" is " + (in.ended() ? "shorter" : "longer") +
                   " than its entries require");
    return true;
  }

  bool erased(section_reader& in, keyframe_id id) {
    const keyframe_id replacement = in.take<std::uint32_t>();
    const auto pose = take_pose(in);
    if (in.ended()) return wrong("the section ends within it");
    if (!pose) return wrong("invalid pose");
    if (replacement != no_id && replacement >= keyframe_ids_) return wrong("its replacement has an invalid id");
    to_.erased[id] = {replacement, *pose, 1.0, to_.erasures++};
    to_.keyframes.add_erased(replacement);
    return true;
  }

  bool keyframe_at(section_reader& in, keyframe_id id) {
    keyframe k;
    k.id = id;
    k.timestamp = in.take<double>();
    k.index = static_cast<std::size_t>(in.take<std::uint64_t>());
    const auto pose = take_pose(in);
    const auto n = in.take<std::uint32_t>();
    if (in.ended() || in.left() / bytes_of_keypoint < n) return wrong("the section ends within it");
    if (!pose || !std::isfinite(k.timestamp)) return wrong("invalid pose or timestamp");
    k.T_world_camera = *pose;
    k.features.keypoints.reserve(n);
    k.features.descriptors.reserve(n);
    k.depth.reserve(n);
    k.rays.reserve(n);
    for (std::uint32_t i = 0; i != n; ++i) {
      features::keypoint p;
      for (float* v : {&p.x, &p.y, &p.size, &p.angle, &p.response}) *v = in.take<float>();
      p.octave = in.take<std::int32_t>();
      k.depth.push_back(in.take<float>());
      const double x = in.take<double>(), y = in.take<double>();
      const bool has_ray = std::abs(x) < farthest_aside && std::abs(y) < farthest_aside;
      k.rays.emplace_back(x, y, has_ray ? 1.0 : std::numeric_limits<double>::quiet_NaN());
      k.features.descriptors.push_back(take_descriptor(in));
      k.features.keypoints.push_back(p);
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || p.octave < 0 || p.octave >= to_.levels ||
          !(k.depth.back() >= 0.0F && std::isfinite(k.depth.back())))
        return wrong("keypoint " + std::to_string(i) + " has an invalid position, level or depth");
      if (!has_ray && !(std::isnan(x) && std::isnan(y) && k.depth.back() == 0.0F))
        return wrong("keypoint " + std::to_string(i) + " has an invalid ray, or depth without a ray");
    }
    k.landmarks.assign(n, no_id);
    k.grid = features::keypoint_grid(k.features.keypoints);
    to_.keyframes.add(std::move(k));
    return true;
  }

  bool forgotten(section_reader& in, keyframe_id id) {
    const auto count = in.take<std::uint32_t>();
    if (in.ended()) return wrong("the section ends within it");
    if (count == 0 || count > keyframe_ids_ - id)
      return wrong("invalid run of " + std::to_string(count) + " forgotten keyframes");
    to_.keyframes.add_gone(count);
    to_.forgotten += count;
    return true;
  }

  /// Checks that each chain of replacements leads to an existing keyframe or to `no_id`.
  bool check_replacements() {
    std::map<keyframe_id, keyframe_id> met;  // the keyframe from which each id was first reached
    for (const auto& [id, e] : to_.erased)
      for (keyframe_id k = id; k != no_id && !to_.keyframes.contains(k);) {
        const auto at = to_.erased.find(k);
        if (at == to_.erased.end()) return wrong("keyframe " + to_string(id) + ": its replacement is not in the map");
        const auto [first, is_new] = met.emplace(k, id);
        if (!is_new && first->second == id) return wrong("keyframe " + to_string(id) + ": it is its own replacement");
        if (!is_new) break;  // the rest of the chain was checked before
        k = at->second.replacement;
      }
    return true;
  }

  bool removed(section_reader& in, landmark_id id) {
    const landmark_id replacement = in.take<std::uint32_t>();
    if (replacement != no_id && replacement >= landmark_ids_) return wrong("its replacement has an invalid id");
    if (replacement != no_id) replacements_.emplace_back(id, replacement);
    to_.landmarks.add_erased(replacement);
    return true;
  }

  bool gone(section_reader& in, landmark_id id) {
    const auto count = in.take<std::uint32_t>();
    if (in.ended()) return false;
    if (count == 0 || count > landmark_ids_ - id)
      return wrong("invalid run of " + std::to_string(count) + " erased landmarks");
    to_.landmarks.add_gone(count);
    return true;
  }

  bool landmark_at(section_reader& in, landmark_id id, std::uint32_t count) {
    landmark l;
    l.id = id;
    l.position = take_vec3(in);
    l.normal = take_vec3(in);
    l.min_distance = in.take<double>();
    l.max_distance = in.take<double>();
    l.descriptor = take_descriptor(in);
    l.created = in.take<std::uint32_t>();
    l.visible = in.take<std::uint32_t>();
    l.found = in.take<std::uint32_t>();
    l.has_current_descriptor = in.take<std::uint8_t>() != 0;
    if (in.ended() || in.left() / bytes_of_observation < count) return in.end();
    if (!(largest_magnitude(l.position) < farthest) || !all_finite(l.normal) || !(l.min_distance >= 0.0) ||
        !(l.max_distance >= 0.0) || !std::isfinite(l.max_distance))
      return wrong("invalid position, normal or distance range");
    if (l.created >= keyframe_ids_) return wrong("the keyframe that created it has an invalid id");
    l.observations.reserve(count);
    for (std::uint32_t i = 0; i != count; ++i) {
      observation o;
      o.keyframe = in.take<std::uint32_t>();
      o.feature = in.take<std::uint32_t>();
      const std::string by = "keypoint " + std::to_string(o.feature) + " of keyframe " + to_string(o.keyframe);
      if (!to_.keyframes.contains(o.keyframe) || o.feature >= to_.keyframes[o.keyframe].size())
        return wrong("observed by " + by + ", which does not exist");
      if (i != 0 && o.keyframe <= l.observations.back().keyframe)
        return wrong("its observations are not in ascending order");
      if (std::exchange(to_.keyframes[o.keyframe].landmarks[o.feature], id) != no_id)
        return wrong("observed by " + by + ", which observes another landmark");
      l.observations.push_back(o);
    }
    to_.landmarks.add(std::move(l));
    return true;
  }

  content& to_;
  std::uint32_t version_;
  std::uint32_t keyframe_ids_ = 0, landmark_ids_ = 0;
  std::vector<std::pair<landmark_id, landmark_id>> replacements_;  ///< erased landmarks and their replacements
};
using map_reader = basic_map_reader<>;

}  // namespace orbis::slam::detail
