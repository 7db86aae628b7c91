// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Maps made of noise, and whether they are whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/map.hpp>

#include "support/validate.hpp"

namespace orbis::test {

[[nodiscard]] inline vec3 random_point(random_bits& random, double range) {
  const double x = random.uniform(-range, range), y = random.uniform(-range, range);
  return {x, y, random.uniform(-range, range)};
}
[[nodiscard]] inline se3 random_motion(random_bits& random) {
  const vec3 turned = random_point(random, 2.0);
  return {so3::exp(turned), random_point(random, 3.0)};
}

/// A frame of `n` keypoints with random descriptors, all two metres away, looking along z from 0.1 `index` on the x
/// axis.
[[nodiscard]] inline slam::frame random_frame(random_bits& random, std::size_t n, std::size_t index) {
  slam::frame f;
  f.index = index;
  f.timestamp = 0.1 * static_cast<double>(index);
  f.T_world_camera = se3(so3{}, vec3(0.1 * static_cast<double>(index), 0, 0));
  for (std::size_t i = 0; i < n; ++i) {
    features::keypoint k;
    k.x = static_cast<float>(random.uniform(0, 640));
    k.y = static_cast<float>(random.uniform(0, 480));
    k.octave = static_cast<int>(random.below(8));
    f.features.keypoints.push_back(k);
    features::binary_descriptor<256> d;
    for (auto& w : d.words) w = random();
    f.features.descriptors.push_back(d);
    f.depth.push_back(2.0F);
    f.rays.emplace_back((static_cast<double>(k.x) - 320) / 525, (static_cast<double>(k.y) - 240) / 525, 1.0);
    f.landmarks.push_back(slam::no_id);
  }
  f.grid = features::keypoint_grid(f.features.keypoints);
  return f;
}

/// What `validate` finds wrong; empty if nothing.
[[nodiscard]] inline std::string fault_of(const slam::map& m) {
  const auto valid = test::validate(m);
  return valid ? std::string{} : valid.error().to_string();
}

/// Any of the keyframes or landmarks that there ever were.
[[nodiscard]] inline slam::keyframe_id any_keyframe(random_bits& random, const slam::map& m) {
  return m.keyframe_end() == 0 ? 0 : random.below(m.keyframe_end().value());
}
[[nodiscard]] inline slam::landmark_id any_landmark(random_bits& random, const slam::map& m) {
  return m.landmark_end() == 0 ? 0 : random.below(m.landmark_end().value());
}

/// A keyframe that shows some of what the map has.
inline slam::keyframe_id add_random_keyframe(random_bits& random, slam::map& m, std::size_t keypoints,
                                             std::size_t known) {
  auto f = random_frame(random, keypoints, m.keyframe_end().value());
  const auto n = static_cast<std::uint32_t>(keypoints);
  for (std::size_t i = 0; i < known; ++i) f.landmarks[random.below(n)] = any_landmark(random, m);
  return slam::detail::insert_keyframe(m, std::move(f), {});
}

/// One of all the things that can be done to a map; about `keyframes` remain in it.
inline void change_somehow(random_bits& random, slam::map& m, std::size_t keyframes, std::uint32_t keypoints = 30) {
  const auto k = any_keyframe(random, m), other = any_keyframe(random, m);
  const auto l = any_landmark(random, m), into = any_landmark(random, m);
  const auto feature = random.below(keypoints);
  switch (m.keyframes().empty() ? 0 : random.below(11)) {
    case 0:
      if (m.keyframes().size() < 2 * keyframes) add_random_keyframe(random, m, keypoints, keypoints / 2);
      break;
    case 1:
    case 2:
    case 3:
      if (m.has_landmark(l) && m.has_keyframe(k)) m.add_observation(l, k, feature);
      break;
    case 4: m.erase_observation(l, k); break;
    case 5:
      if (m.has_landmark(l) && random.below(10) == 0) m.remove_landmark(l);
      break;
    case 6:
      if (l != into && m.has_landmark(l) && m.has_landmark(into)) m.fuse(l, into);
      break;
    case 7:
      if (m.has_keyframe(k) && random.below(static_cast<std::uint32_t>(3 * keyframes)) < m.keyframes().size())
        m.erase_keyframe(k);
      break;
    case 8:
      if (m.has_keyframe(k) && m.at(k).landmarks[feature] == slam::no_id) m.add_landmark(k, feature);
      break;
    case 9:
      if (k != other && m.has_keyframe(k) && m.has_keyframe(other) && random.below(10) == 0) m.add_loop_edge(k, other);
      break;
    default:
      if (m.has_landmark(l)) m.update_landmark(l);
  }
}

/// A map that has seen `steps` changes.
[[nodiscard]] inline slam::map random_map(std::uint64_t seed, int steps, std::size_t keyframes = 10,
                                          std::uint32_t min_shared = 3) {
  random_bits random(seed);
  slam::map m(8, 1.2, min_shared);
  for (int i = 0; i < steps; ++i) change_somehow(random, m, keyframes);
  return m;
}

}  // namespace orbis::test
