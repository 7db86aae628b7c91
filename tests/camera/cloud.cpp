// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/cloud.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::camera;

namespace {

const pinhole small{67, 53, 60.0, 61.0, 33.0, 26.5};

/// Depths of 0.3 to 8 m with holes.
image<std::uint16_t> some_depth() {
  random_bits random{3};
  image<std::uint16_t> depth{67, 53};
  for (auto& d : depth.pixels())
    d = random.below(4) == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(300 + random.below(7700));
  depth(5, 5) = 65535;
  return depth;
}

/// A depth source that cares about nothing, as a user may write it.
struct raw_depth {
  const std::vector<float>& values;
  [[nodiscard]] int width() const { return static_cast<int>(values.size()); }
  [[nodiscard]] int height() const { return 1; }
  [[nodiscard]] float operator()(int x, int) const { return values[static_cast<std::size_t>(x)]; }
};

}  // namespace

TEST_CASE("un-projected points project back onto their pixels at their depth") {
  const auto stored = some_depth();
  const depth_view<std::uint16_t> depth{stored, 1000.0};
  const radial_tangential lens{small.k(), {.k1 = 0.2, .k2 = -0.3, .p1 = 0.002}};
  const se3 T_world_camera = se3::exp((vec6() << 1.0, -2.0, 0.5, 0.3, -0.7, 2.0).finished());
  const auto cloud = unproject_depth(par, depth, lens, {}, T_world_camera);
  REQUIRE(cloud.points.size() == cloud.pixels.size());
  std::size_t next = 0;
  for (std::uint32_t i = 0; i != 67 * 53; ++i) {
    const int x = static_cast<int>(i % 67), y = static_cast<int>(i / 67);
    if (depth(x, y) == 0.0F) continue;
    REQUIRE(next < cloud.pixels.size());
    REQUIRE(cloud.pixels[next] == i);
    const vec3 p = T_world_camera.inverse() * cloud.points[next].cast<double>();
    CHECK(p.z() == Approx(depth(x, y)).epsilon(1e-5));
    CHECK((*lens.project(p) - vec2{x, y}).norm() < 1e-3);
    ++next;
  }
  CHECK(next == cloud.points.size());
}

TEST_CASE("un-projection gives the same bytes under every policy") {
  const auto stored = some_depth();
  const depth_view<std::uint16_t> depth{stored, 1000.0};
  const ray_table rays{small};
  for (const int stride : {1, 2, 3, 100}) {
    const auto one = unproject_depth(seq, depth, rays, {.stride = stride});
    const auto many = unproject_depth(par.with(4), depth, rays, {.stride = stride});
    CHECK(one.points == many.points);
    CHECK(one.pixels == many.pixels);
  }
}

TEST_CASE("the range limits hold and belong to the range") {
  const std::vector<float> values{0.49F, 0.5F, 2.0F, 4.0F, 4.01F};
  const ray_table rays{pinhole{5, 1, 10.0, 10.0, 2.0, 0.0}};
  const auto cloud = unproject_depth(seq, raw_depth{values}, rays, {.min_depth = 0.5F, .max_depth = 4.0F});
  CHECK(cloud.pixels == std::vector<std::uint32_t>{1, 2, 3});
}

TEST_CASE("depths that are no number and pixels without a ray give no point") {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> values{nan, inf, -inf, -1.0F, 0.0F, 1.0F, std::numeric_limits<float>::max()};
  const ray_table rays{pinhole{7, 1, 1.0, 1.0, 0.0, 0.0}};
  CHECK(unproject_depth(seq, raw_depth{values}, rays).pixels == std::vector<std::uint32_t>{5});  // 6 overflows

  const std::vector<float> ones(9, 1.0F);
  const kannala_brandt fisheye{{9, 1, 2.0, 2.0, 4.0, 0.0}, {}};  // 90 degrees lie 3.14 pixels off the middle
  CHECK(unproject_depth(seq, raw_depth{ones}, fisheye).pixels == std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6, 7});
}

TEST_CASE("an empty depth image gives an empty cloud") {
  const image<std::uint16_t> none;
  CHECK(unproject_depth(par, depth_view<std::uint16_t>{none}, pinhole{}).points.empty());
}
