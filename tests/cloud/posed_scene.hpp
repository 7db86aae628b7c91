// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of boxes, seen by any camera from known places.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/camera/cloud.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::test {

/// Boxes along the axes; rays end where they enter one, or leave the one they are in.
struct box_scene {
  struct box {
    vec3 low, high;
  };
  box walls{{-3, -1.5, -3}, {3, 1.5, 4}};  ///< around everything
  std::vector<box> boxes{};

  /// A room of 6 x 3 x 7 m with a table, a thin board and a pole of 3 cm.
  static box_scene room() {
    box_scene out;
    out.boxes.push_back({{-1.2, 0.4, 1.5}, {0.2, 0.5, 2.5}});
    out.boxes.push_back({{0.6, -0.6, 2.4}, {1.6, 0.6, 2.43}});
    out.boxes.push_back({{-0.415, -1.5, 1.885}, {-0.385, 0.4, 1.915}});
    return out;
  }

  /// How many lengths of `ray` it is from `origin` to the first surface. @pre origin within the walls
  [[nodiscard]] double cast(const vec3& origin, const vec3& ray) const {
    double first = crossing(walls, origin, ray).second;
    for (const box& b : boxes) {
      const auto [in, out] = crossing(b, origin, ray);
      if (in < out && in > 0) first = std::min(first, in);
    }
    return first;
  }

 private:
  static std::pair<double, double> crossing(const box& b, const vec3& origin, const vec3& ray) {
    double in = -1e30;
    double out = 1e30;
    for (Eigen::Index a = 0; a != 3; ++a) {
      if (ray[a] == 0) {
        if (origin[a] < b.low[a] || origin[a] > b.high[a]) return {1e30, -1e30};
        continue;
      }
      const double one = (b.low[a] - origin[a]) / ray[a];
      const double two = (b.high[a] - origin[a]) / ray[a];
      in = std::max(in, std::min(one, two));
      out = std::min(out, std::max(one, two));
    }
    return {in, out};
  }
};

/// A depth image of its own, and where its camera is thought to be.
struct posed_image {
  orbis::image<float> image;
  camera::depth_view<float> depth;
  se3 T_world_camera;

  posed_image(orbis::image<float> pixels, const se3& pose)
      : image{std::move(pixels)}, depth{image.view()}, T_world_camera{pose} {}
  posed_image(const posed_image& other) : posed_image(other.image, other.T_world_camera) {}
  posed_image& operator=(const posed_image& other) {
    image = other.image;
    depth = camera::depth_view<float>(image.view());
    T_world_camera = other.T_world_camera;
    return *this;
  }
};

struct view_options {
  double noise = 0;         ///< sigma at 1 m, growing with z^2, metres
  std::uint32_t holes = 0;  ///< of a thousand pixels without depth
  std::uint64_t seed = 9;
};

/// Where the camera is in view `i` of a walk through the room, looking ahead and around.
inline se3 walking_pose(std::size_t i) {
  const auto t = static_cast<double>(i);
  return {so3::exp(vec3{0.05 * std::sin(1.3 * t), 0.35 * std::sin(0.7 * t), 0.03 * std::cos(t)}),
          vec3{0.7 * std::sin(0.9 * t), 0.25 * std::cos(0.5 * t), -0.5 + 0.4 * std::sin(0.4 * t)}};
}

template <class Camera>
posed_image view_of(const box_scene& scene, const Camera& camera, const se3& pose, const view_options& options = {}) {
  image<float> depth(camera.width(), camera.height(), 0.0F);
  random_bits random{options.seed};
  for (int y = 0; y != camera.height(); ++y) {
    for (int x = 0; x != camera.width(); ++x) {
      const auto ray = camera.unproject({x, y});
      if (!ray) continue;
      const double z = scene.cast(pose.translation(), pose.rotation() * *ray);
      const double measured = z + options.noise * z * z * random.normal();
      if (random.below(1000) >= options.holes) depth(x, y) = static_cast<float>(measured);
    }
  }
  return {std::move(depth), pose};
}

template <class Camera>
std::vector<posed_image> views_of(const box_scene& scene, const Camera& camera, std::size_t count,
                                  const view_options& options) {
  std::vector<posed_image> out;
  for (std::size_t i = 0; i != count; ++i) {
    view_options each = options;
    each.seed = options.seed + i;
    out.push_back(view_of(scene, camera, walking_pose(i), each));
  }
  return out;
}

}  // namespace orbis::test
