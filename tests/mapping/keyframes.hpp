// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small posed keyframes of a wall, with some wild depths.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/keyframe.hpp>

namespace orbis::test {

struct seen_scene {
  camera::pinhole camera;
  std::vector<image<std::uint16_t>> depth;
  std::vector<image<rgb8>> color;
  std::vector<se3> poses;

  [[nodiscard]] mapping::keyframe<> keyframe(std::size_t i) const {
    return {camera::depth_view<std::uint16_t>(depth[i].view(), 1000.0), color[i], poses[i]};
  }
  [[nodiscard]] std::vector<mapping::keyframe<>> keyframes() const {
    std::vector<mapping::keyframe<>> out;
    for (std::size_t i = 0; i != depth.size(); ++i) out.push_back(keyframe(i));
    return out;
  }
};

/// The wall z = 2 m, seen from different places near the origin; depth noise of 2 mm, some pixels
/// without depth, and `wild` of a thousand anywhere before the wall.
inline seen_scene wall_scene(std::size_t frames, std::uint32_t wild = 0) {
  seen_scene out{camera::pinhole{{.width = 64, .height = 48, .fx = 55, .fy = 55, .cx = 31.5, .cy = 23.5}}, {}, {}, {}};
  random_bits random{42};
  for (std::size_t f = 0; f != frames; ++f) {
    const vec3 rotation{0.03 * static_cast<double>(f), -0.05 * static_cast<double>(f), 0.02};
    const vec3 translation{0.1 * static_cast<double>(f), 0.05, -0.1 * static_cast<double>(f)};
    const se3 pose{so3::exp(rotation), translation};
    image<std::uint16_t> depth(64, 48);
    image<rgb8> color(64, 48);
    for (int y = 0; y != 48; ++y) {
      for (int x = 0; x != 64; ++x) {
        const vec3 ray = pose.rotation() * *out.camera.unproject({x, y});
        double z = (2.0 - translation.z()) / ray.z() + 0.002 * random.normal();
        if (random.below(1000) < wild) z *= random.uniform(0.3, 0.9);
        if (random.below(50) == 0) z = 0;
        depth(x, y) = static_cast<std::uint16_t>(std::lround(1000 * z));
        color(x, y) = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(f)};
      }
    }
    out.depth.push_back(std::move(depth));
    out.color.push_back(std::move(color));
    out.poses.push_back(pose);
  }
  return out;
}

/// The wall with a board before it, and along the board's sides pixels that measure something between
/// the two.
inline seen_scene edge_scene(std::size_t frames) {
  seen_scene out = wall_scene(frames);
  for (auto& depth : out.depth) {
    for (int y = 8; y != 40; ++y) {
      for (int x = 20; x <= 44; ++x) depth(x, y) = x == 20 || x == 44 ? 1500 : 1000;
    }
  }
  return out;
}

}  // namespace orbis::test
