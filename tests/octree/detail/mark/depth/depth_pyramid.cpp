// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_pyramid.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

struct depths {
  int width, height;
  std::size_t stride;
  std::vector<float> z;
  float max_z = 0.0F;

  depths(random_bits& random, int w, int h)
      : width{w}, height{h}, stride{static_cast<std::size_t>(w) + 31U}, z(stride * static_cast<std::size_t>(h) + 16U) {
    const std::uint32_t holes = 1 + random.below(20);
    for (int v = 0; v != h; ++v)
      for (int u = 0; u != w; ++u) {
        const auto deep = static_cast<float>(random.uniform(0.1, 9.0));
        row(v)[u] = random.below(holes) == 0 ? 0.0F : deep;
        max_z = std::max(max_z, row(v)[u]);
      }
  }
  [[nodiscard]] float* row(int v) { return z.data() + static_cast<std::size_t>(v) * stride; }
};

}  // namespace

TEST_CASE("Four entries bound the depths of any box of pixels, and leave out what their kind leaves out") {
  random_bits random{131};
  for (int run = 0; run != 40; ++run) {
    depths d{random, 1 + static_cast<int>(random.below(90)), 1 + static_cast<int>(random.below(70))};
    depth_pyramid pyramid;
    pyramid.build(d.width, d.height, d.max_z, [&](int v) { return d.row(v); });
    for (int box = 0; box != 200; ++box) {
      const auto pick = [&](int size) { return static_cast<int>(random.below(static_cast<std::uint32_t>(size))); };
      int u0 = pick(d.width), u1 = pick(d.width), v0 = pick(d.height), v1 = pick(d.height);
      if (u0 > u1) std::swap(u0, u1);
      if (v0 > v1) std::swap(v0, v1);
      int level = 1;
      while (3 << level < std::max(u1 - u0, v1 - v0) && level < pyramid.levels()) ++level;
      const auto k = static_cast<std::size_t>(level);
      for (std::size_t kind = 0; kind != 3; ++kind) {
        std::uint32_t ends = 0;
        for (const int j : {v0 >> level, std::max(v0 >> level, (v1 >> level) - 1)})
          for (const int i : {u0 >> level, std::max(u0 >> level, (u1 >> level) - 1)})
            ends = octree::detail::larger_halves(
                ends, pyramid.data()[kind * pyramid.family() +
                                     static_cast<std::size_t>(pyramid.begin()[k] + j * pyramid.width()[k] + i)]);
        const float farthest = static_cast<float>(ends >> 16U) / pyramid.scale();
        const float nearest = static_cast<float>(65535U - (ends & 0xffffU)) / pyramid.scale();
        // The nearest end of each tile that lies in the box wholly; none at all counts as 0.
        const int tile = 1 << kind;
        float least = 100.0F, most = 0.0F;
        for (int v = v0; v <= v1; ++v)
          for (int u = u0; u <= u1; ++u) {
            most = std::max(most, d.row(v)[u]);
            if (u % tile != 0 || v % tile != 0 || u + tile > u1 + 1 || v + tile > v1 + 1) continue;
            float of_tile = 100.0F;
            for (int y = v; y != v + tile; ++y)
              for (int x = u; x != u + tile; ++x)
                if (kind == 0 || d.row(y)[x] > 0.0F) of_tile = std::min(of_tile, d.row(y)[x]);
            least = std::min(least, of_tile == 100.0F ? 0.0F : of_tile);
          }
        REQUIRE(farthest * 1.000001F >= most);
        REQUIRE(nearest <= least * 1.000001F);
      }
    }
  }
}

TEST_CASE("A box of the whole image finds its nearest and its farthest end to a rounding") {
  random_bits random{132};
  depths d{random, 64, 64};
  for (float& z : d.z) z = z > 0.0F ? z : 0.0F;
  for (int v = 0; v != 64; ++v)
    for (int u = 0; u != 64; ++u) d.row(v)[u] = 2.0F + 0.01F * static_cast<float>((u * 7 + v * 3) % 50);
  depth_pyramid pyramid;
  pyramid.build(64, 64, 2.49F, [&](int v) { return d.row(v); });
  const auto k = static_cast<std::size_t>(pyramid.levels());
  std::uint32_t ends = 0;
  for (int i = 0; i != pyramid.width()[k] * pyramid.width()[k]; ++i)
    ends = octree::detail::larger_halves(ends, pyramid.data()[pyramid.begin()[k] + i]);
  CHECK(static_cast<float>(ends >> 16U) / pyramid.scale() == Approx(2.49).epsilon(1e-4));
  CHECK(static_cast<float>(65535U - (ends & 0xffffU)) / pyramid.scale() == Approx(2.0).epsilon(1e-4));
}

TEST_CASE("Every instruction set builds the same pyramid") {
  random_bits random{133};
  for (int run = 0; run != 20; ++run) {
    depths d{random, 1 + static_cast<int>(random.below(150)), 1 + static_cast<int>(random.below(60))};
    depth_pyramid found;
    const simd::level_limit limit{simd::level::portable};
    depth_pyramid expected;
    for (depth_pyramid* p : {&expected, &found}) p->build(d.width, d.height, d.max_z, [&](int v) { return d.row(v); });
    REQUIRE(expected.family() == found.family());
    REQUIRE(std::equal(expected.data(), expected.data() + 3 * expected.family(), found.data()));
  }
}
