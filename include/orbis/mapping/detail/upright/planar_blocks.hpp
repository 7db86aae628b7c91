// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The planes of a depth image's blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/LU>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping::detail {

struct planar_blocks {
  std::vector<vec3> normals;   ///< of the flat blocks, in the camera's frame, towards the camera
  std::size_t with_depth = 0;  ///< blocks that are mostly measured, flat or not
};

/// Fits a plane to each block of a grid of about 27 by 20 blocks. On a plane `n . p = 1` the inverse depth is linear in
/// the ray: `1 / z = n . (x, y, 1)`. Blocks whose inverse depths are off by more than a few thousandths, two percent
/// where they are far, are not flat: the noise of depth grows with depth.
template <camera::depth_source Depth>
[[nodiscard]] planar_blocks find_planar_blocks(const Depth& depth, const camera::ray_table& rays) {
  constexpr int blocks_across = 27;
  const int size = std::max(4, rays.width() / blocks_across), step = std::max(1, size / 12);
  planar_blocks out;
  struct sample {
    double x, y, inverse;
  };
  std::vector<sample> samples;
  for (int y0 = 0; y0 + size <= rays.height(); y0 += size)
    for (int x0 = 0; x0 + size <= rays.width(); x0 += size) {
      samples.clear();
      std::size_t pixels = 0;
      vec3 sum = zeros<vec3>();
      for (int y = y0; y < y0 + size; y += step)
        for (int x = x0; x < x0 + size; x += step) {
          ++pixels;
          const float z = depth(x, y);
          const vec2f& ray = rays(x, y);
          if (!(z > 0.0F) || !std::isfinite(z) || !all_finite(ray)) continue;
          samples.push_back({ray.x(), ray.y(), 1.0 / static_cast<double>(z)});
          sum += vec3(ray.x(), ray.y(), samples.back().inverse);
        }
      if (samples.size() < 4 || 10 * samples.size() < 7 * pixels) continue;
      ++out.with_depth;
      const auto n = static_cast<double>(samples.size());
      const vec3 mean = sum / n;
      double xx = 0, xy = 0, yy = 0, xi = 0, yi = 0, ii = 0;
      for (const sample& s : samples) {
        const double x = s.x - mean.x(), y = s.y - mean.y(), i = s.inverse - mean.z();
        xx += x * x, xy += x * y, yy += y * y, xi += x * i, yi += y * i, ii += i * i;
      }
      const double determinant = xx * yy - xy * xy;
      if (!(determinant > 1e-6 * xx * yy)) continue;
      const double a = (yy * xi - xy * yi) / determinant, b = (xx * yi - xy * xi) / determinant;
      const double rest = std::sqrt(std::max(0.0, ii - a * xi - b * yi) / n);
      const double z = 1.0 / mean.z();
      if (rest * z > 0.004 + 0.0025 * z) continue;  // relative to the depth
      const vec3 normal(a, b, mean.z() - a * mean.x() - b * mean.y());
      out.normals.push_back(-normalized(normal));
    }
  return out;
}

}  // namespace orbis::mapping::detail
