// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

TEST_CASE("Every instruction set loads the points as they are") {
  random_bits random{200};
  for (std::size_t count = 0; count <= point_batch::capacity; ++count) {
    std::vector<std::array<float, 3>> points(count + 1);
    for (auto& p : points)
      for (float& c : p) c = static_cast<float>(random.uniform(-1.0, 1.0));
    const point_view source{points.data()->data(), count};
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      auto got = std::make_unique<point_batch>();
      load_points(source, 0, count, *got);
      bool same = true;
      for (std::size_t i = 0; i != count; ++i) same = same && std::array{got->x[i], got->y[i], got->z[i]} == points[i];
      REQUIRE(same);
    }
  }
}

TEST_CASE("Every instruction set finds the voxels of points in their order") {
  using voxel = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;
  random_bits random{197};
  auto batch = std::make_unique<point_batch>();
  auto got = std::make_unique<batch_keys>();
  for (int run = 0; run != 300; ++run) {
    const voxel_grid grid{0.1, 8};  // 25.6 m wide
    const std::size_t count = random.below(point_batch::capacity + 1);
    std::vector<voxel> want;
    std::size_t outside = 0;
    for (std::size_t i = 0; i != count; ++i) {
      for (auto* axis : {&batch->x, &batch->y, &batch->z}) {
        float& c = (*axis)[i];
        c = i != 0 && random.below(3) != 0 ? (*axis)[i - 1] : static_cast<float>(random.uniform(-13.5, 13.5));
        if (random.below(4) == 0) c = std::round(c * 10.0F) * 0.1F;
        if (random.below(40) == 0) c = std::numeric_limits<float>::quiet_NaN();
        if (random.below(40) == 0) c = 1e30F;
      }
      const auto key = grid.key(std::array{batch->x[i], batch->y[i], batch->z[i]});
      if (!key)
        ++outside;
      else if (const voxel v{key->x, key->y, key->z}; want.empty() || want.back() != v)
        want.push_back(v);
    }
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      find_keys(grid, *batch, count, *got);
      REQUIRE(got->outside == outside);
      // Which repetitions are left out behind a point outside is not said.
      std::vector<voxel> listed;
      for (std::size_t i = 0; i != got->count; ++i)
        if (const voxel v{got->x[i], got->y[i], got->z[i]}; listed.empty() || listed.back() != v) listed.push_back(v);
      REQUIRE(listed == want);
    }
  }
}
