// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <sstream>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/interop/octomap.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/octants.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

[[nodiscard]] std::string ot_of(const octomap::OcTree& tree) {
  std::streambuf* const err = std::cerr.rdbuf(nullptr);  // OctoMap reports there
  std::ostringstream out;
  tree.write(out);
  std::cerr.rdbuf(err);
  std::cerr.clear();
  return out.str();
}

[[nodiscard]] octree::occupancy_octree<> some_map() {
  octree::occupancy_octree<> map{0.05};
  random_bits random{61};
  for (int scan = 0; scan != 8; ++scan) {
    std::vector<vec3f> points(500);
    for (vec3f& p : points)
      p = vec3f{static_cast<float>(random.normal()), static_cast<float>(random.normal()),
                static_cast<float>(random.normal())}
              .normalized();
    map.integrate(points, vec3f{0.1F, 0.0F, 0.0F});
  }
  return map;
}

}  // namespace

TEST_CASE("A map becomes the OctoMap tree with the same nodes and values") {
  const auto map = some_map();
  const auto tree = interop::to_octomap(map);
  REQUIRE(tree);
  CHECK(ot_of(*tree) == octree::ot_bytes(map));
  CHECK(tree->size() == map.size());
  CHECK(tree->size() == tree->calcNumNodes());
  CHECK(tree->getNumLeafNodes() == map.num_leaves());
  const octomap::OcTree fresh{0.05};
  CHECK(tree->getProbHitLog() == fresh.getProbHitLog());
  CHECK(tree->getProbMissLog() == fresh.getProbMissLog());
  CHECK(tree->getClampingThresMinLog() == fresh.getClampingThresMinLog());
  CHECK(tree->getClampingThresMaxLog() == fresh.getClampingThresMaxLog());
  CHECK(tree->getOccupancyThresLog() == fresh.getOccupancyThresLog());
}

TEST_CASE("A converted tree goes on like one that OctoMap made") {
  auto map = some_map();
  const auto tree = interop::to_octomap(map);
  octomap::Pointcloud cloud;
  std::vector<vec3f> points;
  random_bits random{62};
  for (int i = 0; i != 200; ++i) {
    points.emplace_back(static_cast<float>(random.uniform(-1, 1)), static_cast<float>(random.uniform(-1, 1)), 0.8F);
    cloud.push_back(points.back().x(), points.back().y(), points.back().z());
  }
  tree->insertPointCloud(cloud, {0.0F, 0.0F, 0.0F});
  map.integrate(points, vec3f{0.0F, 0.0F, 0.0F});
  CHECK(ot_of(*tree) == octree::ot_bytes(map));
}

TEST_CASE("An OctoMap tree becomes the same map and comes back as it was") {
  octomap::OcTree tree{0.1};
  random_bits random{63};
  for (int i = 0; i != 3000; ++i)
    tree.updateNode(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.below(2) == 0);
  const auto map = interop::from_octomap(tree);
  REQUIRE(map);
  CHECK(octree::ot_bytes(*map) == ot_of(tree));
  CHECK(ot_of(*interop::to_octomap(*map)) == ot_of(tree));
}

TEST_CASE("Leaves of every size survive the conversion") {
  // A pruned leaf at each depth, made by a file, since no scan fills an eighth of the world.
  for (int depth = 1; depth <= octree::default_tree_depth; ++depth) {
    std::string file =
        "# Octomap OcTree binary file\nid OcTree\nsize " + std::to_string(depth + 2) + "\nres 0.1\ndata\n";
    for (int d = 1; d != depth; ++d) file += std::string{"\x03\x00", 2};
    file += std::string{"\x06\x00", 2};
    std::istringstream in{file};
    const auto map = octree::read_bt(in);
    REQUIRE(map);
    const auto tree = interop::to_octomap(*map);
    CHECK(ot_of(*tree) == octree::ot_bytes(*map));
    CHECK(octree::ot_bytes(interop::from_octomap(*tree).value()) == octree::ot_bytes(*map));
  }
}

TEST_CASE("Empty maps convert and values that are no numbers are refused") {
  CHECK(interop::to_octomap(octree::occupancy_octree<>{0.1})->size() == 0);
  octomap::OcTree tree{0.1};
  CHECK(interop::from_octomap(tree)->empty());
  tree.updateNode(0.0, 0.0, 0.0, true)->setLogOdds(std::numeric_limits<float>::quiet_NaN());
  const auto refused = interop::from_octomap(tree);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == errc::malformed);
}

namespace {

[[nodiscard]] octree::voxel_layer<octree::rgb_mean> some_colors(const octree::occupancy_octree<>& map) {
  octree::voxel_layer<octree::rgb_mean> colors;
  map.for_each_leaf([&](const auto& leaf) {
    if (!leaf.occupied) return;
    const std::uint32_t cells = octree::node_cells(map.tree_depth() - leaf.depth);
    for (std::uint32_t i = 0; i != cells * cells * cells; ++i) {
      const octree::voxel_key key{leaf.key.x + i % cells, leaf.key.y + i / cells % cells,
                                  leaf.key.z + i / cells / cells};
      // Two colours in patches of 4x4x4, so that some leaves have one colour and others several.
      const bool red = ((key.x >> 2U ^ key.y >> 2U ^ key.z >> 2U) & 1U) != 0;
      colors.make(key).update(red ? rgb8{200, 10, 10} : rgb8{static_cast<std::uint8_t>(key.x & 127U), 100, 30});
    }
  });
  return colors;
}

}  // namespace

TEST_CASE("A map with colours becomes a ColorOcTree in which every voxel has its own") {
  const auto map = some_map();
  const auto colors = some_colors(map);
  REQUIRE(colors.size() > 500);
  const auto tree = interop::to_octomap(map, colors);
  REQUIRE(tree);
  CHECK(tree->size() == tree->calcNumNodes());
  CHECK(tree->size() >= map.size());
  std::size_t colored = 0;
  for (auto it = tree->begin_leafs(), end = tree->end_leafs(); it != end; ++it) {
    const octree::voxel_key key{it.getKey()[0], it.getKey()[1], it.getKey()[2]};
    REQUIRE(map.log_odds(key) == it->getLogOdds());
    const auto* const color = colors.find(key);
    REQUIRE(it->isColorSet() == (color != nullptr));
    if (color == nullptr) continue;
    const auto c = it->getColor();
    REQUIRE(color->color() == rgb8{c.r, c.g, c.b});
    const auto cells = std::size_t{1} << (tree->getTreeDepth() - it.getDepth());
    colored += cells * cells * cells;
  }
  CHECK(colored == colors.size());
  // Without the colours it is the tree without colours.
  tree->prune();
  CHECK(tree->size() == map.size());
  const auto back = interop::from_octomap(*tree);
  REQUIRE(back);
  CHECK(octree::ot_bytes(back->map) == octree::ot_bytes(map));
}

TEST_CASE("Inner nodes of a ColorOcTree average their children's colours") {
  const auto map = some_map();
  const auto tree = interop::to_octomap(map, some_colors(map));
  for (auto it = tree->begin_tree(), end = tree->end_tree(); it != end; ++it) {
    if (it.isLeaf()) continue;
    REQUIRE(it->getColor() == it->getAverageChildColor());
    REQUIRE(it->getLogOdds() == it->getMaxChildLogOdds());
  }
}

TEST_CASE("A ColorOcTree comes back as the map and the colours it was made of") {
  const auto map = some_map();
  const auto colors = some_colors(map);
  const auto back = interop::from_octomap(*interop::to_octomap(map, colors));
  REQUIRE(back);
  CHECK(octree::ot_bytes(back->map) == octree::ot_bytes(map));
  CHECK(back->colors.size() == colors.size());
  colors.for_each([&](const octree::voxel_key& key, const octree::rgb_mean& color) {
    REQUIRE(back->colors.find(key) != nullptr);
    REQUIRE(back->colors.find(key)->color() == color.color());
  });
}

TEST_CASE("A ColorOcTree that OctoMap made is read as it is") {
  octomap::ColorOcTree tree{0.1};
  random_bits random{64};
  for (int i = 0; i != 3000; ++i) {
    const float x = static_cast<float>(random.uniform(-1, 1)), y = static_cast<float>(random.uniform(-1, 1)), z = 0.3F;
    tree.updateNode(x, y, z, random.below(3) != 0);
    tree.integrateNodeColor(x, y, z, static_cast<std::uint8_t>(random.below(256)), 7, 9);
  }
  const auto read = interop::from_octomap(tree);
  REQUIRE(read);
  std::size_t voxels = 0;
  for (auto it = tree.begin_leafs(), end = tree.end_leafs(); it != end; ++it) {
    const octree::voxel_key key{it.getKey()[0], it.getKey()[1], it.getKey()[2]};
    REQUIRE(read->map.log_odds(key) == it->getLogOdds());
    REQUIRE(read->colors.find(key) != nullptr);
    REQUIRE(read->colors.find(key)->color() == rgb8{it->getColor().r, it->getColor().g, it->getColor().b});
    voxels += std::size_t{1} << (3 * (tree.getTreeDepth() - it.getDepth()));
  }
  CHECK(read->colors.size() == voxels);
}

TEST_CASE("Colours without a map, maps without colours and coloured leaves of half the world") {
  const octree::voxel_layer<octree::rgb_mean> none;
  CHECK(interop::to_octomap(octree::occupancy_octree<>{0.1}, none)->size() == 0);
  const auto map = some_map();
  const auto plain = interop::to_octomap(map, none);
  CHECK(plain->size() == map.size());
  CHECK(interop::from_octomap(*plain)->colors.empty());
  CHECK(octree::ot_bytes(interop::from_octomap(*plain)->map) == octree::ot_bytes(map));

  octree::voxel_layer<octree::rgb_mean> elsewhere;
  elsewhere.make({1, 2, 3}).update({1, 2, 3});
  CHECK(interop::to_octomap(map, elsewhere)->size() == map.size());

  // One colour in an eighth of the world splits it down to the voxel, and nothing else.
  octree::occupancy_octree<> large{0.1};
  large.set_unknown_node({}, 1, 1.0F);
  const auto split = interop::to_octomap(large, elsewhere);
  CHECK(split->size() == 1 + 1 + 8 * 15);
  CHECK(split->search(octomap::OcTreeKey{1, 2, 3})->getColor() == octomap::ColorOcTreeNode::Color{1, 2, 3});
  auto one = interop::to_octomap(large, none);
  one->getNodeChild(one->getRoot(), 0)->setColor(1, 2, 3);
  const auto refused = interop::from_octomap(*one);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == errc::unsupported);
}

TEST_CASE("Planning reads an OctoMap tree in place, as the map that it is a copy of") {
  static_assert(nav::planning_map<octomap::OcTree>);
  octree::occupancy_octree<> map = some_map();
  map.set_unknown_node({32768 + 512, 32768, 32768}, 7, -0.5F);  // and a leaf of 512 voxels
  const auto tree = interop::to_octomap(map);
  std::size_t octants = 0, large = 0, wrong = 0;
  auto read = nav::map_access<octomap::OcTree>::octants(*tree);
  octree::octant_reader expected{map};
  nav::map_access<octomap::OcTree>::for_each_octant(
      *tree, [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
        ++octants;
        large += level == 9 ? 1U : 0U;
        wrong += s == expected(k) && s == read(k) && s.known != 0 ? 0U : 1U;
      });
  octree::for_each_octant(map, [&](const octree::voxel_key& k, int, const octree::octant_states& s) {
    wrong += read({k.x + 3, k.y + 1, k.z + 2}) == s ? 0U : 1U;
  });
  CHECK(octants > 500);
  CHECK(large == 1);
  CHECK(wrong == 0);
  CHECK(read({1, 2, 3}) == octree::octant_states{});
  for (const octree::occupancy unknown : {octree::occupancy::free, octree::occupancy::occupied}) {
    const nav::distance_field_options options{.reach = 0.4, .unknown = unknown};
    nav::distance_field theirs{*tree, options};
    const nav::distance_field ours{map, options};
    CHECK(theirs.voxels().brick_count() == ours.voxels().brick_count());
    const auto differences = [&] {
      std::size_t count = 0;
      ours.voxels().for_each_brick([&](const octree::voxel_key& low, auto values) {
        for (std::uint32_t i = 0; i != 512; ++i)
          count += theirs.voxels().squared({low.x + (i & 7U), low.y + (i >> 3U & 7U), low.z + (i >> 6U)}) != values[i];
      });
      return count;
    };
    CHECK(differences() == 0);
    theirs.update(*tree);
    CHECK(differences() == 0);
  }
  const auto theirs = nav::make_floor_map(*tree, {}, {.floor = -0.5});
  const auto ours = nav::make_floor_map(map, {}, {.floor = -0.5});
  REQUIRE((theirs.has_value() && ours.has_value()));
  CHECK(theirs->states == ours->states);
  CHECK(nav::find_floor(*tree) == nav::find_floor(map));
  // A tree without anything.
  const octomap::OcTree nothing{0.05};
  CHECK(nav::map_access<octomap::OcTree>::octants(nothing)({5, 5, 5}) == octree::octant_states{});
  CHECK(nav::distance_field{nothing}.voxels().brick_count() == 0);
}
