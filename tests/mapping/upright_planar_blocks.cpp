// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <numbers>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/upright.hpp>

#include "support/catch.hpp"

namespace {

using namespace orbis;
using mapping::detail::find_planar_blocks;

const camera::pinhole lens{{.width = 216, .height = 160, .fx = 180, .fy = 180, .cx = 107.5, .cy = 79.5}};

/// The plane `normal . p = -1` with noise, in metres.
image<float> plane(const vec3& normal, double noise) {
  random_bits random{1};
  image<float> out(lens.width(), lens.height());
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x) {
      const double inverse = -normal.dot(*lens.unproject({x, y}));
      if (inverse > 0.125) out(x, y) = static_cast<float>(1.0 / inverse + noise * random.normal());
    }
  return out;
}

TEST_CASE("the blocks of a plane have its normal") {
  const camera::ray_table rays{lens};
  for (const vec3& normal : {vec3(0, 0, -0.5), vec3(0.3, 0.1, -0.4), vec3(0, -0.6, -0.1)})
    for (const double noise : {0.0, 0.003}) {
      const image<float> depth = plane(normal, noise);
      const auto blocks = find_planar_blocks(camera::depth_view<float>(depth.view()), rays);
      CHECK(blocks.with_depth > 100);
      CHECK(2 * blocks.normals.size() > blocks.with_depth);
      vec3 mean = vec3::Zero();
      for (const vec3& n : blocks.normals) {
        REQUIRE(n.norm() == Approx(1.0));
        mean += n;
      }
      const double off = std::acos(std::min(1.0, mean.normalized().dot(normal.normalized())));
      CHECK(off < (noise > 0 ? 1.0 : 0.001) * std::numbers::pi / 180.0);
    }
}

TEST_CASE("rough blocks and blocks without depth are not flat") {
  const camera::ray_table rays{lens};
  const image<float> none(lens.width(), lens.height());
  const auto empty = find_planar_blocks(camera::depth_view<float>(none.view()), rays);
  CHECK(empty.with_depth == 0);
  CHECK(empty.normals.empty());
  const image<float> depth = plane({0, 0, -0.5}, 0.1);
  const auto rough = find_planar_blocks(camera::depth_view<float>(depth.view()), rays);
  CHECK(rough.with_depth > 300);
  CHECK(rough.normals.empty());
}

}  // namespace
