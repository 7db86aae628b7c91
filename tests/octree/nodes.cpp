// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <optional>

#include <orbis/octree/nodes.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

struct scene : test::twin_maps {
  scene() : twin_maps{71, 5} {}
};

/// The mean by its definition, from the leaves OctoMap has.
std::optional<double> mean_probability(const octomap::OcTree& tree, const octomap::OcTreeNode* node) {
  if (node == nullptr) return std::nullopt;
  if (!tree.nodeHasChildren(node)) return node->getOccupancy();
  double sum = 0.0;
  int count = 0;
  for (unsigned i = 0; i != 8; ++i)
    if (tree.nodeChildExists(node, i)) {
      sum += *mean_probability(tree, tree.getNodeChild(node, i));
      ++count;
    }
  return sum / count;
}

}  // namespace

TEST_CASE("The nodes of every depth are those that OctoMap finds") {
  const scene room;
  random_bits random{72};
  std::size_t kinds[3] = {};
  for (int depth = 1; depth <= default_tree_depth; ++depth) {
    const bool is_large = depth < default_tree_depth - chunk_level;
    for (int i = 0; i != (is_large ? 200 : 3000); ++i) {
      const vec3f p = test::random_points(random, 1, i % 2 == 0 ? 2.5 : 1.4)[0];
      const auto* const expected = room.theirs.search(test::to_octomap(p), static_cast<unsigned>(depth));
      const auto node = find_node(room.ours, p, depth);
      REQUIRE(node.is_known() == (expected != nullptr));
      ++kinds[static_cast<std::size_t>(node.kind)];
      if (expected == nullptr) continue;
      REQUIRE(node.value == expected->getLogOdds());
      REQUIRE((node.kind == node_kind::inner) == room.theirs.nodeHasChildren(expected));
      REQUIRE((node_state(room.ours, p, depth) == occupancy::occupied) == room.theirs.isNodeOccupied(expected));
    }
  }
  for (const std::size_t n : kinds) CHECK(n > 500);
  CHECK(find_node(room.ours, voxel_key{}, 0).value == room.theirs.getRoot()->getLogOdds());
  CHECK(!find_node(room.ours, vec3{1e9, 0.0, 0.0}, 3).is_known());
}

TEST_CASE("The mean over children is the mean of their probabilities") {
  const scene room;
  random_bits random{73};
  int checked = 0;
  for (int depth = 8; depth <= default_tree_depth; ++depth)
    for (int i = 0; i != 150; ++i) {
      const vec3f p = test::random_points(random, 1, 1.8)[0];
      const auto expected =
          mean_probability(room.theirs, room.theirs.search(test::to_octomap(p), static_cast<unsigned>(depth)));
      const auto node = find_node(room.ours, p, depth, mean_of_children{});
      REQUIRE(node.is_known() == expected.has_value());
      if (!expected) continue;
      CHECK(std::fabs(probability_of<octree::log_odds<>>(node.value) - *expected) < 1e-6);
      ++checked;
    }
  CHECK(checked > 500);
}

TEST_CASE("Leaves larger than a brick are found at their own depth and below, and merge above") {
  occupancy_octree<> map{0.1};
  const voxel_key base{32768, 32768, 32768};
  for (unsigned i = 0; i != 8; ++i) map.set_unknown_node(child_key(base, i, 16), 12, i == 5 ? 2.0F : -1.0F);
  for (int depth = 12; depth <= 16; ++depth) {
    const auto node = find_node(map, voxel_key{base.x + 3, base.y + 18, base.z + 7}, depth);
    CHECK(node.kind == node_kind::leaf);
    CHECK(node.value == -1.0F);
  }
  for (int depth = 0; depth != 12; ++depth) {
    const auto node = find_node(map, base, depth);
    CHECK(node.kind == node_kind::inner);
    CHECK(node.value == 2.0F);
  }
  CHECK(!find_node(map, voxel_key{base.x - 1, base.y, base.z}, 12).is_known());

  occupancy_octree<> same{0.1};
  for (unsigned i = 0; i != 8; ++i) same.set_unknown_node(child_key(base, i, 16), 12, -1.0F);
  CHECK(find_node(same, base, 11).kind == node_kind::leaf);
  CHECK(find_node(same, base, 10).kind == node_kind::inner);
}
