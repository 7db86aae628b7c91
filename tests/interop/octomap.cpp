// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <limits>
#include <sstream>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/interop/octomap.hpp>

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
