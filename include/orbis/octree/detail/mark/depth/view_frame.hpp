// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A view of rays from one point, prepared for the descent through the octree: the pyramid over their ends, and the
/// initial nodes.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/node_classifier.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>

namespace orbis::octree::detail {

/// Extent of the rays of a view at z = 1, and their pixels: focal * (x, y) + center.
struct view_extent {
  float fx, fy, cx, cy;
  int width, height;
  float min_x, max_x, min_y, max_y;
};

/// A view and the nodes at which its descent starts. Call set_view, build `pyramid`, and then call list_nodes. Reuses
/// its memory between views.
template <class = void>
struct basic_view_frame {
  using classify_kernel = void(const depth_scene&, const child_offsets&, const float3&, bool, children&);
  static constexpr int list_level = 5;  ///< level of the nodes that are distributed to the threads

  struct node {
    voxel_key key;
    float3 center;  ///< in the camera frame
    bool inside;    ///< true if the node projects into the image
  };

  // Kernels with eight lanes are no faster on AVX-512.
  chosen_kernel<classify_children_kernel, classify_kernel, simd::avx2> classify;
  depth_pyramid pyramid;
  depth_scene scene;
  std::vector<child_offsets> offsets;  ///< for each level, offsets of a node's children
  std::vector<node> nodes;             ///< nodes at list_level that rays may touch

  /// Computes the test parameters that depend on the view; the caller sets those that depend on the rays. `ray_error`:
  /// maximum deviation of rays from their assumed directions, at z = 1.
  void set_view(const depth_sensor& sensor, const view_extent& e, float ray_error = 0.0F) {
    depth_scene& s = scene;
    const auto& rows = sensor.pose.rows;
    for (std::size_t i = 0; i != 3; ++i) {
      s.x_axis[i] = rows[i][0];
      s.y_axis[i] = rows[i][1];
      s.z_axis[i] = rows[i][2];
    }
    s.fx = e.fx;
    s.fy = e.fy;
    s.per_fx = 1.0F / s.fx;
    s.per_fy = 1.0F / s.fy;
    s.cx = e.cx;
    s.cy = e.cy;
    s.last_u = static_cast<float>(e.width - 1);
    s.last_v = static_cast<float>(e.height - 1);
    s.min_x = e.min_x;
    s.max_x = e.max_x;
    s.min_y = e.min_y;
    s.max_y = e.max_y;
    constexpr float u = 0x1p-24F;
    float l1 = 0.0F;
    for (const float c : sensor.pose.centre) l1 += std::fabs(c);
    s.voxel = static_cast<float>(sensor.grid.resolution());
    s.margin_0 = u * (8.0F * l1 + 8.0F * s.voxel);
    s.margin_1 = 64.0F * u + ray_error;
    s.pixel_margin = 0.01F + 1e-6F * (s.last_u + s.last_v) + ray_error * std::max(s.fx, s.fy);
    s.near_z = 0.1F * s.voxel;
    const float slope = 2.0F * (1.0F + std::max(std::fabs(s.min_x), std::fabs(s.max_x)) +
                                std::max(std::fabs(s.min_y), std::fabs(s.max_y)));
    s.ball = 0.5F * s.voxel - 2.0F * s.margin_0;
    s.ball_slope = 2.0F * s.margin_1 * slope;
    s.pyramid = &pyramid;
  }
  [[nodiscard]] pixel_box all_pixels() const noexcept {
    return {0, static_cast<std::int32_t>(scene.last_u), 0, static_cast<std::int32_t>(scene.last_v)};
  }
  /// Bounds of rays at z = 1.
  struct bounds_at_1 {
    float x0, x1, y0, y1;
  };
  /// Bounds of the rays of a box of pixels. `room`: maximum distance of a ray from the centre of its pixel, in pixels.
  [[nodiscard]] bounds_at_1 bounds(const pixel_box& box, float room) const noexcept {
    const auto edge = [&](std::int32_t pixel, float off, float centre, float per_f) {
      return (static_cast<float>(pixel) + off - centre) * per_f;
    };
    return {edge(box.u0, -room, scene.cx, scene.per_fx), edge(box.u1, room, scene.cx, scene.per_fx),
            edge(box.v0, -room, scene.cy, scene.per_fy), edge(box.v1, room, scene.cy, scene.per_fy)};
  }
  /// Smallest and greatest coordinates of the rays' directions in the world frame.
  [[nodiscard]] std::pair<float3, float3> directions(const pixel_box& box, float room) const noexcept {
    const auto [x0, x1, y0, y1] = bounds(box, room);
    std::pair<float3, float3> range;
    for (std::size_t i = 0; i != 3; ++i) {
      const float middle = 0.5F * ((x0 + x1) * scene.x_axis[i] + (y0 + y1) * scene.y_axis[i]) + scene.z_axis[i];
      const float half = 0.5F * ((x1 - x0) * std::fabs(scene.x_axis[i]) + (y1 - y0) * std::fabs(scene.y_axis[i]));
      range.first[i] = middle - half;
      range.second[i] = middle + half;
    }
    return range;
  }
  /// Half the diagonal of a pixel at z = 1.
  [[nodiscard]] float half_diagonal() const noexcept {
    return 0.5F * std::sqrt(1.0F / (scene.fx * scene.fx) + 1.0F / (scene.fy * scene.fy));
  }
  /// Sets the maximum distance from a direction in the view to the nearest ray, ignoring pixels without an end.
  void set_spacing(float spacing) noexcept {
    for (std::size_t kind = 0; kind != 3; ++kind) scene.dense_z[kind] = scene.dense(kind, spacing);
  }
  /// Lowest and highest voxel of a box around all rays; empty if the box is close to the border of the grid, where ray
  /// traversals may end early.
  [[nodiscard]] std::optional<std::pair<voxel_key, voxel_key>> ray_bounds(const depth_sensor& sensor,
                                                                          float max_z) const {
    std::array<std::array<std::uint32_t, 2>, 3> range;
    for (std::size_t i = 0; i != 3; ++i) {
      const double centre = static_cast<double>(sensor.pose.centre[i]);
      double low = centre, high = centre;
      for (const float x : {scene.min_x, scene.max_x})
        for (const float y : {scene.min_y, scene.max_y}) {
          const double reach =
              static_cast<double>(max_z) *
              (static_cast<double>(scene.x_axis[i]) * static_cast<double>(x) +
               static_cast<double>(scene.y_axis[i]) * static_cast<double>(y) + static_cast<double>(scene.z_axis[i]));
          low = std::min(low, centre + reach * 1.00001);
          high = std::max(high, centre + reach * 1.00001);
        }
      const double room = 2.0 * sensor.grid.resolution() + 1e-5 * (std::fabs(centre) + (high - low));
      const auto first = sensor.grid.key(low - room), last = sensor.grid.key(high + room);
      if (!first || !last) return std::nullopt;
      range[i] = {*first, *last};
    }
    return std::pair{voxel_key{range[0][0], range[1][0], range[2][0]},
                     voxel_key{range[0][1], range[1][1], range[2][1]}};
  }
  /// Returns true if the camera's centre is so close to a face of its voxel that rounding decides through which face
  /// many rays leave the voxel.
  [[nodiscard]] bool is_on_face(const depth_sensor& sensor) const {
    const double close = 64.0 * static_cast<double>(scene.margin(scene.voxel));
    const voxel_key& k = *sensor.key;
    const std::array<std::uint32_t, 3> at{k.x, k.y, k.z};
    for (std::size_t i = 0; i != 3; ++i) {
      const double off = std::fabs(static_cast<double>(sensor.pose.centre[i]) - sensor.grid.center(at[i]));
      if (off > 0.5 * sensor.grid.resolution() - close) return true;
    }
    return false;
  }

  /// Lists the nodes at list_level that rays may touch.
  void list_nodes(const depth_sensor& sensor, const voxel_key& low, const voxel_key& high) {
    const std::uint32_t span = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    const int root_level = std::max(list_level, static_cast<int>(std::bit_width(span)));
    offsets.resize(static_cast<std::size_t>(root_level));
    for (int level = 0; level != root_level; ++level)
      offsets[static_cast<std::size_t>(level)] =
          child_offsets{scene, 0.5F * scene.voxel * static_cast<float>(node_cells(level))};
    nodes.clear();
    const std::uint32_t size = node_cells(root_level);
    const voxel_key first = node_key(low, root_level), last = node_key(high, root_level);
    for (std::uint64_t z = first.z; z <= last.z; z += size)
      for (std::uint64_t y = first.y; y <= last.y; y += size)
        for (std::uint64_t x = first.x; x <= last.x; x += size) {
          const voxel_key k{static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                            static_cast<std::uint32_t>(z)};
          list_nodes(k, in_camera(sensor.corner(k), 0.5F * scene.voxel * static_cast<float>(size)), root_level, false);
        }
  }
  void list_nodes(const voxel_key& k, const float3& center, int level, bool inside) {
    if (level == list_level) {
      nodes.push_back({k, center, inside});
      return;
    }
    children c;
    classify(scene, offsets[static_cast<std::size_t>(level - 1)], center, inside, c);
    for (unsigned bits = c.live; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      list_nodes(child_key(k, i, node_cells(level - 1)), {c.x[i], c.y[i], c.z[i]}, level - 1,
                 (c.inside >> i & 1U) != 0);
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return pyramid.memory_bytes() + nodes.capacity() * sizeof(node) + offsets.capacity() * sizeof(child_offsets);
  }

 private:
  /// Centre of a node in the camera frame.
  [[nodiscard]] float3 in_camera(const float3& corner, float half_edge) const {
    const float3 c{corner[0] + half_edge, corner[1] + half_edge, corner[2] + half_edge};
    const auto along = [&](const float3& axis) { return axis[0] * c[0] + axis[1] * c[1] + axis[2] * c[2]; };
    return {along(scene.x_axis), along(scene.y_axis), along(scene.z_axis)};
  }
};
using view_frame = basic_view_frame<>;

}  // namespace orbis::octree::detail
