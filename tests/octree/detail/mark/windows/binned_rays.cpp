// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/windows/binned_rays.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::binned_ray;
using octree::detail::binned_rays;
using octree::detail::ray_batch;

namespace {

struct scan {
  voxel_grid grid{0.1};
  float3 origin{0.31F, -0.2F, 0.17F};
  std::vector<float3> points{};
  direction_windows windows{};

  /// Rays all around, or those that lie in a cone; the windows know only a part of them.
  scan(std::size_t count, bool all_around) {
    random_bits random{51};
    sampled_rays sample;
    for (std::size_t i = 0; i != count; ++i) {
      vec3 d{random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4), 1.0};
      if (all_around) d = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
      d *= random.uniform(0.05, 3.0);
      points.push_back({origin[0] + static_cast<float>(d.x()), origin[1] + static_cast<float>(d.y()),
                        origin[2] + static_cast<float>(d.z())});
      if (i % 8 == 0) sample.directions.push_back(d.normalized());
    }
    sample.length = 1.0;
    windows.fit(sample, count, 0.0, 3.0, 3.0);
  }
};

struct binned {
  std::vector<std::vector<binned_ray>> cells;  ///< ordered by number
  std::vector<std::uint32_t> left_out;
  std::vector<float> z;
  std::vector<std::int32_t> deepest;
};

[[nodiscard]] binned bin(const scan& s, binned_rays& rays, std::size_t workers) {
  const std::size_t count = s.points.size();
  const std::size_t share = (count / workers + 256) & ~std::size_t{255};
  const auto range = [&](std::size_t w) {
    return std::pair{std::min(count, w * share), std::min(count, (w + 1) * share)};
  };
  binned out;
  rays.start(s.windows, s.origin, count, workers);
  const auto points = std::make_unique<point_batch>();
  const auto batch = std::make_unique<ray_batch>();
  const voxel_key from = *s.grid.key(s.origin);
  for (std::size_t w = 0; w != workers; ++w) {
    const auto [begin, end] = range(w);
    for (std::size_t i = begin; i < end; i += point_batch::capacity) {
      const std::size_t n = std::min(end - i, point_batch::capacity);
      load_points(point_view{s.points.data()->data(), s.points.size()}, i, n, *points);
      limit_rays()({s.grid, s.origin, from}, *points, 2.0, n, *batch);
      rays.add(w, *batch, i, n);
      for (std::size_t k = 0; k != n; ++k)
        if (((batch->hit[k >> 6U] | batch->cut[k >> 6U]) >> (k & 63U) & 1U) != 0)
          out.left_out.push_back(static_cast<std::uint32_t>(i + k));
    }
  }
  rays.sort(seq, range);
  for (const direction_window& w : s.windows.window) {
    if (w.width == 0) continue;
    const window_rays of = rays.window(w);
    for (std::int32_t cell = 0; cell != w.stride * w.height; ++cell) {
      std::vector<binned_ray> in{of.sorted + of.begin[cell], of.sorted + of.begin[cell + 1]};
      std::sort(in.begin(), in.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
      out.cells.push_back(std::move(in));
      out.z.push_back(of.z[cell]);
      out.deepest.push_back(of.deepest[cell]);
    }
  }
  return out;
}

}  // namespace

TEST_CASE("Every ray is in the cell of its direction, or left out") {
  for (const bool all_around : {false, true}) {
    const scan s{20000, all_around};
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      binned_rays rays;
      const binned got = bin(s, rays, 1);
      std::set<std::uint32_t> seen(got.left_out.begin(), got.left_out.end());
      CHECK(seen.size() < 300);
      std::size_t cell = 0;
      float deepest = 0.0F;
      for (const direction_window& w : s.windows.window)
        for (std::int32_t i = 0; i != w.stride * w.height; ++i, ++cell) {
          const double cell_x = i % w.stride + 0.5, cell_y = i / w.stride + 0.5,
                       edge = static_cast<double>(s.windows.cell);
          float z = 0.0F;
          for (const binned_ray& r : got.cells[cell]) {
            REQUIRE(seen.insert(r.number).second);
            REQUIRE(static_cast<double>(r.x - w.min_x) == Approx(cell_x * edge).margin(0.51 * edge));
            REQUIRE(static_cast<double>(r.y - w.min_y) == Approx(cell_y * edge).margin(0.51 * edge));
            // The ray, cut off at its limit, is where its point is.
            const float3 d = difference(s.points[r.number], s.origin);
            const auto distance = static_cast<float>(length(d));
            for (std::size_t k = 0; k != 3; ++k)
              REQUIRE(r.z * (r.x * w.axes[0][k] + r.y * w.axes[1][k] + w.axes[2][k]) ==
                      Approx(d[k] * std::min(1.0F, 2.0F / distance)).margin(1e-5));
            z = std::max(z, r.z);
          }
          REQUIRE(got.z[cell] == z);
          deepest = std::max(deepest, z);
          if (z > 0.0F) REQUIRE(rays.window(w).rays[got.deepest[cell]].z == z);
        }
      CHECK(rays.max_z() == deepest);
      // Missing are those that end in the voxel they start in.
      for (std::uint32_t i = 0; i != s.points.size(); ++i)
        REQUIRE((seen.contains(i) || *s.grid.key(s.points[i]) == *s.grid.key(s.origin)));
      CHECK(rays.size() + got.left_out.size() == seen.size());
    }
  }
}

TEST_CASE("Several workers put the same rays into the same cells") {
  const scan s{20000, true};
  binned_rays rays;
  const binned one = bin(s, rays, 1), three = bin(s, rays, 3), again = bin(s, rays, 1);
  for (const binned* other : {&three, &again}) {
    CHECK(other->left_out == one.left_out);
    CHECK(other->z == one.z);
    REQUIRE(other->cells.size() == one.cells.size());
    for (std::size_t i = 0; i != one.cells.size(); ++i) {
      REQUIRE(other->cells[i].size() == one.cells[i].size());
      for (std::size_t k = 0; k != one.cells[i].size(); ++k)
        REQUIRE(other->cells[i][k].number == one.cells[i][k].number);
    }
  }
}

TEST_CASE("A cell takes so many rays and no more") {
  scan s{4096, false};
  std::fill(s.points.begin(), s.points.end(), s.points[0]);
  binned_rays rays;
  const binned got = bin(s, rays, 1);
  CHECK(rays.size() == binned_rays::most_in_cell);
  CHECK(got.left_out.size() == s.points.size() - binned_rays::most_in_cell);
}
