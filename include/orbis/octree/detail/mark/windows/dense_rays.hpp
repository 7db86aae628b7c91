// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the voxels that many rays of a point cloud cross, voxel by voxel instead of ray by ray.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_descent.hpp>
#include <orbis/octree/detail/mark/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/mark/depth/first_steps.hpp>
#include <orbis/octree/detail/mark/depth/view_frame.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/mark/rays/scan_sample.hpp>
#include <orbis/octree/detail/mark/windows/binned_rays.hpp>
#include <orbis/octree/detail/mark/windows/cell_tests.hpp>
#include <orbis/octree/detail/mark/windows/direction_windows.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// One window of a scan, prepared for the descent.
template <class = void>
struct basic_window_frame : view_frame {
  using sample_kernel = unsigned(const depth_scene&, const window_rays&, const child_offsets&, const float3&,
                                 const children&, unsigned);
  using test_kernel = bool(const depth_scene&, const window_rays&, const voxel_test&, const pixel_box&, float,
                           std::vector<std::uint32_t>&);

  chosen_kernel<sample_cells_kernel, sample_kernel, simd::avx2> sample;
  chosen_kernel<test_cells_kernel, test_kernel> test_cells;
  depth_sensor sensor{voxel_grid{1.0}, se3{}, 0.0};
  window_rays rays;

  /// Sets the window and its rays. @pre there are rays in the window
  void set_window(const direction_window& w, float cell, const window_rays& of) {
    rays = of;
    for (std::size_t i = 0; i != 3; ++i) sensor.pose.rows[i] = {w.axes[0][i], w.axes[1][i], w.axes[2][i]};
    const float focal = 1.0F / cell;
    scene.map = nullptr;
    set_view(sensor,
             {focal, focal, -w.min_x * focal - 0.5F, -w.min_y * focal - 0.5F, w.width, w.height, w.min_x,
              w.min_x + static_cast<float>(w.width) * cell, w.min_y, w.min_y + static_cast<float>(w.height) * cell});
    // The rays of a cell can be anywhere in the cell.
    scene.pixel_margin += 0.5F + 4e-6F * focal;
    scene.tiles = {2.05F, 4.1F, 8.2F};
    set_spacing(half_diagonal());
  }
  /// Maximum distance of a ray from the centre of its cell, in cells.
  [[nodiscard]] float room() const noexcept { return 0.51F + 4e-6F * scene.fx; }
};
using window_frame = basic_window_frame<>;

/// Rays of a window for the descent, see depth_rays. `EndOf`: returns the ray_endpoint of a ray.
template <class EndOf>
struct cell_rays {
  const window_frame& frame;
  const EndOf& end_of;

  [[nodiscard]] unsigned sample(const child_offsets& o, const float3& world, const children& c, unsigned wanted) const {
    return frame.sample(frame.scene, frame.rays, o, world, c, wanted);
  }
  [[nodiscard]] bool test(const voxel_test& t, const pixel_box& box, float near_z,
                          std::vector<std::uint32_t>& unsure) const {
    return frame.test_cells(frame.scene, frame.rays, t, box, near_z, unsure);
  }
  [[nodiscard]] bool may_cross(const voxel_test& t, const pixel_box& part, std::int32_t, std::int32_t,
                               std::int32_t) const {
    const auto [x0, x1, y0, y1] = frame.bounds(part, frame.room());
    return t.may_cross(x0, x1, y0, y1);
  }
  [[nodiscard]] bool visits(std::uint32_t number, const voxel_key& voxel) const {
    return crosses(frame.sensor, end_of(number), voxel);
  }
};

/// Collects the rays of a scan and marks their voxels. Reuses its memory between scans.
template <class = void>
class basic_dense_rays {
 public:
  /// Decides from a sample of the scan's points whether the rays are dense enough for this method, and if so prepares
  /// it. O(1). `limit`: maximum length of rays, metres
  template <class Point>
  [[nodiscard]] bool plan(const voxel_grid& grid, const float3& origin, std::size_t count, Point&& point,
                          double limit) {
    if (count < fewest_rays || count > binned_rays::most_rays) return false;
    sample(origin, count, point, limit);
    if (sample_.directions.size() < most_sampled / 16) return false;
    const std::size_t rays = count / most_sampled * sample_.directions.size();
    windows_.fit(sample_, rays, cell_edge * grid.resolution() / sample_.length, fewest_in_cell, most_in_cell);
    return is_worthwhile(grid.resolution());
  }
  /// Starts a planned scan, to which `workers` threads add rays.
  void start(const float3& origin, std::size_t count, std::size_t workers) {
    rays_.start(windows_, origin, count, workers);
  }
  /// Adds the rays of a batch, see binned_rays::add.
  void add(std::size_t worker, ray_batch& rays, std::size_t first, std::size_t count) {
    rays_.add(worker, rays, first, count);
  }
  /// Marks the voxels of the added rays. Voxels that a miss would not change according to `saturated` may be missing,
  /// see depth_integrator::mark, as may those that are occupied in `masks`. Returns false, and marks nothing, if rays
  /// come too close to the border of the grid. `end_of(i)`: the ray_endpoint of the i-th point.
  template <execution_policy Policy, class Range, class EndOf, class Saturated>
  [[nodiscard]] bool mark(const Policy& policy, const depth_sensor& sensor, Range&& range, const EndOf& end_of,
                          scan_masks& masks, const Saturated& saturated) {
    rays_.sort(policy, range);
    if (rays_.size() == 0) return true;
    bool on_face = false;
    for (std::size_t i = 0; i != direction_windows::faces; ++i) {
      window_frame& f = frames_[i];
      f.nodes.clear();
      const direction_window& w = windows_.window[i];
      if (w.width == 0) continue;
      f.sensor = sensor;
      f.set_window(w, windows_.cell, rays_.window(w));
      const auto bounds = f.ray_bounds(f.sensor, rays_.max_z());
      if (!bounds) return false;
      f.pyramid.build(w.width, w.height, rays_.max_z(),
                      [&](int v) { return f.rays.z + static_cast<std::ptrdiff_t>(v) * w.stride; });
      f.list_nodes(f.sensor, bounds->first, bounds->second);
      on_face = on_face || f.is_on_face(f.sensor);
    }
    for (const window_frame& f : frames_)
      if (!f.nodes.empty())
        descend_nodes(policy, f, f.sensor, cell_rays<EndOf>{f, end_of}, on_face, masks, saturated, workers_);
    masks.mark_free(*sensor.key);
    if (on_face) walk_first_steps(sensor, end_of, masks);
    return true;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + sample_.directions.capacity() * sizeof(vec3) +
                        workers_.capacity() * sizeof(descent_worker);
    for (const window_frame& f : frames_) bytes += f.memory_bytes();
    for (const descent_worker& w : workers_) bytes += w.memory_bytes();
    return bytes;
  }

 private:
  static constexpr std::size_t fewest_rays = 4096;
  static constexpr std::size_t most_sampled = 1024;
  static constexpr double cell_edge = 0.25;  ///< edge of a cell at the ends of the rays, in voxels
  static constexpr double fewest_in_cell = 2.0, most_in_cell = 16.0;  ///< bounds on the average number of rays per cell

  template <class EndOf>
  void walk_first_steps(const depth_sensor& sensor, const EndOf& end_of, scan_masks& masks) const {
    first_voxels around{sensor};
    const first_step_order order{sensor};
    for (const window_frame& f : frames_) {
      if (f.nodes.empty()) continue;
      const auto for_each = [&](const pixel_box& box, auto&& use) {
        for (std::int32_t v = box.v0; v <= box.v1; ++v) {
          const std::uint32_t* const row = f.rays.begin + static_cast<std::ptrdiff_t>(v) * f.rays.stride;
          for (std::uint32_t i = row[box.u0]; i != row[box.u1 + 1]; ++i)
            if (!use(end_of(f.rays.sorted[i].number))) return;
        }
      };
      around.add(
          order, f.all_pixels(), [&](const pixel_box& box) { return f.directions(box, f.room()); }, for_each);
    }
    around.mark(masks);
  }
  /// Returns true if this method is faster than a traversal, according to measured costs in nanoseconds per ray: a
  /// traversal has a constant cost per plane of voxels that the ray crosses; this method has a constant cost per ray,
  /// and a cost for the voxels that it must test individually, which increases as the rays become sparser.
  [[nodiscard]] bool is_worthwhile(double voxel) const {
    // `apart`: spacing of the rays at their ends, in voxels.
    const double planes = sample_.length / voxel, apart = windows_.spacing * planes;
    return 6.0 + 300.0 * apart * apart < 20.0 + 0.5 * planes;
  }
  template <class Point>
  void sample(const float3& origin, std::size_t count, Point&& point, double limit) {
    sample_.directions.clear();
    sample_.length = 0.0;
    random_bits random{1};
    for (std::size_t k = 0; k != most_sampled; ++k) {
      const std::size_t i = place_in_stretch(k, most_sampled, count - 1, random);
      vec3 d;
      const auto length = length_of_ray(origin, point(i), limit, d);
      if (!length) continue;
      sample_.directions.push_back(d);
      sample_.length += *length;
    }
    sample_.length /= static_cast<double>(std::max<std::size_t>(1, sample_.directions.size()));
  }

  sampled_rays sample_;
  direction_windows windows_;
  binned_rays rays_;
  std::array<window_frame, direction_windows::faces> frames_;
  std::vector<descent_worker> workers_;
};
using dense_rays = basic_dense_rays<>;

}  // namespace orbis::octree::detail
