// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The upward direction in a depth image, so that a map can start gravity-aligned.
///
/// @code
///   const mapping::upright_view view = mapping::find_upright(frame.depth_metres(), camera::ray_table{camera});
///   options.initial_pose = se3{view.R_world_camera, zeros<vec3>()};   // of slam::rgbd_system
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/LU>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping {
namespace detail {

struct found_up {
  vec3 up;              ///< unit vector
  double fixing = 0.0;  ///< weight of the normals that determine `up`; the minimum over all directions of tilt
  double along = 0.0;   ///< weight of the normals parallel to `up`
};

/// Weight of a normal at an angle with sine `off`; 1 at 0, and 0 at `reach` and above (Tukey's biweight).
[[nodiscard]] inline double biweight(double off, double reach) noexcept {
  const double t = off / reach;
  const double u = 1.0 - t * t;
  return u > 0 ? u * u : 0.0;
}

/// Weights of the normals that are parallel to `up` (`along`) and perpendicular to it (`across`).
struct up_ballot {
  double along = 0.0, across = 0.0;  ///< weights
  mat3 spread = zeros<mat3>();       ///< scatter of the perpendicular normals minus that of the parallel ones

  up_ballot(std::span<const vec3> normals, const vec3& up, double reach) {
    for (const vec3& n : normals) {
      const double c = dot(n, up);
      if (const double w = biweight(c, reach); w > 0) {
        across += w;
        spread += w * n * transposed(n);
      } else if (const double v = biweight(norm(cross(n, up)), reach); v > 0) {
        along += v;
        spread -= v * n * transposed(n);
      }
    }
  }
};

/// The direction within `max_tilt` radians of -y to which most normals are parallel or perpendicular; empty if there is
/// no such normal, or if a rotated direction fits equally well. O(normals) for each of a few thousand directions.
[[nodiscard]] inline std::optional<found_up> vote_for_up(std::span<const vec3> normals, double max_tilt) {
  constexpr double degree = std::numbers::pi / 180.0;
  const double wide = std::sin(10.0 * degree);
  const auto score = [&](const vec3& up, double reach) {
    double sum = 0.0;
    for (const vec3& n : normals) {
      const double c = dot(n, up), along = c * c;
      // Floors and tables are observed from above. Weight 0.5 for walls, which fit many directions.
      sum += 0.5 * biweight(c, reach) + (c > 0 ? 1.0 : 0.5) * biweight(std::sqrt(std::max(0.0, 1.0 - along)), reach);
    }
    return sum * up.y() * up.y();
  };

  std::optional<vec3> best;
  double best_score = 0.0;
  const double step = 2.5 * degree;
  const int rings = static_cast<int>(std::floor(std::min(max_tilt, 80.0 * degree) / step));
  for (int ring = 0; ring <= rings; ++ring) {
    const double tilt = ring * step;
    const int count = std::max(1, static_cast<int>(std::ceil(2.0 * std::numbers::pi * std::sin(tilt) / step)));
    for (int i = 0; i != count; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / count;
      const vec3 up(std::sin(tilt) * std::cos(turn), -std::cos(tilt), std::sin(tilt) * std::sin(turn));
      if (const double s = score(up, wide); s > best_score) {
        best_score = s;
        best = up;
      }
    }
  }
  if (!best) return std::nullopt;

  vec3 up = *best;
  for (const double reach : {10.0, 8.0, 6.0, 5.0, 5.0, 5.0, 5.0, 5.0}) {
    const symmetric_eigen<3> axes = eigen_of_symmetric<3>(up_ballot{normals, up, std::sin(reach * degree)}.spread);
    const vec3 refined = column_of(axes.vectors, 0);
    up = dot(refined, up) < 0 ? vec3(-refined) : refined;
  }
  if (std::acos(std::clamp(-up.y(), -1.0, 1.0)) > max_tilt + wide) return std::nullopt;
  const up_ballot last{normals, up, std::sin(5.0 * degree)};
  const symmetric_eigen<3> axes = eigen_of_symmetric<3>(last.spread);
  const double fixing = axes.values(1) - axes.values(0);
  if (!(fixing > 0)) return std::nullopt;
  return found_up{up, fixing, last.along};
}

}  // namespace detail

namespace detail {

struct planar_blocks {
  std::vector<vec3> normals;   ///< normals of the flat blocks, in the camera frame, pointing towards the camera
  std::size_t with_depth = 0;  ///< number of blocks with depth in most pixels, flat or not
};

/// Fits a plane to each block of a grid of about 27 x 20 blocks. On a plane `n . p = 1` the inverse depth is linear in
/// the ray: `1 / z = n . (x, y, 1)`. Blocks whose inverse depths deviate by more than a few thousandths, or by 2 % at
/// long range, are not flat; the threshold grows with depth because the depth noise does.
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

}  // namespace detail

/// Information from which the upward direction was determined.
enum class upright_source {
  gravity,  ///< measured gravity, passed by the caller
  floor,    ///< a floor, tables or a ceiling in the depth image, with or without walls
  walls,    ///< at least two walls in different directions, and too little floor
  assumed   ///< no information: the camera is assumed to be level, its -y axis up
};

/// The name of a source: "gravity", "floor", "walls", "assumed".
[[nodiscard]] constexpr std::string_view to_string(upright_source source) noexcept {
  switch (source) {
    case upright_source::gravity: return "gravity";
    case upright_source::floor: return "floor";
    case upright_source::walls: return "walls";
    case upright_source::assumed: return "assumed";
  }
  return "unknown";
}

struct upright_options {
  /// Direction of gravity in the camera frame (x right, y down, z forward), of any length: the negative of the reading
  /// of an accelerometer at rest. Ignored if not finite or zero.
  std::optional<vec3> gravity_camera{};
  double max_tilt = 50.0 * std::numbers::pi / 180.0;  ///< maximum angle between up and the camera's -y axis, radians
  double min_support = 0.06;  ///< minimum share of blocks that determine the direction, among blocks with depth
};

struct upright_view {
  /// Rotates vectors from the camera frame to an upright world: z up, x the horizontal part of the viewing direction.
  so3 R_world_camera;
  upright_source source = upright_source::assumed;
  /// From 0 (assumed) to 1 (gravity): share of blocks that determine the direction, among the image's blocks with
  /// depth. Above 0.2, the error was below 2 degrees in our tests.
  double confidence = 0.0;

  /// The upward direction in the camera frame; a unit vector.
  [[nodiscard]] vec3 up_camera() const { return R_world_camera.inverse() * vec3(0.0, 0.0, 1.0); }
};

/// The rotation to a world with z up in which x is the horizontal part of the viewing direction; `up_camera`: a unit
/// vector in the camera frame. If the camera looks straight down, x points to the top of its image; if it looks
/// straight up, to the bottom.
[[nodiscard]] inline so3 upright_rotation(const vec3& up_camera) {
  vec3 ahead = vec3(0.0, 0.0, 1.0) - up_camera.z() * up_camera;
  if (norm(ahead) < 1e-3) {
    ahead = vec3(0.0, up_camera.z() > 0 ? 1.0 : -1.0, 0.0);
    ahead -= dot(up_camera, ahead) * up_camera;
  }
  ahead = normalized(ahead);
  return so3{rows(ahead, cross(up_camera, ahead), up_camera)};
}

/// Finds the upright world frame for a depth image: from gravity if it is given, otherwise from planes.
///
/// Planes are fitted to a few hundred blocks of a grid, in inverse depth, where a plane is linear and the noise of a
/// disparity sensor is uniform. Each block votes for the directions along its normal (a floor, a table, a ceiling) and
/// perpendicular to it (a wall); directions beyond `max_tilt` are excluded, and those far from the camera's -y axis
/// have less weight. The best direction is refined by least squares over the blocks that agree: the eigenvector of the
/// smallest eigenvalue of `sum(wall normals n n^T) - sum(floor normals n n^T)`. If the image does not determine a
/// direction (no flat surface, or only one wall), the camera is assumed to be level, and `source` is `assumed`.
///
/// The voting of normals for an orthogonal frame is based on J. Straub, O. Freifeld, G. Rosman, J. J. Leonard, J. W.
/// Fisher III, "The Manhattan frame model: Manhattan world inference in the space of surface normals", T-PAMI 40, 2018;
/// here only the upward direction is estimated, so walls need not be perpendicular.
///
/// O(pixels), a few milliseconds for 640 x 480. @pre depth and rays have the same size
template <camera::depth_source Depth>
[[nodiscard]] upright_view find_upright(const Depth& depth, const camera::ray_table& rays,
                                        const upright_options& options = {}) {
  assert(depth.width() == rays.width() && depth.height() == rays.height());
  if (options.gravity_camera && options.gravity_camera->allFinite() && norm(*options.gravity_camera) > 0)
    return {upright_rotation(-options.gravity_camera->normalized()), upright_source::gravity, 1.0};
  const detail::planar_blocks blocks = detail::find_planar_blocks(depth, rays);
  const std::optional<detail::found_up> found = detail::vote_for_up(blocks.normals, options.max_tilt);
  const double all = static_cast<double>(std::max<std::size_t>(blocks.with_depth, 1));
  if (!found || found->fixing < options.min_support * all)
    return {upright_rotation(-vec3(0.0, 1.0, 0.0)), upright_source::assumed, 0.0};
  const bool floor_suffices = found->along >= options.min_support * all;
  return {upright_rotation(found->up), floor_suffices ? upright_source::floor : upright_source::walls,
          std::min(1.0, found->fixing / all)};
}

}  // namespace orbis::mapping
