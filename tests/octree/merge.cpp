// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include <orbis/core/so3.hpp>
#include <orbis/octree/merge.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

template <class Model = log_odds<>>
occupancy_octree<Model> scanned(std::uint64_t seed, double resolution, int scans) {
  random_bits random{seed};
  occupancy_octree<Model> map{resolution};
  for (int i = 0; i != scans; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.4)[0];
    map.integrate(test::shell_scan(random, 500, origin), origin);
  }
  return map;
}

/// Every voxel of both maps, asked one by one.
template <class Map, class Check>
void for_each_voxel_of(const Map& a, const Map& b, Check&& check) {
  for (const Map* map : {&a, &b})
    map->for_each_leaf([&](const auto& leaf) {
      const std::uint32_t cells = node_cells(map->tree_depth() - leaf.depth);
      for (std::uint32_t z = 0; z != cells; ++z)
        for (std::uint32_t y = 0; y != cells; ++y)
          for (std::uint32_t x = 0; x != cells; ++x) check(voxel_key{leaf.key.x + x, leaf.key.y + y, leaf.key.z + z});
    });
}

template <class Model>
void check_sum() {
  const auto a = scanned<Model>(1, 0.1, 5), b = scanned<Model>(2, 0.1, 9);
  auto sum = a;
  const auto summary = merge(sum, b);
  CHECK(summary.merged > 1000);
  CHECK_FALSE(summary.cancelled);
  for_each_voxel_of(sum, b, [&](const voxel_key& k) {
    const auto va = a.value(k), vb = b.value(k), got = sum.value(k);
    REQUIRE(got.has_value() == (va.has_value() || vb.has_value()));
    if (!got) return;
    const double expected =
        vb ? std::clamp<double>(static_cast<double>(va.value_or(0)) + static_cast<double>(*vb), Model::clamp_min,
                                Model::clamp_max)
           : static_cast<double>(*va);
    REQUIRE(static_cast<double>(*got) == Approx(expected).margin(1e-6));
  });
}

}  // namespace

TEST_CASE("Two maps of one frame become their sum voxel by voxel within the bounds") {
  check_sum<log_odds<>>();
  check_sum<log_odds<std::int16_t>>();
  check_sum<log_odds<std::int8_t>>();
}

TEST_CASE("Merging with an empty map changes nothing and into an empty map copies") {
  const auto a = scanned(3, 0.05, 4);
  auto same = a;
  CHECK(merge(same, occupancy_octree<>{0.05}).merged == 0);
  CHECK(ot_bytes(same) == ot_bytes(a));
  occupancy_octree<> copy{0.05};
  merge(par.with(3), copy, a);
  CHECK(ot_bytes(copy) == ot_bytes(a));
}

TEST_CASE("A shift by whole voxels shifts the map") {
  const auto a = scanned(4, 0.125, 4);
  occupancy_octree<> moved{0.125};
  merge(moved, a, se3{so3{}, vec3{1.25, -0.5, 3.75}});
  std::size_t known = 0;
  for_each_voxel_of(a, a, [&](const voxel_key& k) {
    REQUIRE(moved.value(voxel_key{k.x + 10, k.y - 4, k.z + 30}) == a.value(k));
    ++known;
  });
  CHECK(moved.counts().nodes > 0);
  CHECK(known > 0);
  occupancy_octree<> back{0.125};
  merge(back, moved, se3{so3{}, vec3{-1.25, 0.5, -3.75}});
  CHECK(ot_bytes(back) == ot_bytes(a));
}

TEST_CASE("A turned map is found where it was turned to without holes and by any number of threads alike") {
  const auto a = scanned(5, 0.1, 6);
  const se3 T{so3::exp(vec3{0.3, -0.8, 1.1}), vec3{0.7, -0.2, 0.4}};
  occupancy_octree<> turned{0.05}, again{0.05};
  merge(turned, a, T);
  merge(par.with(3), again, a, T);
  CHECK(ot_bytes(turned) == ot_bytes(again));
  // Every voxel of the turned map says what lies at its centre in the original, known or not.
  const se3 inverse = T.inverse();
  std::size_t known = 0;
  random_bits random{6};
  for (int i = 0; i != 200000; ++i) {
    const auto key = turned.grid().key(test::random_points(random, 1, 3.0)[0]);
    REQUIRE(key);
    const auto expected = a.value(vec3(inverse.rotation_matrix() * turned.grid().center(*key) + inverse.translation()));
    REQUIRE(turned.value(*key) == expected);
    known += expected ? 1 : 0;
  }
  CHECK(known > 10000);
}

TEST_CASE("Large leaves are merged and a merge can be stopped") {
  occupancy_octree<> large{0.1}, into{0.1};
  large.set_unknown_node({32768, 32768, 32768}, 11, -1.0F);  // 32 voxels wide
  merge(into, large);
  CHECK(into.value(vec3{3.15, 3.15, 0.05}) == -1.0F);
  CHECK_FALSE(into.value(vec3{3.25, 3.15, 0.05}));
  CHECK(into.num_leaves() == 1);

  int asked = 0;
  const auto summary = merge(into, large, {}, [&](std::size_t, std::size_t) { return ++asked > 5; });
  CHECK(summary.cancelled);
  CHECK(summary.merged == 0);
}

TEST_CASE("A map merged with itself is merged with what it was") {
  auto a = scanned(7, 0.05, 6);
  const auto before = a;
  const se3 T{so3{}, vec3{0.0, 0.0, 0.2}};
  auto expected = a;
  merge(expected, before, T);
  merge(a, a, T);
  CHECK(ot_bytes(a) == ot_bytes(expected));
}

TEST_CASE("A huge leaf is taken over whole") {
  occupancy_octree<> large{0.1}, into{0.1};
  large.set_unknown_node({32768, 32768, 32768}, 2, -1.0F);  // 1.6 km wide
  large.set_unknown_node({0, 0, 0}, 16, 2.0F);
  const auto summary = merge(into, large);
  CHECK(summary.merged == (std::size_t{1} << 42U) + 1);
  CHECK(ot_bytes(into) == ot_bytes(large));
}

TEST_CASE("A leaf that is taken over whole gets nothing twice from its neighbours") {
  occupancy_octree<> from{0.1}, into{0.1};
  from.set_unknown_node({32768 + 16, 32768, 32768 + 32}, 12, -0.4F);  // 16 voxels wide
  from.set_unknown_node({32768 + 16, 32768, 32768 + 28}, 14, 0.8F);   // 4 voxels wide, below it
  merge(into, from);
  CHECK(ot_bytes(into) == ot_bytes(from));
}
