// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The surface of what is occupied: its voxels' centres and normals.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/detail/storage/leaves.hpp>

namespace orbis::octree {

/// The centres of all occupied voxels, metres, those of larger leaves voxel by voxel. O(bricks + voxels).
template <octree_map Map>
[[nodiscard]] std::vector<vec3f> occupied_centers(const Map& map) {
  std::vector<vec3f> centers;
  detail::visit_occupied_voxels<typename Map::model>(
      map.store(), [&](const voxel_key& k, auto) { centers.push_back(map.grid().center(k).template cast<float>()); });
  return centers;
}

struct normal_options {
  occupancy unknown = occupancy::unknown;  ///< what unknown voxels count as; unknown: between free and occupied
};

/// Normals of surfaces, voxel by voxel: the direction in which the probability that a voxel is
/// occupied falls fastest, towards free space. It is minus the gradient by the 3x3x3 operator of
/// Zucker and Hummel, whose weights make it as good along diagonals as along axes:
/// S. W. Zucker, R. A. Hummel, "A three-dimensional edge operator", IEEE PAMI 3(3), 1981.
///
/// OctoMap's `getNormals` differs: it runs marching cubes over the eight cubes of voxels around a
/// point, and returns the normals of all triangles, of a fixed set of directions, any number of them.
///
/// One for each thread; the map must outlive it and stay as it is.
template <octree_map Map>
class normal_estimator {
 public:
  using model = typename Map::model;

  explicit normal_estimator(const Map& map, const normal_options& options = {}) noexcept
      : reader_{map.store()}, grid_{map.grid()}, unknown_{value_of(options.unknown)} {}

  /// The unit normal at voxel `k`. Empty at the grid's border and where everything around it cancels
  /// out: inside a solid, in the middle of a thin wall seen from both sides, in empty space. O(1).
  [[nodiscard]] std::optional<vec3> operator()(const voxel_key& k) noexcept {
    const std::uint32_t last = grid_.cells() - 1;
    const auto is_inside = [&](std::uint32_t c) { return 0 < c && c < last; };
    if (!is_inside(k.x) || !is_inside(k.y) || !is_inside(k.z)) return std::nullopt;
    vec3 down = vec3::Zero();
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const int steps = x * x + y * y + z * z;
          if (steps == 0) continue;
          const double p = occupied_at({moved(k.x, x), moved(k.y, y), moved(k.z, z)});
          down -= p * weights[static_cast<std::size_t>(steps)] * vec3{double(x), double(y), double(z)};
        }
    const double length = down.norm();
    if (!(length > 1e-6)) return std::nullopt;
    return vec3(down / length);
  }

 private:
  static constexpr std::array<double, 4> weights{0.0, 1.0, 0.70710678118654752, 0.57735026918962576};

  [[nodiscard]] static double value_of(occupancy o) noexcept {
    return o == occupancy::free ? 0.0 : o == occupancy::occupied ? 1.0 : 0.5;
  }
  [[nodiscard]] static std::uint32_t moved(std::uint32_t c, int by) noexcept {
    return c + static_cast<std::uint32_t>(by);
  }
  [[nodiscard]] double occupied_at(const voxel_key& k) noexcept {
    const auto v = reader_.value(k);
    return v ? probability_of(*v) : unknown_;
  }

  detail::store_reader<typename model::value_type> reader_;
  voxel_grid grid_;
  double unknown_;
};

/// Calls `visit(key, center, normal)` for every occupied voxel: its centre in metres, its unit normal
/// towards free space or empty, see normal_estimator. O(bricks + occupied voxels).
template <octree_map Map, std::invocable<const voxel_key&, const vec3&, const std::optional<vec3>&> Visit>
void for_each_surface_voxel(const Map& map, Visit&& visit, const normal_options& options = {}) {
  normal_estimator<Map> normal{map, options};
  detail::visit_occupied_voxels<typename Map::model>(
      map.store(), [&](const voxel_key& k, auto) { visit(k, map.grid().center(k), normal(k)); });
}

}  // namespace orbis::octree
