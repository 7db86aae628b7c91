// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/nav/view_gain.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;
using voxel = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;

/// Unknown space with octants of free and occupied voxels strewn in.
map_type strewn(random_bits& random, std::uint32_t low, std::uint32_t width) {
  map_type map{0.1, 7};
  for (int i = 0; i != 40; ++i) {
    const voxel_key k{low + random.below(width), low + random.below(width), low + random.below(width)};
    map.edit_octant(k, [&](auto& voxels) {
      voxels.known |= random() & random();
      for (float& v : voxels.value) v = random.below(8) == 0 ? 1.0F : -1.0F;
    });
  }
  return map;
}

/// Where a ray is in a cube, metres along it; empty if it misses.
std::optional<std::pair<double, double>> inside(const octree::bounding_box& b, const vec3& origin, const vec3& ray) {
  double in = 0.0, out = std::numeric_limits<double>::infinity();
  for (int i = 0; i != 3; ++i) {
    const double s = (b.min[i] - origin[i]) / ray[i], t = (b.max[i] - origin[i]) / ray[i];
    in = std::max(in, std::min(s, t));
    out = std::min(out, std::max(s, t));
  }
  return in <= out ? std::optional{std::pair{in, out}} : std::nullopt;
}

}  // namespace

TEST_CASE("A view's gain is the number of unknown voxels that its rays meet, by brute force") {
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  for (std::uint64_t seed = 1; seed != 13; ++seed) {
    random_bits random{seed};
    const bool at_edge = seed % 3 == 0;  // of the grid
    const std::uint32_t low = at_edge ? 104 : 52;
    const map_type map = strewn(random, low, 24);
    const octree::voxel_grid& grid = map.grid();
    nav::view_gain_options options{.max_range = 1.3, .pixel_step = 7};
    if (seed % 2 == 0) options.bounds = octree::bounding_box{vec3::Constant(-0.73), vec3{0.53, 4.33, 0.93}};
    nav::view_gain gain{map, camera, options};
    for (int pose = 0; pose != 4; ++pose) {
      const vec3 middle = grid.center(voxel_key{low + 12, low + 12, low + 12});
      const vec3 origin = middle + vec3{random.normal(), random.normal(), random.normal()} * 0.3;
      const se3 T{so3::exp(vec3{random.normal(), random.normal(), random.normal()}), origin};
      std::set<voxel> seen;
      for (int y = 3; y < 30; y += 7)
        for (int x = 3; x < 40; x += 7) {
          const vec3 ray = T.rotation() * camera.unproject(vec2{double(x), double(y)})->normalized();
          double end = options.max_range;
          std::vector<std::pair<double, voxel>> unknown;
          const vec3 far = origin + options.max_range * ray;
          const auto keys = octree::keys_between(grid, origin.cwiseMin(far), origin.cwiseMax(far));
          for (auto kz = keys->low.z; kz <= keys->high.z; ++kz)
            for (auto ky = keys->low.y; ky <= keys->high.y; ++ky)
              for (auto kx = keys->low.x; kx <= keys->high.x; ++kx) {
                const voxel_key k{kx, ky, kz};
                const auto in = inside(octree::node_cube(grid, k, 0), origin, ray);
                if (!in) continue;
                const auto state = map.state(grid.center(k));
                if (state == octree::occupancy::occupied) end = std::min(end, in->first);
                if (state == octree::occupancy::unknown) unknown.push_back({in->first, {kx, ky, kz}});
              }
          for (const auto& [t, v] : unknown) {
            const vec3 c = grid.center(voxel_key{std::get<0>(v), std::get<1>(v), std::get<2>(v)});
            const bool counts = !options.bounds || ((c.array() > options.bounds->min.array() - 0.05).all() &&
                                                    (c.array() < options.bounds->max.array() + 0.05).all());
            if (t < end && counts) seen.insert(v);
          }
        }
      CHECK(gain(T) == seen.size());
      CHECK(gain(T) == seen.size());  // each view counts anew
    }
  }
}

TEST_CASE("A view shows nothing from outside, inside of walls, or where nothing counts") {
  map_type map{0.1, 7};
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  nav::view_gain gain{map, camera};
  CHECK(gain(se3{}) > 0);
  CHECK(gain(se3{so3{}, vec3{100.0, 0.0, 0.0}}) == 0);
  CHECK(gain(se3{so3{}, vec3{std::nan(""), 0.0, 0.0}}) == 0);
  nav::view_gain nothing{map, camera, {.bounds = octree::bounding_box{vec3::Constant(50.0), vec3::Constant(51.0)}}};
  CHECK(nothing(se3{}) == 0);
  map.edit_octant({64, 64, 64}, [](auto& voxels) {
    voxels.known = ~std::uint64_t{0};
    voxels.value.fill(1.0F);
  });
  nav::view_gain in_wall{map, camera};
  CHECK(in_wall(se3{so3{}, vec3::Constant(0.1)}) == 0);
}
