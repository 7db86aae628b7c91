// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::frontiers;
using octree::occupancy;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;
using voxel = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;

/// All free voxels with an unknown neighbour across a face, by asking for each voxel.
std::set<voxel> by_brute_force(const map_type& map) {
  std::set<voxel> found;
  const std::uint32_t cells = map.grid().cells();
  const auto is_unknown = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return std::max({x, y, z}) < cells && !map.value(voxel_key{x, y, z});
  };
  map.for_each_leaf([&](const auto& leaf) {
    if (leaf.occupied) return;
    const std::uint32_t size = octree::node_cells(map.tree_depth() - leaf.depth);
    for (std::uint32_t z = leaf.key.z; z != leaf.key.z + size; ++z)
      for (std::uint32_t y = leaf.key.y; y != leaf.key.y + size; ++y)
        for (std::uint32_t x = leaf.key.x; x != leaf.key.x + size; ++x)
          if (is_unknown(x - 1, y, z) || is_unknown(x + 1, y, z) || is_unknown(x, y - 1, z) ||
              is_unknown(x, y + 1, z) || is_unknown(x, y, z - 1) || is_unknown(x, y, z + 1))
            found.insert({x, y, z});
  });
  return found;
}
template <class Visit>
void for_each_voxel(const std::vector<nav::frontier_octant>& octants, Visit&& visit) {
  for (const auto& [octant, mask] : octants)
    for (std::uint64_t rest = mask; rest != 0; rest &= rest - 1) {
      const voxel_key in = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(rest)));
      visit(voxel{octant.x + in.x, octant.y + in.y, octant.z + in.z});
    }
}
std::set<voxel> voxels_of(const std::vector<nav::frontier_octant>& octants) {
  std::set<voxel> found;
  for_each_voxel(octants, [&](const voxel& v) { found.insert(v); });
  return found;
}
void check_same(const frontiers& f, const map_type& map) {
  const std::set<voxel> truth = by_brute_force(map);
  CHECK(voxels_of(f.octants()) == truth);
  CHECK(f.size() == truth.size());
  CHECK(f.octants() == frontiers{map}.octants());
}

/// Octants somewhere in a small box get random states; often only a voxel of them changes.
void change(map_type& map, random_bits& random, std::uint32_t corner, std::uint32_t width) {
  for (std::uint32_t i = 0, n = 1 + random.below(6); i != n; ++i) {
    const voxel_key k{corner + random.below(width), corner + random.below(width), corner + random.below(width)};
    const std::uint32_t kind = random.below(6);
    map.edit_octant(k, [&](auto& voxels) {
      const auto here = std::uint64_t{1} << (octree::morton_code(k) & 63U);
      if (kind == 0) voxels.known = 0;
      if (kind == 1) voxels.known &= ~here;
      if (kind == 2) voxels.known = random() | random();
      if (kind >= 3) voxels.known |= kind == 3 ? ~std::uint64_t{0} : here;
      if (kind == 2 || kind == 3)
        for (float& v : voxels.value) v = random.below(4) == 0 ? 1.0F : -1.0F;
      else
        voxels.value[octree::morton_code(k) & 63U] = kind == 4 ? 1.0F : -1.0F;
    });
  }
}

}  // namespace

TEST_CASE("The frontier is that of brute force after every change") {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    random_bits random{seed};
    map_type map{0.1, 8};
    map.track_changes();
    frontiers f{map};
    CHECK(f.empty());
    const std::uint32_t corner = seed == 1 ? 0 : seed == 2 ? 256 - 20 : 120;  // also at the grid's edges
    for (int i = 0; i != 150; ++i) {
      change(map, random, corner, 20);
      if (i % 40 == 20) {  // a large leaf, and what makes one
        const std::uint32_t at = seed == 1 ? 32 : 64;
        if (i == 20) map.set_unknown_node({at, at, 0}, 3, -1.0F);
        map.prune();
      }
      if (i == 70) map.edit_octant({64, 70, 3}, [](auto& voxels) { voxels.known = 0x5a5a; });  // splits it
      if (i % 40 == 30) map.transform([](float v) { return std::optional{-v}; });
      if (i % 40 == 35) map.evict_outside({vec3::Constant(-0.8), vec3::Constant(0.9)}, [](const auto&) {});
      if (i == 100) map.track_changes(false);
      if (i == 110) map.track_changes();
      if (i == 120) map.clear();
      if (i % 3 == 0) continue;
      f.update(map);
      check_same(f, map);
    }
    frontiers all{map.grid()};
    all.update_all(map);
    CHECK(all.octants() == f.octants());
    CHECK_FALSE(f.empty());
    CHECK(f.memory_bytes() > 0);
  }
}

TEST_CASE("The frontier of random maps, and of a leaf as wide as the grid") {
  for (std::uint64_t seed = 1; seed != 40; ++seed) {
    random_bits random{seed};
    map_type map{0.1, 6};
    for (int i = 0; i != 30; ++i) change(map, random, random.below(50), 1 + random.below(14));
    check_same(frontiers{map}, map);
  }
  map_type map{0.1, 6};
  map.set_unknown_node({0, 0, 0}, 0, -1.0F);
  CHECK(frontiers{map}.empty());  // nothing is unknown inside of the grid
  map.edit_octant({20, 20, 20}, [](auto& voxels) { voxels.known = 0; });
  const frontiers f{map};
  CHECK(f.size() == 6 * 16);
  check_same(f, map);
  CHECK(f.contains({19, 20, 20}));
  CHECK_FALSE(f.contains({20, 20, 20}));
  CHECK_FALSE(f.contains({18, 20, 20}));
}

TEST_CASE("Leaves with too large faces are left out, and it is said") {
  map_type map{0.1};
  map.track_changes();
  map.set_unknown_node({0, 0, 0}, 1, -1.0F);                  // an eighth of the grid
  map.set_unknown_node({40'000, 40'000, 40'000}, 11, -1.0F);  // 32 voxels
  frontiers f{map};
  CHECK_FALSE(f.is_complete());
  CHECK(f.size() == 32 * 32 * 32 - 30 * 30 * 30);
  CHECK(f.memory_bytes() < 1'000'000);
  const std::uint32_t last = 32767;
  map.edit_octant({last, 100, 100}, [](auto& voxels) { voxels.known &= ~std::uint64_t{1}; });
  f.update(map);
  CHECK(f.contains({last, 100, 100}));
  for (const std::size_t most : {295U, 296U}) {  // 8^3 - 6^3 octants
    const frontiers g{map, {.max_octants = most}};
    CHECK((g.size() > 1000) == (most == 296));
    CHECK_FALSE(g.is_complete());
  }
  map.clear();
  f.update(map);
  CHECK(f.is_complete());
  CHECK(f.empty());
  CHECK_FALSE(f.contains({0U - 1, 0, 0}));
}

TEST_CASE("The frontier follows copies of a map, whatever their revisions are") {
  random_bits random{6};
  map_type map{0.1, 8};
  map.track_changes();
  std::vector<std::pair<map_type, std::uint64_t>> snapshots{{map, map.changes().revision()}};
  frontiers f{map.grid()};
  for (int i = 0; i != 24; ++i) {
    change(map, random, 120, 16);
    snapshots.emplace_back(map, map.changes().revision());
    if (i == 8) map.changes().set_capacity(10);
    if (i == 16) map.changes().forget_before(map.changes().revision() - 1);
    for (const std::size_t back : {2U, 1U, 3U}) {
      const auto& [copy, revision] = snapshots[snapshots.size() - std::min<std::size_t>(back, snapshots.size())];
      f.update(copy, map.changes(), revision);
      check_same(f, copy);
    }
  }
}

TEST_CASE("Clusters are the connected components") {
  for (std::uint64_t seed = 1; seed != 25; ++seed) {
    random_bits random{seed};
    map_type map{0.1, 8};
    for (int i = 0; i != 25; ++i) change(map, random, 100, 40);
    const frontiers f{map};
    // By flooding from voxel to voxel.
    std::set<voxel> left = voxels_of(f.octants());
    std::set<std::set<voxel>> components;
    while (!left.empty()) {
      std::set<voxel> component;
      std::queue<voxel> open;
      open.push(*left.begin());
      left.erase(left.begin());
      for (; !open.empty(); open.pop()) {
        const auto [x, y, z] = open.front();
        component.insert(open.front());
        for (std::uint32_t i = 0; i != 27; ++i) {
          const voxel n{x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1};
          if (left.erase(n) != 0) open.push(n);
        }
      }
      components.insert(component);
    }
    const auto clusters = f.clusters();
    CHECK(clusters.size() == components.size());
    std::size_t last = ~std::size_t{0}, large = 0;
    for (const nav::frontier_cluster& c : clusters) {
      const std::set<voxel> voxels = voxels_of(c.octants);
      CHECK(components.count(voxels) == 1);
      CHECK(c.size == voxels.size());
      CHECK(c.size <= last);
      last = c.size;
      large += c.size >= 30 ? 1 : 0;
      vec3 mean = vec3::Zero();
      for (const auto& [x, y, z] : voxels) mean += map.grid().center(voxel_key{x, y, z}) / double(voxels.size());
      CHECK((mean - c.center).norm() < 1e-9);
      CHECK(voxels.count({c.voxel.x, c.voxel.y, c.voxel.z}) == 1);
      for (const auto& [x, y, z] : voxels)
        CHECK((map.grid().center(c.voxel) - c.center).norm() <=
              (map.grid().center(voxel_key{x, y, z}) - c.center).norm());
    }
    CHECK(f.clusters({.min_size = 30}).size() == large);
  }
}
