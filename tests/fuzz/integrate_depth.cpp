// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a few depth images: grid, camera and options, then for each image pose and depths, among them
// absurd ones: far outside the grid, on the faces of voxels, NaN, denormal, focal lengths of a thousandth of a
// pixel. The map must be the one that the images' points make, by every ray mode and on any number of threads.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>

#include "fuzz/octree.hpp"
#include "fuzz/source.hpp"

namespace {

using namespace orbis;
using fuzz::map;
using fuzz::require;
using fuzz::source;

constexpr int most_images = 3;
/// The most voxels that the rays of an image may cross, more or less.
constexpr double most_steps = 30'000.0;
constexpr double infinity = std::numeric_limits<double>::infinity();

[[nodiscard]] camera::any_camera next_camera(source& from) {
  constexpr int widths[] = {32, 24, 17, 7, 1}, heights[] = {24, 17, 12, 5, 1};
  constexpr double focals[] = {30.0, 12.0, 5.0, 500.0, 1e5, 1e-3};
  camera::intrinsics k;
  k.width = from.one_of(widths);
  k.height = from.one_of(heights);
  k.fx = from.one_of(focals);
  k.fy = from.one_of({1.0, 1.1, 0.25}) * k.fx;
  k.cx = from.one_of({0.5 * k.width, 0.0, -100.0, 1e4});
  k.cy = from.one_of({0.5 * k.height, 0.0, -50.0});
  const unsigned model = from.byte() % 4;
  if (model < 2) return camera::pinhole{k};
  const double k1 = from.signed_byte() * 0.004, k2 = from.signed_byte() * 0.001;
  if (model == 2) return camera::radial_tangential{k, {.k1 = k1, .k2 = k2, .p1 = from.signed_byte() * 1e-4}};
  return camera::kannala_brandt{k, {.k1 = k1, .k2 = k2}};
}

[[nodiscard]] se3 next_pose(source& from, const octree::voxel_grid& grid) {
  const double resolution = grid.resolution(), half = 0.5 * resolution * grid.cells();
  const unsigned where = from.byte();
  vec3 t = from.point(resolution, false).cast<double>();  // on the faces of voxels at times
  if ((where & 16U) != 0) t += vec3::Constant(from.signed_byte() * 1e-3 * resolution);
  switch (where % 12) {
    case 0: t.x() += half - 2.0 * resolution; break;
    case 1: t.y() += 1.001 * half; break;
    case 2: t.z() += 0.5 * resolution - half; break;
    case 3: t.x() = static_cast<double>(from.any()); break;
    case 4: t.y() = from.one_of({1e30, 1e300, -1e38, infinity}); break;
    default: break;
  }
  const auto part = [&] { return static_cast<double>(from.signed_byte()); };
  const double x = part(), y = part(), z = part();
  const so3::quaternion q{part() + 0.5, x, y, z};  // never zero
  return {(where & 32U) != 0 ? so3{} : so3{q}, t};
}

/// Depths about `base` metres.
[[nodiscard]] image<float> next_depth(source& from, int width, int height, double base) {
  constexpr float absurd[] = {1e10F,  1e38F,
                              1e-38F, 1e-45F,
                              -1.0F,  std::numeric_limits<float>::infinity(),
                              0.0F,   std::numeric_limits<float>::quiet_NaN()};
  image<float> depth(width, height);
  const unsigned kind = from.byte() % 6;
  std::vector<unsigned> pattern(1 + from.byte() % 64);
  for (unsigned& b : pattern) b = from.byte();
  for (int v = 0; v != height; ++v)
    for (int u = 0; u != width; ++u) {
      const auto i = static_cast<std::size_t>(v * width + u);
      const unsigned given = pattern[i % pattern.size()];
      const unsigned noise = static_cast<unsigned>(mix64(i + (std::uint64_t{given} << 32U)) & 255U);
      float& z = depth(u, v);
      z = static_cast<float>(base);
      switch (kind) {
        case 0: break;
        case 1: z *= 0.9F + static_cast<float>(noise) / 1280.0F; break;
        case 2: z *= 0.01F + static_cast<float>(noise) / 85.0F; break;
        case 3: z *= 0.01F + static_cast<float>(given) / 85.0F; break;
        case 4:
          if (noise < 24) z = absurd[noise % 8];
          break;
        default: z = noise < 64 ? absurd[7] : z * (1.0F + static_cast<float>(u) / 64.0F);
      }
    }
  return depth;
}

[[nodiscard]] octree::integration_options next_options(source& from, double resolution, double base) {
  octree::integration_options options;
  const unsigned flags = from.byte();
  if ((flags & 3U) == 3U) options.mode = octree::ray_mode::discretized;
  options.max_range = from.one_of({infinity, base, 0.5 * base, 7.25 * resolution, 0.0, 1e30});
  return options;
}

/// The same options with a range at which the rays to these points do not take too long.
[[nodiscard]] octree::integration_options affordable(octree::integration_options options,
                                                     const std::vector<vec3f>& points, const vec3f& origin,
                                                     const octree::voxel_grid& grid) {
  if (points.empty()) return options;
  double steps = 0.0;
  for (const vec3f& p : points) {
    const double voxels = (p - origin).cast<double>().norm() / grid.resolution();
    const double limit = std::min(options.max_range / grid.resolution(), 2.0 * grid.cells());
    steps += 1.5 * (voxels < limit ? voxels : limit);
  }
  if (steps > most_steps) {
    const double each = most_steps / (1.5 * static_cast<double>(points.size()));
    options.max_range = std::min(options.max_range, each * grid.resolution());
  }
  return options;
}

/// Takes in an image as it is, or in millimetres.
template <class Integrate>
octree::integration_summary with_view(const image<float>& depth, bool in_millimetres, Integrate&& integrate) {
  if (!in_millimetres) return integrate(camera::depth_view{depth});
  image<std::uint16_t> millimetres(depth.width(), depth.height());
  for (int v = 0; v != depth.height(); ++v)
    for (int u = 0; u != depth.width(); ++u) {
      const float z = 1000.0F * depth(u, v);
      millimetres(u, v) = z > 0.0F && z < 65536.0F ? static_cast<std::uint16_t>(z) : std::uint16_t{0};
    }
  return integrate(camera::depth_view{millimetres, 1000.0, 0.003F, 60.0F});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  orbis::fuzz::accept();  // any bytes mean something
  constexpr double resolutions[] = {0.05, 0.1, 0.02, 1.0, 1.0 / 3.0, 1e-3, 64.0, 0.013};
  constexpr int depths[] = {16, 21, 8, 5};
  source from{{data, size}};
  const double resolution = from.one_of(resolutions);
  map ours{resolution, from.one_of(depths)}, by_points{resolution, ours.tree_depth()};
  const camera::any_camera camera = next_camera(from);
  const double base = from.one_of({1.0, 0.3, 3.0 * resolution, 20.0 * resolution, 100.0 * resolution});
  const octree::integration_options options = next_options(from, resolution, base);

  if (const unsigned before = from.byte(); before % 4 == 0) {  // something is known already, in one leaf
    const std::uint32_t middle = ours.grid().cells() / 2;
    const int level = std::min(ours.tree_depth() - 1, 3 + static_cast<int>(before >> 6U));
    const float value = (before & 32U) != 0 ? map::model::clamp_min : 1.0F;
    for (map* const m : {&ours, &by_points})
      m->set_unknown_node({middle, middle, middle}, m->tree_depth() - level, value);
  }
  for (int images = 0; images != most_images && (images == 0 || !from.empty()); ++images) {
    const se3 T_world_camera = next_pose(from, ours.grid());
    const image<float> depth = next_depth(from, camera.width(), camera.height(), base);
    const unsigned how = from.byte();
    const vec3f origin = T_world_camera.translation().cast<float>();
    // Often enough for voxels to settle, at times.
    for (unsigned times = how % 4 == 0 ? 6 : 1; times != 0; --times) {
      with_view(depth, (how & 4U) != 0, [&](const auto& view) {
        std::vector<vec3f> points;
        octree::append_world_points(view, camera, T_world_camera, points);
        const auto limited = affordable(options, points, origin, ours.grid());
        const auto expected = by_points.integrate(points, origin, limited);
        const auto done = camera.visit([&](const auto& model) {
          return (how & 8U) != 0 ? ours.integrate(par.with(2), view, model, T_world_camera, limited)
                                 : ours.integrate(view, model, T_world_camera, limited);
        });
        require(
            done.used == expected.used && done.truncated == expected.truncated && done.rejected == expected.rejected,
            "what becomes of the pixels is what becomes of their points");
        require(done.occupied == expected.occupied, "pixels hit the voxels that their points hit");
        require(done.free == expected.free, "rays cross the voxels that the rays to the points cross");
        return done;
      });
    }
    require(fuzz::leaves_of(ours) == fuzz::leaves_of(by_points), "the map is the one made of the points");
  }
  return 0;
}
