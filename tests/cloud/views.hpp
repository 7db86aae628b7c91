// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of a wall that somebody walks past.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::test {

struct view {
  camera::depth_view<float> depth;
  se3 T_world_camera;
};

/// A cloud and the depth images that it was made of.
struct seen_cloud {
  camera::pinhole camera{120, 90, 100, 100, 59.5, 44.5};
  std::vector<image<float>> images{};
  std::vector<se3> poses{};  ///< as stated
  std::vector<vec3f> points{};
  std::vector<float> ranges{};
  std::vector<char> outlier{};

  [[nodiscard]] std::vector<view> views() const {
    std::vector<view> out;
    for (std::size_t i = 0; i != images.size(); ++i) out.push_back({camera::depth_view<float>(images[i]), poses[i]});
    return out;
  }
  [[nodiscard]] double f1_of_removal(const std::vector<std::uint32_t>& inliers) const {
    std::vector<char> removed(points.size(), 1);
    for (const std::uint32_t i : inliers) removed[i] = 0;
    double found = 0;
    double either = 0;
    for (std::size_t i = 0; i != points.size(); ++i) {
      found += removed[i] != 0 && outlier[i] != 0 ? 1 : 0;
      either += (removed[i] != 0 ? 1 : 0) + (outlier[i] != 0 ? 1 : 0);
    }
    return 2 * found / either;
  }
};

/// The wall z = 2.5 m with a step of 0.4 m towards the camera at x > 0.3 m, from eight places. A box 1.5 m
/// away crosses from left to right (its points are outliers), and view `wrong` is 12 cm from
/// where it says (so are all of its; less than 8: none is).
inline seen_cloud walked_past_wall(bool walker = true, std::size_t wrong = 5) {
  seen_cloud out;
  random_bits random{7};
  for (std::size_t v = 0; v != 8; ++v) {
    const double at = 0.12 * static_cast<double>(v) - 0.4;
    const se3 pose{so3::exp(vec3{0.02, -0.05 * at, 0.01}), vec3{at, 0.05 * at, 0.03 * static_cast<double>(v % 3)}};
    const se3 stated = v == wrong ? pose * se3{so3::exp(vec3{0, 0.01, 0}), vec3{0.02, 0, -0.12}} : pose;
    image<float> depth(out.camera.width(), out.camera.height());
    for (int y = 0; y != depth.height(); ++y) {
      for (int x = 0; x != depth.width(); ++x) {
        const vec3 pixel = *out.camera.unproject({x, y});
        const vec3 ray = pose.rotation() * pixel;
        const auto reach = [&](double plane) { return (plane - pose.translation().z()) / ray.z(); };
        double t = reach(2.5);
        if ((pose.translation() + reach(2.1) * ray).x() > 0.3) t = reach(2.1);
        const vec3 before = pose.translation() + reach(1.5) * ray;
        const double middle = 0.35 * static_cast<double>(v) - 1.2;
        const bool on_walker = walker && std::abs(before.x() - middle) < 0.12 && std::abs(before.y()) < 0.4;
        if (on_walker) t = reach(1.5);
        const double z = t + (0.001 + 0.001 * t * t) * random.normal();
        depth(x, y) = static_cast<float>(z);
        if (x % 2 != 0 || y % 2 != 0) continue;
        const vec3 p = z * pixel;
        out.points.push_back((stated * p).cast<float>());
        out.ranges.push_back(static_cast<float>(p.norm()));
        out.outlier.push_back(on_walker || v == wrong ? 1 : 0);
      }
    }
    out.images.push_back(std::move(depth));
    out.poses.push_back(stated);
  }
  return out;
}

}  // namespace orbis::test
