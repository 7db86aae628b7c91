// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// OctoMap as the reference: the same scans into both, compared to the last bit.
#pragma once

#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <octomap/octomap.h>

#include <orbis/core/random.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::test {

/// Silences OctoMap, which reports on std::cerr and std::cout.
class quiet {
 public:
  quiet() : err_{std::cerr.rdbuf(nullptr)}, out_{std::cout.rdbuf(nullptr)} {}
  ~quiet() {
    std::cerr.rdbuf(err_);
    std::cout.rdbuf(out_);
    std::cerr.clear();
    std::cout.clear();
  }
  quiet(const quiet&) = delete;
  quiet& operator=(const quiet&) = delete;

 private:
  std::streambuf* err_;
  std::streambuf* out_;
};

[[nodiscard]] inline octomap::point3d to_octomap(const vec3f& p) { return {p.x(), p.y(), p.z()}; }

inline void insert(octomap::OcTree& tree, const std::vector<vec3f>& points, const vec3f& origin,
                   const octree::integration_options& options) {
  octomap::Pointcloud cloud;
  for (const vec3f& p : points) cloud.push_back(to_octomap(p));
  tree.insertPointCloud(cloud, to_octomap(origin), std::isinf(options.max_range) ? -1.0 : options.max_range, false,
                        options.mode == octree::ray_mode::discretized);
}

/// The tree's own files. They hold every node and every log-odds, so equal bytes are equal maps.
[[nodiscard]] inline std::string ot_of(const octomap::OcTree& tree) {
  const quiet silence;
  std::ostringstream out;
  tree.write(out);
  return out.str();
}
[[nodiscard]] inline std::string bt_of(octomap::OcTree tree) {
  const quiet silence;
  std::ostringstream out;
  tree.writeBinary(out);
  return out.str();
}

/// Points in a cube of edge 2 * `half`, metres.
[[nodiscard]] inline std::vector<vec3f> random_points(random_bits& random, std::size_t count, double half) {
  std::vector<vec3f> points(count);
  for (vec3f& p : points)
    for (int i = 0; i != 3; ++i) p[i] = static_cast<float>(random.uniform(-half, half));
  return points;
}

/// Scans of a wavy sphere around a moving sensor: rays of all directions, voxels hit by many.
[[nodiscard]] inline std::vector<vec3f> shell_scan(random_bits& random, std::size_t count, const vec3f& origin) {
  std::vector<vec3f> points = random_points(random, count, 1.0);
  for (vec3f& p : points) {
    const float n = p.norm() > 1e-3F ? p.norm() : 1.0F;
    p = vec3f(origin * 0.3F + p / n * (1.5F + 0.2F * p.x() * p.y()));
  }
  return points;
}

/// A map of shell scans and its reference.
struct twin_maps {
  octree::occupancy_octree<> ours{0.05};
  octomap::OcTree theirs{0.05};

  twin_maps(std::uint64_t seed, int scans) {
    random_bits random{seed};
    for (int i = 0; i != scans; ++i) {
      const vec3f origin = random_points(random, 1, 0.3)[0];
      const auto scan = shell_scan(random, 1500, origin);
      ours.integrate(scan, origin);
      insert(theirs, scan, origin, {});
    }
  }
};

}  // namespace orbis::test
