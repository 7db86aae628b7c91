// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/windows/cell_tests.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::binned_ray;
using octree::detail::voxel_test;
using octree::detail::window_rays;

namespace {

/// Rays from the world's origin along z, in a window of 40x30 cells.
struct window {
  static constexpr std::int32_t width = 40, height = 30, stride = 64;
  static constexpr float cell = 0.01F;

  depth_scene scene;
  std::vector<float> z = std::vector<float>(stride * (height + 1));
  std::vector<std::int32_t> deepest = std::vector<std::int32_t>(z.size());
  std::vector<std::uint32_t> begin = std::vector<std::uint32_t>(z.size() + 1);
  std::vector<binned_ray> sorted{};

  explicit window(random_bits& random) {
    scene.x_axis = {1, 0, 0};
    scene.y_axis = {0, 1, 0};
    scene.z_axis = {0, 0, 1};
    scene.fx = scene.fy = 1.0F / cell;
    scene.per_fx = scene.per_fy = cell;
    scene.cx = 0.5F * width - 0.5F;
    scene.cy = 0.5F * height - 0.5F;
    scene.margin_0 = 1e-6F;
    scene.margin_1 = 4e-6F;
    scene.pixel_margin = 0.51F;
    scene.voxel = 0.05F;
    scene.near_z = 0.005F;
    for (std::size_t c = 0; c != z.size(); ++c) {
      begin[c] = static_cast<std::uint32_t>(sorted.size());
      const auto u = static_cast<std::int32_t>(c) % stride, v = static_cast<std::int32_t>(c) / stride;
      if (u >= width || v >= height) continue;
      for (std::uint64_t left = random.below(4) == 0 ? random.below(60) : random.below(4); left != 0; --left) {
        const auto place = [&](std::int32_t at, float centre) {
          return (static_cast<float>(at) - centre + static_cast<float>(random.uniform(-0.5, 0.5))) * cell;
        };
        binned_ray r{place(u, scene.cx), place(v, scene.cy), static_cast<float>(random.uniform(0.3, 1.6)), 0};
        r.number = static_cast<std::uint32_t>(sorted.size());
        if (r.z > z[c]) {
          z[c] = r.z;
          deepest[c] = static_cast<std::int32_t>(r.number);
        }
        sorted.push_back(r);
      }
    }
    begin[z.size()] = static_cast<std::uint32_t>(sorted.size());
    sorted.resize(sorted.size() + 64);
  }
  [[nodiscard]] window_rays rays() const {
    return {z.data(), deepest.data(), begin.data(), stride, sorted.data(), sorted.data()};
  }
};

/// Whether a ray crosses a cube with centre c, in double; sure if it does so by a margin.
[[nodiscard]] bool crosses_cube(const binned_ray& r, const vec3& c, double half) {
  const vec3 d{static_cast<double>(r.x), static_cast<double>(r.y), 1.0};
  double from = 0.0, to = static_cast<double>(r.z);
  for (int i = 0; i != 3; ++i) {
    const double a = (c[i] - half) / d[i], b = (c[i] + half) / d[i];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  // It ends beyond the cube, not in it.
  const vec3 end = static_cast<double>(r.z) * d - c;
  return from < to && end.cwiseAbs().maxCoeff() > half;
}

}  // namespace

TEST_CASE("Cells tell whether one of their rays crosses a voxel or name those that may") {
  random_bits random{81};
  std::size_t crossed = 0, missed = 0, unsure_count = 0;
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    const auto test_cells =
        simd::kernel<test_cells_kernel, bool(const depth_scene&, const window_rays&, const voxel_test&,
                                             const pixel_box&, float, std::vector<std::uint32_t>&)>();
    for (int run = 0; run != 40; ++run) {
      const window w{random};
      for (int i = 0; i != 50; ++i) {
        const double z = random.uniform(0.4, 1.5), half = i % 2 == 0 ? 0.025 : 0.004;
        const vec3 c{random.uniform(-0.2, 0.2) * z, random.uniform(-0.15, 0.15) * z, z};
        const voxel_test test{w.scene,
                              {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())},
                              static_cast<float>(half)};
        // A box around all that see the voxel, larger than need be.
        const auto cells = [&](double at, float centre, std::int32_t count, int more) {
          const double middle = 100.0 * at / z + static_cast<double>(centre),
                       wide = 100.0 * 1.9 * half / (z - half) + more;
          return std::pair{std::clamp(static_cast<std::int32_t>(std::floor(middle - wide)), 0, count - 1),
                           std::clamp(static_cast<std::int32_t>(std::ceil(middle + wide)), 0, count - 1)};
        };
        const auto [u0, u1] = cells(c.x(), w.scene.cx, window::width, static_cast<int>(random.below(20)));
        const auto [v0, v1] = cells(c.y(), w.scene.cy, window::height, static_cast<int>(random.below(4)));
        std::vector<std::uint32_t> unsure;
        const bool sure = test_cells(w.scene, w.rays(), test, {u0, u1, v0, v1}, static_cast<float>(z - half), unsure);
        bool any = false;
        for (const binned_ray& r : w.sorted) {
          if (!(r.z > 0.0F) || !crosses_cube(r, c, half)) continue;
          any = true;
          if (!sure) REQUIRE(std::count(unsure.begin(), unsure.end(), r.number) == 1);
        }
        if (sure) REQUIRE(any);
        (any ? crossed : missed) += 1;
        unsure_count += unsure.empty() ? 0 : 1;
      }
    }
  }
  CHECK(crossed > 300);
  CHECK(missed > 100);
  CHECK(20 * unsure_count < crossed + missed);
}

TEST_CASE("The deepest rays of cells close to a voxel's centre mostly tell that it is crossed") {
  random_bits random{82};
  std::size_t said = 0, crossed = 0;
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    const auto sample = simd::kernel<sample_cells_kernel,
                                     unsigned(const depth_scene&, const window_rays&, const child_offsets&,
                                              const float3&, const children&, unsigned),
                                     simd::avx2>();
    for (int run = 0; run != 200; ++run) {
      const window w{random};
      const float3 parent{static_cast<float>(random.uniform(-0.1, 0.1)), static_cast<float>(random.uniform(-0.1, 0.1)),
                          static_cast<float>(random.uniform(0.5, 1.3))};
      const child_offsets offsets{w.scene, 0.5F * w.scene.voxel};
      children c;
      for (std::size_t i = 0; i != 8; ++i) {
        c.x[i] = parent[0] + offsets.x[i];
        c.y[i] = parent[1] + offsets.y[i];
        c.z[i] = parent[2] + offsets.z[i];
        c.near_z[i] = c.z[i] - 0.5F * w.scene.voxel;
        c.u0[i] = c.v0[i] = 0;
        c.u1[i] = window::width - 1;
        c.v1[i] = window::height - 1;
      }
      const auto wanted = static_cast<unsigned>(random.below(256));
      const unsigned got = sample(w.scene, w.rays(), offsets, parent, c, wanted);
      CHECK((got & ~wanted) == 0);
      for (std::size_t i = 0; i != 8; ++i) {
        const vec3 centre = vec3f{c.x[i], c.y[i], c.z[i]}.cast<double>();
        const bool any = (wanted >> i & 1U) != 0 && std::any_of(w.sorted.begin(), w.sorted.end(), [&](const auto& r) {
                           return r.z > 0.0F && crosses_cube(r, centre, 0.025);
                         });
        if ((got >> i & 1U) != 0) REQUIRE(any);
        crossed += any ? 1 : 0;
        said += got >> i & 1U;
      }
    }
  }
  CHECK(2 * said > crossed);
}
