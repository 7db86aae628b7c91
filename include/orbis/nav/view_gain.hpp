// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Amount of unknown space that a camera would see from a pose.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>

namespace orbis::nav {

struct view_gain_options {
  double max_range = 4.0;  ///< range of the camera, metres along the ray
  int pixel_step = 8;      ///< spacing of the rays in columns and rows of the image
  /// Box in which unknown space is counted; empty: everywhere. If a map is surrounded by unknown space, a box around
  /// the space to explore prevents rays that pass through a gap from counting space outside.
  std::optional<octree::bounding_box> bounds{};
};

/// Counts the unknown voxels that a camera would see: its rays pass through free and unknown space up to the first
/// occupied voxel. Each voxel counts once, regardless of how many rays cross it. This is an upper bound on the space
/// that a view can reveal, because unknown space may contain obstacles that hide the space behind them: H. H.
/// Gonzalez-Banos, J.-C. Latombe, "Navigation strategies for exploring indoor environments", International Journal of
/// Robotics Research 21, 2002. Where rays are more than a voxel apart, some voxels are missed.
///
/// Caches the parts of the map that it reads, so queries for nearby poses are fast. The map must outlive the object and
/// not change. Not thread-safe.
template <planning_map Map, camera::camera_model Camera>
class view_gain {
 public:
  /// @pre options.max_range finite and > 0; options.pixel_step > 0
  view_gain(const Map& map, const Camera& camera, const view_gain_options& options = {})
      : grid_{map_access<Map>::grid(map)}, octants_{map_access<Map>::octants(map)}, max_range_{options.max_range} {
    assert(std::isfinite(max_range_) && max_range_ > 0.0 && options.pixel_step > 0);
    const auto first = [&](int size) { return std::min(options.pixel_step / 2, (size - 1) / 2); };  // at least one
    for (int y = first(camera.height()); y < camera.height(); y += options.pixel_step)
      for (int x = first(camera.width()); x < camera.width(); x += options.pixel_step)
        if (const std::optional<vec3> ray = camera.unproject(vec2{double(x), double(y)}))
          rays_.push_back(ray->normalized());
    if (options.bounds) counted_ = octree::keys_between(grid_, options.bounds->min, options.bounds->max);
    counts_any_ = !options.bounds || counted_;
  }
  // A temporary would not outlive the object.
  view_gain(const Map&&, const Camera&, const view_gain_options& = {}) = delete;

  /// The number of unknown voxels seen from a pose; 0 if the pose is outside the grid. O(voxels along the rays)
  [[nodiscard]] std::size_t operator()(const se3& T_world_camera) {
    const vec3 origin = T_world_camera.translation();
    const std::optional<octree::voxel_key> start = all_finite(origin) ? grid_.key(origin) : std::nullopt;
    if (!start || !counts_any_) return 0;
    ++view_;
    count_ = 0;
    for (const vec3& ray : rays_) cast(origin, *start, T_world_camera.rotation() * ray);
    return count_;
  }

 private:
  /// States of an octant of 4x4x4 voxels, and the voxels in it that the view with index `view` has counted.
  struct octant {
    octree::octant_states states;
    std::uint64_t counted = 0;
    std::uint64_t view = 0;
  };

  [[nodiscard]] octant& octant_at(const octree::voxel_key& k) {
    const std::uint64_t name = octree::morton_code(k) >> 6U;
    std::uint32_t i = index_.find(name);
    if (i == hash_index::none) {
      i = static_cast<std::uint32_t>(seen_.size());
      index_.set(name, i);
      seen_.push_back({octants_(k)});
    }
    octant& o = seen_[i];
    if (o.view != view_) o.view = view_, o.counted = 0;
    return o;
  }

  /// Traverses the voxels of a ray: J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing",
  /// Eurographics 1987.
  void cast(const vec3& origin, const octree::voxel_key& start, const vec3& direction) {
    std::array<std::uint32_t, 3> at{start.x, start.y, start.z};
    std::array<double, 3> next{}, apart{};  // positions on the ray where it enters the next voxel along an axis, metres
    std::array<std::uint32_t, 3> step{};
    for (std::size_t i = 0; i != 3; ++i) {
      const double d = direction[static_cast<Eigen::Index>(i)];
      step[i] = d < 0.0 ? ~std::uint32_t{0} : 1U;
      apart[i] = d == 0.0 ? std::numeric_limits<double>::infinity() : grid_.resolution() / std::abs(d);
      const double ahead = grid_.center(at[i]) - origin[static_cast<Eigen::Index>(i)];
      const double to_face = 0.5 * grid_.resolution() + (d < 0.0 ? -ahead : ahead);
      next[i] = d == 0.0 ? apart[i] : std::max(0.0, to_face) / std::abs(d);
    }
    constexpr std::array<unsigned, 4> spread{0, 1, 8, 9};  // the two bits of a coordinate along the Morton curve
    octant* here = nullptr;
    for (;;) {
      const octree::voxel_key k{at[0], at[1], at[2]};
      if (here == nullptr) here = &octant_at(k);
      const std::uint64_t voxel = std::uint64_t{1}
                                  << (spread[k.x & 3U] | spread[k.y & 3U] << 1U | spread[k.z & 3U] << 2U);
      if ((here->states.occupied & voxel) != 0) return;
      if (((here->states.known | here->counted) & voxel) == 0 && (!counted_ || counted_->overlaps(k, 0))) {
        here->counted |= voxel;
        ++count_;
      }
      const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
      if (next[axis] > max_range_) return;
      next[axis] += apart[axis];
      const std::uint32_t before = at[axis];
      at[axis] += step[axis];
      if (at[axis] >= grid_.cells()) return;  // coordinates below 0 wrap around
      if ((before ^ at[axis]) >> 2U != 0) here = nullptr;
    }
  }

  octree::voxel_grid grid_;
  decltype(map_access<Map>::octants(std::declval<const Map&>())) octants_;
  double max_range_;
  std::vector<vec3> rays_;  ///< unit vectors
  std::optional<octree::key_box> counted_;
  bool counts_any_ = true;
  hash_index index_;  ///< indices into seen_
  std::vector<octant> seen_;
  std::uint64_t view_ = 0;
  std::size_t count_ = 0;
};

}  // namespace orbis::nav
