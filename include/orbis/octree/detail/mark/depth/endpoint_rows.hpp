// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ends of the rays of single pixels and of rows of pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <orbis/camera/depth.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// End of one ray.
struct ray_endpoint {
  enum class fate { none, used, truncated, rejected };
  fate what = fate::none;
  float3 point{};   ///< end point, metres
  voxel_key key{};  ///< voxel that contains the end
  float z = 0.0F;   ///< depth of the end along the optical axis, up to a few rounding errors
};

/// The sensor of one depth image.
struct depth_sensor {
  voxel_grid grid;
  camera::float_pose pose;
  std::optional<voxel_key> key;  ///< voxel of the camera's centre
  double max_range;
  float max_square;  ///< the largest squared distance within range

  depth_sensor(const voxel_grid& g, const se3& T_world_camera, double range)
      : grid{g}, pose{T_world_camera}, max_range{range}, max_square{largest_square(range)} {
    if (is_finite(pose.centre)) key = grid.key(pose.centre);
  }

  /// Returns the end of the ray through (x, y, 1) with measured depth `z`, as point_integrator computes it.
  [[nodiscard]] ray_endpoint end(float x, float y, float z) const noexcept {
    if (!(z > 0.0F) || std::isnan(x)) return {};
    ray_endpoint e{.what = ray_endpoint::fate::used, .point = camera::world_point(pose, x, y, z), .key = {}, .z = z};
    const float3 ray = difference(e.point, pose.centre);
    const double distance = length(ray);
    if (!(distance <= max_range)) {
      const auto scale = static_cast<float>(distance);
      const auto range = static_cast<float>(max_range);
      for (std::size_t i = 0; i != 3; ++i) e.point[i] = pose.centre[i] + rounded_product(ray[i] / scale, range);
      e.z = z * (range / scale);
      e.what = std::isfinite(scale) ? ray_endpoint::fate::truncated : ray_endpoint::fate::rejected;
    }
    if (const auto k = grid.key(e.point))
      e.key = *k;
    else
      e.what = ray_endpoint::fate::rejected;
    return e;
  }
  /// Lower corner of a voxel, relative to the camera's centre, metres in the world frame.
  [[nodiscard]] float3 corner(const voxel_key& k) const {
    const double half = 0.5 * grid.resolution();
    const auto along = [&](std::uint32_t c, float centre) {
      return static_cast<float>((grid.center(c) - half) - static_cast<double>(centre));
    };
    return {along(k.x, pose.centre[0]), along(k.y, pose.centre[1]), along(k.z, pose.centre[2])};
  }

 private:
  /// Largest float whose square root (in double) is at most `range`.
  [[nodiscard]] static float largest_square(double range) noexcept {
    constexpr float most = std::numeric_limits<float>::infinity();
    if (std::isinf(range)) return most;
    auto square = static_cast<float>(range * range);
    while (square > 0.0F && std::sqrt(static_cast<double>(square)) > range) square = std::nextafter(square, 0.0F);
    for (float next; std::sqrt(static_cast<double>(next = std::nextafter(square, most))) <= range;) square = next;
    return square;
  }
};

/// A row of pixels during the conversion from depths to ends. Every array holds `width` values and is padded.
struct end_row {
  int width = 0;
  const float* x = nullptr;
  const float* y = nullptr;
  bool one_y = false;  ///< true if y points to a single value for the whole row
  float* z = nullptr;  ///< in: metres, 0 if missing; out: depth of the ray's end, 0 if the ray is ignored
  std::array<std::int32_t*, 3> key{};  ///< out: voxels of used ends, -1 for other pixels
};

/// Counts of a row or an image.
struct end_counts {
  std::size_t used = 0, truncated = 0, rejected = 0;
  bool leaves = false;  ///< true if a ray ends outside the voxel of the camera's centre
  float max_z = 0.0F;
  double sum_z = 0.0;  ///< sum of the end depths of the used and truncated rays, up to rounding

  void add(const end_counts& o) noexcept {
    used += o.used;
    truncated += o.truncated;
    rejected += o.rejected;
    leaves = leaves || o.leaves;
    max_z = std::max(max_z, o.max_z);
    sum_z += o.sum_z;
  }
};

/// Computes the ends of a row of rays.
struct find_ends_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    using mask = typename floats::mask_type;
    constexpr int n = static_cast<int>(floats::count);
    const double per_metre = 1.0 / s.grid.resolution(), half = 0.5 * s.grid.cells();
    const auto per_metre_f = static_cast<float>(per_metre), half_f = static_cast<float>(half);
    const auto range = static_cast<float>(s.max_range);
    const voxel_key from = s.key.value_or(voxel_key{});
    const integers from_x(static_cast<std::int32_t>(from.x)), from_y(static_cast<std::int32_t>(from.y));
    const integers from_z(static_cast<std::int32_t>(from.z)), no_key(-1), middle(static_cast<std::int32_t>(half));
    const std::array<float, 3>& o = s.pose.centre;
    mask leaves = mask::first(0);
    floats max_z(0.0F), sum_z(0.0F);
    std::size_t used_count = 0, truncated_count = 0, rejected_count = 0;
    for (int u = 0; u < row.width; u += n) {
      const floats z = floats::load(row.z + u), x = floats::load(row.x + u);
      const floats y = row.one_y ? floats(*row.y) : floats::load(row.y + u);
      const mask valid = (z > 0.0F) & (x == x);
      // This is the same arithmetic as in camera::world_point.
      const floats cx = x * z, cy = y * z;
      const auto along = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
        const std::array<float, 3>& r = s.pose.rows[i];
        return r[0] * cx + r[1] * cy + r[2] * z + floats(o[i]);
      };
      floats px = along(0), py = along(1), pz = along(2), end_z = z;
      const floats dx = px - o[0], dy = py - o[1], dz = pz - o[2];
      const floats square = dx * dx + dy * dy + dz * dz;
      const mask within = square <= s.max_square;
      mask good = valid;
      if (any(and_not(valid, within))) {
        // The square root of a float, computed in double and rounded, equals the root computed in float.
        const floats scale = sqrt(square);
        px = select(within, px, o[0] + dx / scale * range);
        py = select(within, py, o[1] + dy / scale * range);
        pz = select(within, pz, o[2] + dz / scale * range);
        end_z = select(within, z, z * (range / scale));
        good = good & (within | (scale < std::numeric_limits<float>::infinity()));
      }
      mask sure = good;
      integers kx = likely_keys(px, per_metre_f, half_f, sure), ky = likely_keys(py, per_metre_f, half_f, sure);
      integers kz = likely_keys(pz, per_metre_f, half_f, sure);
      if (any(good ^ sure)) {
        kx = cells_along(px, per_metre, half, good) + middle;
        ky = cells_along(py, per_metre, half, good) + middle;
        kz = cells_along(pz, per_metre, half, good) + middle;
      }
      const mask used = good & within;
      const std::size_t good_count = simd::popcount(good), used_here = simd::popcount(used);
      used_count += used_here;
      truncated_count += good_count - used_here;
      rejected_count += simd::popcount(valid) - good_count;
      leaves = leaves | (good & ((kx != from_x) | (ky != from_y) | (kz != from_z)));
      end_z = select(good, end_z, floats(0.0F));
      max_z = max(max_z, end_z);
      sum_z += end_z;
      end_z.store(row.z + u);
      select(used, kx, no_key).store(row.key[0] + u);
      select(used, ky, no_key).store(row.key[1] + u);
      select(used, kz, no_key).store(row.key[2] + u);
    }
    counts.max_z = std::max(counts.max_z, greatest(max_z));
    counts.sum_z += sum(simd::convert<double>(sum_z));
    counts.used += used_count;
    counts.truncated += truncated_count;
    counts.rejected += rejected_count;
    counts.leaves = counts.leaves || (s.key && any(leaves));
  }
};

/// Returns a mask for 16 pixels; bit i is set if the voxel of pixel `u + i` differs from that of the previous pixel and
/// from that of the pixel above. `key[i][-1]` and `above[i]` must be readable; pixels without a voxel have -1.
struct fresh_keys_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE unsigned run(const std::array<const std::int32_t*, 3>& key,
                                          const std::array<const std::int32_t*, 3>& above, int u) noexcept {
    using integers = simd::native_vec<std::int32_t, Target>;
    unsigned fresh = 0;
    for (int i = 0; i != 16; i += static_cast<int>(integers::count)) {
      const integers x = integers::load(key[0] + u + i), y = integers::load(key[1] + u + i);
      const integers z = integers::load(key[2] + u + i);
      const auto differ = [&](const std::array<const std::int32_t*, 3>& from, int at) ORBIS_INLINE_LAMBDA {
        return (x != integers::load(from[0] + at)) | (y != integers::load(from[1] + at)) |
               (z != integers::load(from[2] + at));
      };
      fresh |= simd::bits(differ(key, u + i - 1) & differ(above, u + i) & (x != integers(-1))) << i;
    }
    return fresh;
  }
};

/// Type of the values stored by a depth_view.
template <class T>
T stored_type(const camera::depth_view<T>&);

/// Conversion of a row of stored depths to metres, 0 where there is no measurement; see depth_view::operator().
/// `metres` has room for 15 more values.
template <class T>
struct metres_row {
  const T* stored;
  float* metres;
  int width;
  float scale, min, max;
};

template <class T>
struct to_metres_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const metres_row<T>& row) noexcept {
    using floats = simd::native_vec<float, Target>;
    using stored_depths = simd::vec<T, floats::count, Target>;
    constexpr int n = static_cast<int>(floats::count);
    constexpr float none = std::same_as<T, float> ? std::numeric_limits<float>::infinity()
                                                  : static_cast<float>(std::numeric_limits<T>::max());
    for (int u = 0; u < row.width; u += n) {
      const T* const p = row.stored + u;
      const auto raw =
          u + n <= row.width ? stored_depths::load(p) : stored_depths::load(p, static_cast<std::size_t>(row.width - u));
      const floats stored = simd::convert<float>(raw), z = stored / row.scale;
      const auto valid = (stored > 0.0F) & (stored < none) & (z >= row.min) & (z <= row.max);
      select(valid, z, floats(0.0F)).store(row.metres + u);
    }
  }
};

}  // namespace orbis::octree::detail
