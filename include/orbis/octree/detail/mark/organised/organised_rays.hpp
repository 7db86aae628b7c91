// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the voxels that the rays of an organised point cloud cross, in the same way as for a depth image. The points
/// of such a cloud are the pixels of a depth image, in pixel order; this is inferred from the points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_frame.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/first_steps.hpp>
#include <orbis/octree/detail/mark/organised/pinhole_fit.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Image to whose pixels rays are assigned.
struct pixel_placement {
  static constexpr std::int32_t nowhere = -1;

  float3 origin{};
  std::array<float3, 3> axes{};  ///< x, y and z axes of the camera, in the world frame
  float fx = 1, fy = 1, cx = 0, cy = 0;
  float last_u = 0, last_v = 0;    ///< last column and row
  float error_u = 0, error_v = 0;  ///< maximum distance of a ray from the centre of its pixel
  float far = 0;  ///< rays that end beyond this depth, where they are far apart, are traversed one by one
  std::int32_t stride = 0;
};

/// Part of the image in which rays were placed, and their greatest depth; max_z = 0: no rays.
struct placed_part {
  float max_z = 0.0F;
  float u0 = std::numeric_limits<float>::infinity(), u1 = -u0, v0 = u0, v1 = u1;

  void add(const placed_part& p) noexcept {
    max_z = std::max(max_z, p.max_z);
    u0 = std::min(u0, p.u0), u1 = std::max(u1, p.u1);
    v0 = std::min(v0, p.v0), v1 = std::max(v1, p.v1);
  }
};

/// Places the first `count` rays of a batch: stores their pixels, as row * stride + column, and the depths at which
/// they end, in whole vectors. Sets bit i of `left_out` if ray i is not at the centre of a pixel or ends too far away.
struct place_in_pixels_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE placed_part run(const pixel_placement& t, const ray_batch& rays, std::size_t count,
                                             std::int32_t* pixels, float* depths, ray_batch::bits& left_out) noexcept {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    using mask = typename floats::mask_type;
    constexpr std::size_t n = floats::count;
    left_out = {};
    constexpr float none = std::numeric_limits<float>::infinity();
    floats max_z(0.0F), u0(none), u1(-none), v0(none), v1(-none);
    for (std::size_t i = 0; i < count; i += n) {
      const ray_lanes<Target> r{rays, t.origin, i};
      const mask valid = r.leaves;
      const floats z = r.along(t.axes[2]), per_z = 1.0F / z;
      const floats at_u = simd::approximate_multiply_add(floats(t.fx), r.along(t.axes[0]) * per_z, floats(t.cx));
      const floats at_v = simd::approximate_multiply_add(floats(t.fy), r.along(t.axes[1]) * per_z, floats(t.cy));
      const floats u = floor(at_u + 0.5F), v = floor(at_v + 0.5F);
      const mask placed = valid & (z > std::numeric_limits<float>::min()) & (z <= t.far) &
                          (abs(at_u - u) <= t.error_u) & (abs(at_v - v) <= t.error_v) & (u >= 0.0F) & (v >= 0.0F) &
                          (u <= t.last_u) & (v <= t.last_v);
      max_z = max(max_z, select(placed, z, floats(0.0F)));
      u0 = min(u0, select(placed, u, floats(none)));
      u1 = max(u1, select(placed, u, floats(-none)));
      v0 = min(v0, select(placed, v, floats(none)));
      v1 = max(v1, select(placed, v, floats(-none)));
      const integers pixel = simd::convert<std::int32_t>(select(placed, v, floats(0.0F))) * integers(t.stride) +
                             simd::convert<std::int32_t>(select(placed, u, floats(0.0F)));
      select(placed, pixel, integers(pixel_placement::nowhere)).store(pixels + i);
      z.store(depths + i);
      left_out[i >> 6U] |= std::uint64_t{simd::bits(and_not(valid, placed))} << (i & 63U);
    }
    return {greatest(max_z), -greatest(-u0), greatest(u1), -greatest(-v0), greatest(v1)};
  }
};

using place_in_pixels = placed_part(const pixel_placement&, const ray_batch&, std::size_t, std::int32_t*, float*,
                                    ray_batch::bits&);

/// Collects the rays of a scan and marks their voxels. Reuses its memory between scans.
template <class = void>
class basic_organised_rays {
 public:
  /// Decides whether the scan's points are the pixels of a depth image that is dense enough for this method, and if so
  /// prepares the method. O(1). `limit`: maximum length of rays, metres
  template <class Point>
  [[nodiscard]] bool plan(const voxel_grid& grid, const float3& origin, std::size_t count, Point&& point,
                          double limit) {
    if (count < fewest_rays || count > most_rays || !fit_.fit(origin, count, point, limit)) return false;
    voxel_ = grid.resolution();
    // If scattered pixels have no points, the remaining points are further apart; contiguous holes matter less. For
    // sparse images dense_rays is better, because its cells contain several rays.
    if (fit_.filled() < 0.4) return false;
    const double filled = std::min(1.0, 1.25 * fit_.filled());
    return depth_frame::is_dense(fit_.mean_z(), voxel_, focal() * std::sqrt(filled));
  }
  /// Starts a planned scan, to which `workers` threads add rays.
  void start(const float3& origin, std::size_t count, std::size_t workers) {
    const camera::pinhole& camera = fit_.camera();
    ends_ = frame_.ends.lay_out(camera.width(), camera.height());
    pose_ = {fit_.rotation(),
             vec3{static_cast<double>(origin[0]), static_cast<double>(origin[1]), static_cast<double>(origin[2])}};
    const camera::float_pose pose{pose_};
    const auto& k = camera.k();
    placement_ = {.origin = origin,
                  .fx = static_cast<float>(k.fx),
                  .fy = static_cast<float>(k.fy),
                  .cx = static_cast<float>(k.cx),
                  .cy = static_cast<float>(k.cy),
                  .last_u = static_cast<float>(k.width - 1),
                  .last_v = static_cast<float>(k.height - 1),
                  .error_u = static_cast<float>(fit_.error() * k.fx),
                  .error_v = static_cast<float>(fit_.error() * k.fy),
                  .far = static_cast<float>(2.0 * voxel_ * focal()),
                  .stride = static_cast<std::int32_t>(frame_.ends.stride())};
    for (std::size_t i = 0; i != 3; ++i)
      for (std::size_t axis = 0; axis != 3; ++axis) placement_.axes[axis][i] = pose.rows[i][axis];
    count_ = count;
    pixel_.resize(count + ray_batch::capacity);
    z_.resize(count + ray_batch::capacity);
    parts_.assign(workers, {});
    numbers_.resize(ends_.size());
    place_ = simd::kernel<place_in_pixels_kernel, place_in_pixels>();
  }
  /// Adds the rays of a batch of `count` points, the first of which is point `first` of the scan. The rays that must be
  /// traversed one by one remain in `rays`. Several workers can call it concurrently.
  /// @pre `count` is a multiple of a vector's size, except for the last batch of the scan
  void add(std::size_t worker, ray_batch& rays, std::size_t first, std::size_t count) {
    ray_batch::bits left_out;
    parts_[worker].add(place_(placement_, rays, count, pixel_.data() + first, z_.data() + first, left_out));
    rays.keep(left_out);
  }
  /// Marks the voxels of the added rays. Voxels that a miss would not change according to `saturated` may be missing,
  /// see depth_integrator::mark, as may those that are occupied in `masks`. Returns false, and marks nothing, if rays
  /// come too close to the border of the grid, or if many rays share a pixel. `end_of(i)`: the ray_endpoint of the i-th
  /// point. (The unused range makes the signature the same as that of dense_rays::mark.)
  template <execution_policy Policy, class Range, class EndOf, class Saturated>
  [[nodiscard]] bool mark(const Policy& policy, const depth_sensor& scan, Range&&, const EndOf& end_of,
                          scan_masks& masks, const Saturated& saturated) {
    fill_image(policy);
    std::size_t second = 0;
    for (const auto& s : second_) second += s.size();
    if (second > count_ / 64) return false;
    placed_part all;
    for (const placed_part& p : parts_) all.add(p);
    if (!(all.max_z > 0.0F)) return true;
    const std::uint32_t first = crop(all);
    const depth_sensor sensor{scan.grid, pose_, scan.max_range};
    frame_.set_scene(sensor, ray_error());
    const auto bounds = frame_.ray_bounds(sensor, all.max_z);
    if (!bounds) return false;
    const auto end_at = [&](int u, int v) { return end_of(numbers_[first + frame_.ends.number(u, v)]); };
    if (mark_image(policy, frame_, sensor, all.max_z, *bounds, end_at, masks, saturated))
      walk_first_steps(sensor, end_at, masks);
    for (const auto& s : second_)
      for (const std::uint32_t number : s) {
        const ray_endpoint e = end_of(number);
        mark_ray(masks, sensor.grid, sensor.pose.centre, *sensor.key, e.point, e.key);
      }
    return true;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = fit_.memory_bytes() + frame_.memory_bytes() + parts_.capacity() * sizeof(placed_part) +
                        (pixel_.capacity() + z_.capacity() + numbers_.capacity()) * sizeof(float);
    for (const auto& s : second_) bytes += s.capacity() * sizeof(s[0]);
    return bytes;
  }

 private:
  static constexpr std::size_t fewest_rays = 4096, most_rays = std::size_t{1} << 24U;

  /// The smaller of the two focal lengths, which determines the largest distance between rays.
  [[nodiscard]] double focal() const { return std::min(fit_.camera().k().fx, fit_.camera().k().fy); }
  /// The part of the rays' error that exceeds the allowance in depth_scene. The allowance includes 10 u |c|_1 for the
  /// rounding of points, which must not be counted twice, and 19 u |c|_1 in reserve. A ray may deviate along both x and
  /// y, so by sqrt(2) times the error in total; the float coordinates have errors of about 7 u, plus the rounding of cx
  /// and cy.
  [[nodiscard]] float ray_error() const {
    constexpr double u = 0x1p-24;
    const auto& k = fit_.camera().k();
    const double centre = std::max(k.cx / k.fx, k.cy / k.fy);
    return static_cast<float>(std::max(0.0, 1.5 * fit_.error() + (7.0 + 3.0 * centre - 29.0) * u));
  }
  /// Crops the image to the part in which rays were placed. Returns the index of the pixel that becomes the first one.
  std::uint32_t crop(const placed_part& p) {
    camera::intrinsics k = fit_.camera().k();
    k.width = static_cast<int>(p.u1 - p.u0) + 1;
    k.height = static_cast<int>(p.v1 - p.v0) + 1;
    k.cx -= static_cast<double>(p.u0);
    k.cy -= static_cast<double>(p.v0);
    const std::uint32_t first = frame_.ends.number(static_cast<int>(p.u0), static_cast<int>(p.v0));
    frame_.ends.crop(camera::pinhole{k}, first);
    return first;
  }
  /// Stores the depth and the index of each pixel's first ray; additional rays go to `second_`. Uses one thread per
  /// band of rows.
  template <class Policy>
  void fill_image(const Policy& policy) {
    const std::size_t bands = parts_.size();
    second_.resize(std::max(second_.size(), bands));
    for (auto& s : second_) s.clear();
    for_each_index(policy, bands, 1, [&](std::size_t band) {
      const auto begin = static_cast<std::uint32_t>(ends_.size() * band / bands);
      const auto size = static_cast<std::uint32_t>(ends_.size() * (band + 1) / bands) - begin;
      std::vector<std::uint32_t>& second = second_[band];
      std::fill_n(ends_.data() + begin, size, 0.0F);
      for (std::size_t i = 0; i != count_; ++i) {
        const std::uint32_t at = static_cast<std::uint32_t>(pixel_[i]) - begin;
        if (at >= size) continue;
        const std::uint32_t pixel = at + begin;
        if (ends_[pixel] != 0.0F) {
          second.push_back(static_cast<std::uint32_t>(i));
          continue;
        }
        ends_[pixel] = z_[i];
        numbers_[pixel] = static_cast<std::uint32_t>(i);
      }
    });
  }
  template <class EndAt>
  void walk_first_steps(const depth_sensor& sensor, const EndAt& end_at, scan_masks& masks) const {
    first_voxels around{sensor};
    const auto for_each = [&](const pixel_box& box, auto&& use) {
      for (std::int32_t v = box.v0; v <= box.v1; ++v)
        for (std::int32_t u = box.u0; u <= box.u1; ++u)
          if (frame_.ends.z(v)[u] > 0.0F && !use(end_at(u, v))) return;
    };
    const float room = frame_.scene.pixel_margin;
    around.add(
        first_step_order{sensor}, frame_.all_pixels(),
        [&](const pixel_box& box) { return frame_.directions(box, room); }, for_each);
    around.mark(masks);
  }

  pinhole_fit fit_;
  double voxel_ = 0.0;
  depth_frame frame_;
  se3 pose_;
  pixel_placement placement_;
  place_in_pixels* place_ = nullptr;
  std::span<float> ends_;                           ///< depths of the image in frame_, before it is cropped
  std::size_t count_ = 0;                           ///< number of rays
  std::vector<std::int32_t> pixel_;                 ///< pixel of each ray
  std::vector<float> z_;                            ///< depth of the end of each ray
  std::vector<placed_part> parts_;                  ///< part of the image in which each worker placed rays
  std::vector<std::uint32_t> numbers_;              ///< for each pixel that has a ray, the index of the ray
  std::vector<std::vector<std::uint32_t>> second_;  ///< additional rays of occupied pixels, for each band of rows
};
using organised_rays = basic_organised_rays<>;

}  // namespace orbis::octree::detail
