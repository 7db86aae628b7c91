// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The voxels that one depth image observes free and occupied, found voxel by voxel instead of ray by
/// ray: at the frame rate of a depth camera the same voxels, to the last, as walking every ray.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/depth/direction_index.hpp>
#include <orbis/octree/detail/depth/endpoint_image.hpp>
#include <orbis/octree/detail/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/depth/node_classifier.hpp>
#include <orbis/octree/detail/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/points/point_integrator.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>

namespace orbis::octree::detail {

/// Says that a miss may change every voxel.
struct nothing_saturated {
  void operator()(std::uint64_t, std::array<std::uint64_t, 8>&) const noexcept {}
};

/// Marks the voxels of depth images. Keeps its memory from image to image.
///
/// The octree is descended from a node around all rays. A node that no ray reaches is dropped, a node
/// all of whose voxels are surely crossed is filled; both are read off a pyramid of the nearest and
/// farthest ray ends. What is left are voxels at surfaces and at the border of the view: a voxel is
/// free if one of its pixels' rays crosses it. Where rounding could decide, the ray is walked.
class depth_integrator {
 public:
  depth_integrator() noexcept
      : classify_{simd::kernel<classify_children_kernel, classify_kernel, simd::avx2>()},
        sample_{simd::kernel<sample_children_kernel, sample_kernel, simd::avx2>()},
        test_pixels_{simd::kernel<test_pixels_kernel, test_kernel>()} {}

  /// Marks, in `masks`, what every_ray integration of the image's world points marks (see
  /// append_world_points), except that voxels for which `saturated` says that a miss would not change
  /// them may be missing among the free ones, and that an occupied voxel may be free as well or not.
  /// The summary's voxel counts stay zero. The same voxels under every policy.
  ///
  /// `saturated(name, mask)` sets the bits of such voxels of a named brick; it may be called from several
  /// threads. O(pixels + bricks seen + voxels at surfaces).
  /// @pre depth and camera have the same size
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera,
            class Saturated = nothing_saturated>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const Depth& depth, const Camera& camera,
                           const se3& T_world_camera, const integration_options& options, scan_masks& masks,
                           Saturated&& saturated = {}) {
    const depth_sensor sensor{grid, T_world_camera, options.max_range};
    masks.clear();
    const end_counts ends = rays_.find_ends(policy, sensor, depth, camera, masks);
    if (sensor.key && ends.leaves) {
      if (!rays_.rays().separable()) map_.fit(rays_.rays());
      set_scene(sensor);
      const auto bounds = bounds_of(sensor, ends.max_z);
      if (bounds && is_dense(ends))
        mark_free(policy, sensor, depth, ends.max_z, *bounds, masks, saturated);
      else
        walk_all(policy, sensor, depth, camera, T_world_camera, options, masks);
    }
    return {.used = ends.used, .truncated = ends.truncated, .rejected = ends.rejected};
  }
  /// The part of `mark` that finds the occupied voxels.
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  integration_summary mark_ends(const Policy& policy, const voxel_grid& grid, const Depth& depth, const Camera& camera,
                                const se3& T_world_camera, const integration_options& options, scan_masks& masks) {
    const depth_sensor sensor{grid, T_world_camera, options.max_range};
    masks.clear();
    const end_counts ends = rays_.find_ends(policy, sensor, depth, camera, masks);
    return {.used = ends.used, .truncated = ends.truncated, .rejected = ends.rejected};
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + pyramid_.memory_bytes() + map_.memory_bytes() + walker_.memory_bytes() +
                        points_.capacity() * sizeof(vec3f) + nodes_.capacity() * sizeof(node) +
                        workers_.capacity() * sizeof(worker) + offsets_.capacity() * sizeof(child_offsets);
    for (const worker& w : workers_)
      bytes += w.bricks.capacity() * sizeof(free_brick) + w.unsure.capacity() * sizeof(w.unsure[0]);
    return bytes;
  }

 private:
  using words = std::array<std::uint64_t, 8>;
  using classify_kernel = void(const depth_scene&, const child_offsets&, const float3&, bool, children&);
  using sample_kernel = unsigned(const depth_scene&, const child_offsets&, const float3&, const children&, unsigned);
  using test_kernel = bool(const depth_scene&, const voxel_test&, const pixel_box&, float,
                           std::vector<std::array<std::int32_t, 2>>&);
  static constexpr int list_level = 5;  ///< of the nodes that threads share out among them

  struct node {
    voxel_key key;
    float3 center;  ///< in the camera frame
    bool inside;
  };
  struct free_brick {
    std::uint64_t name;
    words free;
  };
  struct worker {
    std::vector<free_brick> bricks;
    std::vector<std::array<std::int32_t, 2>> unsure;
  };

  // -- one frame

  template <class Policy, class Depth, class Saturated>
  void mark_free(const Policy& policy, const depth_sensor& sensor, const Depth& depth, float max_z,
                 const std::pair<voxel_key, voxel_key>& bounds, scan_masks& masks, Saturated& saturated) {
    const voxel_key& from = *sensor.key;
    if (scene_.map != nullptr) walk_outer(sensor, depth, masks);
    pyramid_.build(rays_.rays().width(), rays_.rays().height(), max_z, [&](int v) { return rays_.z(v); });
    list_nodes(sensor, bounds.first, bounds.second);
    const bool on_face = is_on_face(sensor);

    workers_.resize(std::clamp<std::size_t>(policy.threads(), 1, std::max<std::size_t>(1, nodes_.size())));
    std::atomic<std::size_t> next{0};
    for_each_index(policy, workers_.size(), 1, [&](std::size_t i) {
      workers_[i].bricks.clear();
      const pass<Depth, Saturated> p{*this, workers_[i], sensor, depth, masks, saturated, on_face};
      for (std::size_t n; (n = next.fetch_add(1, std::memory_order_relaxed)) < nodes_.size();)
        p.descend(nodes_[n].key, nodes_[n].center, list_level, nodes_[n].inside);
    });
    for (const worker& w : workers_)
      for (const free_brick& b : w.bricks) join(masks.at(named_key(b.name)).free, b.free);
    const std::uint32_t place = place_in_brick(from);
    masks.at(from).free[place >> 6U] |= std::uint64_t{1} << (place & 63U);
    if (on_face) walk_first_steps(sensor, depth, masks);
  }

  void set_scene(const depth_sensor& sensor) {
    depth_scene& s = scene_;
    const auto& rows = sensor.pose.rows;
    for (std::size_t i = 0; i != 3; ++i) {
      s.x_axis[i] = rows[i][0];
      s.y_axis[i] = rows[i][1];
      s.z_axis[i] = rows[i][2];
    }
    const pixel_rays& rays = rays_.rays();
    s.map = rays.separable() ? nullptr : &map_;
    const vec2f focal = s.map != nullptr ? map_.focal() : vec2f(rays.focal().cast<float>());
    const vec2f center = s.map != nullptr ? map_.center() : vec2f(rays.center().cast<float>());
    s.fx = focal.x();
    s.fy = focal.y();
    s.per_fx = 1.0F / s.fx;
    s.per_fy = 1.0F / s.fy;
    s.cx = center.x();
    s.cy = center.y();
    s.last_u = static_cast<float>(rays.width() - 1);
    s.last_v = static_cast<float>(rays.height() - 1);
    s.min_x = s.map != nullptr ? map_.min_x() : rays.x(0)[0];
    s.max_x = s.map != nullptr ? map_.max_x() : rays.x(0)[rays.width() - 1];
    s.min_y = s.map != nullptr ? map_.min_y() : *rays.y(0);
    s.max_y = s.map != nullptr ? map_.max_y() : *rays.y(rays.height() - 1);
    constexpr float u = 0x1p-24F;
    float l1 = 0.0F;
    for (const float c : sensor.pose.centre) l1 += std::fabs(c);
    s.voxel = static_cast<float>(sensor.grid.resolution());
    s.margin_0 = u * (8.0F * l1 + 8.0F * s.voxel);
    s.margin_1 = 64.0F * u;
    s.pixel_margin = 0.01F + 1e-6F * (s.last_u + s.last_v);
    s.near_z = 0.1F * s.voxel;
    const float slope = 2.0F * (1.0F + std::max(std::fabs(s.min_x), std::fabs(s.max_x)) +
                                std::max(std::fabs(s.min_y), std::fabs(s.max_y)));
    s.ball = 0.5F * s.voxel - 2.0F * s.margin_0;
    s.ball_slope = 2.0F * s.margin_1 * slope;
    const float spacing = 0.5F * std::sqrt(1.0F / (s.fx * s.fx) + 1.0F / (s.fy * s.fy));
    for (std::size_t kind = 0; kind != 3; ++kind) s.dense_z[kind] = s.dense(kind, spacing);
    s.pyramid = &pyramid_;
    s.rays = &rays_;
  }
  /// The lowest and the highest voxel of a box around all rays; empty if it comes close to the border
  /// of the grid, where walks may end early.
  [[nodiscard]] std::optional<std::pair<voxel_key, voxel_key>> bounds_of(const depth_sensor& sensor,
                                                                         float max_z) const {
    std::array<std::array<std::uint32_t, 2>, 3> range;
    for (std::size_t i = 0; i != 3; ++i) {
      const double centre = static_cast<double>(sensor.pose.centre[i]);
      double low = centre, high = centre;
      for (const float x : {scene_.min_x, scene_.max_x})
        for (const float y : {scene_.min_y, scene_.max_y}) {
          const double reach =
              static_cast<double>(max_z) *
              (static_cast<double>(scene_.x_axis[i]) * static_cast<double>(x) +
               static_cast<double>(scene_.y_axis[i]) * static_cast<double>(y) + static_cast<double>(scene_.z_axis[i]));
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
  /// Whether there are so many rays that it is better to look at voxels than to walk them: where there
  /// is less than a pixel for half a voxel's edge, most voxels would have to be tested one by one.
  [[nodiscard]] bool is_dense(const end_counts& ends) const {
    const double mean_z = ends.sum_z / static_cast<double>(ends.used + ends.truncated);
    return mean_z < 0.45 * static_cast<double>(scene_.voxel) * static_cast<double>(std::max(scene_.fx, scene_.fy));
  }
  /// Whether the camera's centre is so close to a face of its voxel that the rounding of rays decides
  /// for many of them on which side they leave.
  [[nodiscard]] bool is_on_face(const depth_sensor& sensor) const {
    const double close = 64.0 * static_cast<double>(scene_.margin(scene_.voxel));
    const voxel_key& k = *sensor.key;
    const std::array<std::uint32_t, 3> at{k.x, k.y, k.z};
    for (std::size_t i = 0; i != 3; ++i) {
      const double off = std::fabs(static_cast<double>(sensor.pose.centre[i]) - sensor.grid.center(at[i]));
      if (off > 0.5 * sensor.grid.resolution() - close) return true;
    }
    return false;
  }

  // -- every ray, for the few cases that need it

  template <class Depth, class Use>
  void for_each_end(const depth_sensor& sensor, const Depth& depth, Use&& use) const {
    for (int v = 0; v != rays_.rays().height(); ++v)
      for (int u = 0; u != rays_.rays().width(); ++u)
        if (rays_.z(v)[u] > 0.0F) use(end_of(sensor, depth, u, v));
  }
  template <class Depth>
  [[nodiscard]] ray_endpoint end_of(const depth_sensor& sensor, const Depth& depth, int u, int v) const {
    const auto [x, y] = rays_.rays().at(u, v);
    return sensor.end(x, y, depth(u, v));
  }
  template <class Policy, class Depth, class Camera>
  void walk_all(const Policy& policy, const depth_sensor& sensor, const Depth& depth, const Camera& camera,
                const se3& T_world_camera, const integration_options& options, scan_masks& masks) {
    points_.clear();
    append_world_points(depth, camera, T_world_camera, points_);
    const auto point = [this](std::size_t i) { return coordinates<float>(points_[i]); };
    walker_.mark(policy, sensor.grid, points_.size(), point, sensor.pose.centre,
                 {.max_range = options.max_range, .mode = ray_mode::every_ray});
    masks.merge(walker_.masks());
  }
  /// Walks the rays that go too far aside for the map, and forgets them.
  template <class Depth>
  void walk_outer(const depth_sensor& sensor, const Depth& depth, scan_masks& masks) {
    for (const auto& [u, v] : map_.outer()) {
      if (!(rays_.z(v)[u] > 0.0F)) continue;
      const ray_endpoint e = end_of(sensor, depth, u, v);
      masks.mark_ray(sensor.grid, sensor.pose.centre, *sensor.key, e.point, e.key);
      rays_.clear(u, v);
    }
  }
  static void join(words& to, const words& from) noexcept {
    for (std::size_t i = 0; i != 8; ++i) to[i] |= from[i];
  }
  /// Marks the neighbours of the camera's voxel.
  template <class Depth>
  void walk_first_steps(const depth_sensor& sensor, const Depth& depth, scan_masks& masks) const {
    const voxel_key from = *sensor.key;
    std::uint32_t seen = 0;  // of 3x3x3 voxels
    for_each_end(sensor, depth, [&](const ray_endpoint& e) {
      if (e.key == from) return;
      auto cursor = ray_traversal::between(sensor.grid, from, sensor.pose.centre, e.point);
      if (!cursor) return;
      for (;;) {
        const std::size_t axis = cursor->axis();
        if (!cursor->can_step(axis)) return;
        cursor->advance(axis);
        const voxel_key k = cursor->key();
        const std::uint32_t x = k.x - from.x + 1, y = k.y - from.y + 1, z = k.z - from.z + 1;
        if (x > 2 || y > 2 || z > 2 || k == e.key) return;
        if (std::min(std::min(cursor->next[0], cursor->next[1]), cursor->next[2]) > cursor->reach) return;
        seen |= 1U << (x + 3 * y + 9 * z);
      }
    });
    for (; seen != 0; seen &= seen - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(seen));
      const voxel_key k{from.x + i % 3 - 1, from.y + i / 3 % 3 - 1, from.z + i / 9 - 1};
      const std::uint32_t place = place_in_brick(k);
      masks.at(k).free[place >> 6U] |= std::uint64_t{1} << (place & 63U);
    }
  }

  // -- the descent

  /// The nodes at list_level that rays may touch.
  void list_nodes(const depth_sensor& sensor, const voxel_key& low, const voxel_key& high) {
    const std::uint32_t span = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    const int root_level = std::max(list_level, static_cast<int>(std::bit_width(span)));
    offsets_.resize(static_cast<std::size_t>(root_level));
    for (int level = 0; level != root_level; ++level)
      offsets_[static_cast<std::size_t>(level)] =
          child_offsets{scene_, 0.5F * scene_.voxel * static_cast<float>(node_cells(level))};
    nodes_.clear();
    const std::uint32_t size = node_cells(root_level);
    const voxel_key first = node_key(low, root_level), last = node_key(high, root_level);
    for (std::uint64_t z = first.z; z <= last.z; z += size)
      for (std::uint64_t y = first.y; y <= last.y; y += size)
        for (std::uint64_t x = first.x; x <= last.x; x += size) {
          const voxel_key k{static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                            static_cast<std::uint32_t>(z)};
          list_nodes(k, in_camera(corner(sensor, k), 0.5F * scene_.voxel * static_cast<float>(size)), root_level,
                     false);
        }
  }
  void list_nodes(const voxel_key& k, const float3& center, int level, bool inside) {
    if (level == list_level) {
      nodes_.push_back({k, center, inside});
      return;
    }
    children c;
    classify_(scene_, offsets_[static_cast<std::size_t>(level - 1)], center, inside, c);
    for (unsigned bits = c.live; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      list_nodes(child_key(k, i, node_cells(level - 1)), {c.x[i], c.y[i], c.z[i]}, level - 1,
                 (c.inside >> i & 1U) != 0);
    }
  }
  /// The lower corner of a voxel, relative to the camera's centre, metres in the world frame.
  [[nodiscard]] static float3 corner(const depth_sensor& sensor, const voxel_key& k) {
    const double half = 0.5 * sensor.grid.resolution();
    const auto along = [&](std::uint32_t c, float centre) {
      return static_cast<float>((sensor.grid.center(c) - half) - static_cast<double>(centre));
    };
    return {along(k.x, sensor.pose.centre[0]), along(k.y, sensor.pose.centre[1]), along(k.z, sensor.pose.centre[2])};
  }
  /// A node's centre in the camera frame.
  [[nodiscard]] float3 in_camera(const float3& corner, float half_edge) const {
    const float3 c{corner[0] + half_edge, corner[1] + half_edge, corner[2] + half_edge};
    const auto along = [&](const float3& axis) { return axis[0] * c[0] + axis[1] * c[1] + axis[2] * c[2]; };
    return {along(scene_.x_axis), along(scene_.y_axis), along(scene_.z_axis)};
  }

  /// What one thread does with the nodes it is given.
  template <class Depth, class Saturated>
  struct pass {
    const depth_integrator& of;
    worker& own;
    const depth_sensor& sensor;
    const Depth& depth;
    const scan_masks& ends;
    Saturated& saturated;
    bool on_face;

    [[nodiscard]] const child_offsets& offsets(int level) const { return of.offsets_[static_cast<std::size_t>(level)]; }

    void descend(const voxel_key& k, const float3& center, int level, bool inside) const {
      children c;
      of.classify_(of.scene_, offsets(level - 1), center, inside, c);
      for (unsigned bits = c.live; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        const bool full = (c.full >> i & 1U) != 0, inner = (c.inside >> i & 1U) != 0;
        const voxel_key child = child_key(k, i, node_cells(level - 1));
        const float3 at{c.x[i], c.y[i], c.z[i]};
        if (level - 1 == brick_level)
          add_brick(child, at, full, inner);
        else if (full)
          fill(child, level - 1);
        else
          descend(child, at, level - 1, inner);
      }
    }
    void fill(const voxel_key& k, int level) const {
      for (unsigned i = 0; i != 8; ++i) {
        const voxel_key child = child_key(k, i, node_cells(level - 1));
        if (level - 1 == brick_level)
          add_brick(child, {}, true, true);
        else
          fill(child, level - 1);
      }
    }
    void add_brick(const voxel_key& k, const float3& center, bool full, bool inside) const {
      const std::uint64_t name = node_name(k, brick_level);
      words skip{};  // voxels of which nothing needs to be known
      saturated(name, skip);
      if (const scan_brick* hit = ends.find(name))
        for (std::size_t i = 0; i != 8; ++i) skip[i] |= hit->occupied[i];
      skip_camera(k, skip);
      bool done = true;
      for (const std::uint64_t w : skip) done = done && w == ~std::uint64_t{0};
      if (done) return;
      words free{};
      if (full) {
        free.fill(~std::uint64_t{0});
      } else {
        refine(k, center, inside, skip, free);
      }
      std::uint64_t any = 0;
      for (std::size_t i = 0; i != 8; ++i) any |= free[i] &= ~skip[i];
      if (any != 0) own.bricks.push_back({name, free});
    }
    /// The camera's own voxel, and its neighbours if it is on a face, are seen to apart.
    void skip_camera(const voxel_key& k, words& skip) const {
      const voxel_key& from = *sensor.key;
      const std::uint32_t around = on_face ? 1 : 0;
      const auto touches = [&](std::uint32_t low, std::uint32_t at) {
        return at + around >= low && at <= low + 7 + around;
      };
      if (!touches(k.x, from.x) || !touches(k.y, from.y) || !touches(k.z, from.z)) return;
      for (std::uint32_t i = 0; i != 512; ++i) {
        const voxel_key p = voxel_in_brick(i);
        const auto close = [&](std::uint32_t c, std::uint32_t at) { return c + around - at <= 2 * around; };
        if (close(k.x + p.x, from.x) && close(k.y + p.y, from.y) && close(k.z + p.z, from.z))
          skip[i >> 6U] |= std::uint64_t{1} << (i & 63U);
      }
    }

    /// The free voxels of a brick, as far as they are not to be skipped.
    void refine(const voxel_key& k, const float3& center, bool inside, const words& skip, words& free) const {
      const float3 low = corner(sensor, k);
      children octants;
      of.classify_(of.scene_, offsets(octant_level), center, inside, octants);
      for (unsigned bits = octants.live; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        if (skip[i] == ~std::uint64_t{0}) continue;
        if ((octants.full >> i & 1U) != 0)
          free[i] = ~std::uint64_t{0};
        else
          free[i] = refine_octant(k, low, i, octants, skip[i]);
      }
    }
    [[nodiscard]] std::uint64_t refine_octant(const voxel_key& k, const float3& low, unsigned octant,
                                              const children& octants, std::uint64_t skip) const {
      children groups;
      of.classify_(of.scene_, offsets(1), {octants.x[octant], octants.y[octant], octants.z[octant]},
                   (octants.inside >> octant & 1U) != 0, groups);
      std::uint64_t free = 0;
      for (unsigned bits = groups.live; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        const auto known = static_cast<unsigned>(skip >> (8 * i) & 0xffU);
        if (known == 0xff) continue;
        const std::uint64_t found =
            (groups.full >> i & 1U) != 0 ? 0xff : refine_group(k, low, octant << 6U | i << 3U, groups, i, known);
        free |= found << (8 * i);
      }
      return free;
    }
    [[nodiscard]] unsigned refine_group(const voxel_key& k, const float3& low, std::uint32_t place,
                                        const children& groups, unsigned group, unsigned known) const {
      children voxels;
      of.classify_(of.scene_, offsets(0), {groups.x[group], groups.y[group], groups.z[group]},
                   (groups.inside >> group & 1U) != 0, voxels);
      unsigned left = voxels.live & ~voxels.full & ~known;
      if (left == 0) return voxels.full;
      const voxel_key p = voxel_in_brick(place);
      const float edge = of.scene_.voxel;
      const auto middle = [&](std::size_t i, std::uint32_t at) { return low[i] + edge * static_cast<float>(at + 1); };
      const float3 center{middle(0, p.x), middle(1, p.y), middle(2, p.z)};
      unsigned free = voxels.full | of.sample_(of.scene_, offsets(0), center, voxels, left);
      for (left &= ~free; left != 0; left &= left - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(left));
        const auto& o = offsets(0);
        const float3 at{center[0] + o.world_x[i], center[1] + o.world_y[i], center[2] + o.world_z[i]};
        const voxel_key voxel = child_key({k.x + p.x, k.y + p.y, k.z + p.z}, i, 1);
        if (is_crossed(voxel, at, {voxels.u0[i], voxels.u1[i], voxels.v0[i], voxels.v1[i]}, voxels.near_z[i]))
          free |= 1U << i;
      }
      return free;
    }
    [[nodiscard]] bool is_crossed(const voxel_key& voxel, const float3& at, const pixel_box& box, float near_z) const {
      own.unsure.clear();
      const voxel_test test{of.scene_, at, 0.5F * of.scene_.voxel};
      if (test_box(test, box, near_z)) return true;
      for (const auto& [u, v] : own.unsure)
        if (crosses(sensor, of.end_of(sensor, depth, u, v), voxel)) return true;
      return false;
    }
    [[nodiscard]] bool test_box(const voxel_test& test, const pixel_box& box, float near_z) const {
      if ((box.u1 - box.u0) * (box.v1 - box.v0) < 1024)
        return of.test_pixels_(of.scene_, test, box, near_z, own.unsure);
      // A voxel at the camera: most of its box are rays that pass it by, tile by tile.
      constexpr std::int32_t size = 128;
      for (std::int32_t v = box.v0 & -size; v <= box.v1; v += size)
        for (std::int32_t u = box.u0 & -size; u <= box.u1; u += size)
          if (test_tile(test, box, near_z, u, v, size)) return true;
      return false;
    }
    [[nodiscard]] bool test_tile(const voxel_test& test, const pixel_box& box, float near_z, std::int32_t u,
                                 std::int32_t v, std::int32_t size) const {
      const pixel_box part{std::max(box.u0, u), std::min(box.u1, u + size - 1), std::max(box.v0, v),
                           std::min(box.v1, v + size - 1)};
      if (part.u0 > part.u1 || part.v0 > part.v1 || !of.pyramid_.reaches(u, v, size, near_z)) return false;
      const pixel_rays& rays = of.rays_.rays();
      if (rays.separable()) {
        if (!test.may_cross(rays.x(0)[part.u0], rays.x(0)[part.u1], *rays.y(part.v0), *rays.y(part.v1))) return false;
      } else {
        const auto& t = of.map_.tile_at(u, v, size);
        if (!(t.x0 <= t.x1) || !test.may_cross(t.x0, t.x1, t.y0, t.y1)) return false;
      }
      if (size == 16) return of.test_pixels_(of.scene_, test, part, near_z, own.unsure);
      const std::int32_t half = size / 2;
      return test_tile(test, box, near_z, u, v, half) || test_tile(test, box, near_z, u + half, v, half) ||
             test_tile(test, box, near_z, u, v + half, half) || test_tile(test, box, near_z, u + half, v + half, half);
    }
  };

  classify_kernel* classify_;
  sample_kernel* sample_;
  test_kernel* test_pixels_;
  endpoint_image rays_;
  depth_pyramid pyramid_;
  direction_index map_;
  point_integrator walker_;
  std::vector<vec3f> points_;
  depth_scene scene_;
  std::vector<child_offsets> offsets_;  ///< for each level, of a node's children at that level
  std::vector<node> nodes_;
  std::vector<worker> workers_;
};

}  // namespace orbis::octree::detail
