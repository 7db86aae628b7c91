// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include <orbis/octree/detail/storage/leaves.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>

#include "octree/pruned_tree.hpp"
#include "octree/support.hpp"
#include "support/catch.hpp"

namespace {

using namespace orbis;
using octree::voxel_key;
using found_leaf = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, int, float>;

/// What the tree with all its inner nodes says.
struct tree_visitor {
  std::vector<found_leaf>& leaves;
  std::size_t& inner_nodes;
  void leaf(const voxel_key& k, int level, float v) { leaves.emplace_back(k.x, k.y, k.z, level, v); }
  template <class Children>
  void inner(const voxel_key&, int, float, const Children&) {
    ++inner_nodes;
  }
};

void check_against_tree(const octree::detail::brick_store<float>& store) {
  std::vector<found_leaf> leaves, expected;
  const std::size_t inner = octree::detail::visit_leaves(
      store, octree::default_tree_depth,
      [&](const voxel_key& k, int level, float v) { leaves.emplace_back(k.x, k.y, k.z, level, v); });
  std::size_t expected_inner = 0;
  const auto identity = [](float v) { return v; };
  test::pruned_tree<float, decltype(identity)>{store, octree::default_tree_depth, identity}.visit(
      tree_visitor{expected, expected_inner});
  CHECK(leaves == expected);
  CHECK(inner == expected_inner);
}

/// Eight random children: unknown, leaves, or with children of their own; all leaves `only`, if given.
void fill(octree::detail::brick_store<float>& store, random_bits& random, const voxel_key& key, int level,
          std::optional<float> only) {
  const std::uint32_t deeper = random.below(8);
  for (unsigned i = 0; i != 8; ++i) {
    const voxel_key child = octree::child_key(key, i, octree::node_cells(level - 1));
    const auto value = static_cast<float>(random.below(2));
    if (level > 1 && (i == deeper || random.below(16) == 0))
      fill(store, random, child, level - 1, only || random.below(4) != 0 ? only : std::optional{value});
    else if (only || random.below(3) != 0)
      store.set_node(child, level - 1, only.value_or(value));
  }
}

}  // namespace

TEST_CASE("Leaves of all sizes come as the tree with its inner nodes has them") {
  random_bits random{7};
  for (int round = 0; round != 50; ++round) {
    octree::detail::brick_store<float> store;
    fill(store, random, {}, octree::default_tree_depth, std::nullopt);
    check_against_tree(store);
  }
}

TEST_CASE("Sixty-four equal bricks are one leaf and one that differs breaks it up") {
  octree::detail::brick_store<float> store;
  for (std::uint32_t i = 0; i != 64; ++i)
    store.set_node({(i & 3U) * 8, (i >> 2U & 3U) * 8, (i >> 4U) * 8}, octree::detail::brick_level, 2.0F);
  std::vector<int> levels;
  const auto note = [&](const voxel_key&, int level, float) { levels.push_back(level); };
  CHECK(octree::detail::visit_leaves(store, octree::default_tree_depth, note) ==
        std::size_t{octree::default_tree_depth - octree::detail::chunk_level});
  CHECK(levels == std::vector<int>{octree::detail::chunk_level});
  check_against_tree(store);

  store.make_uniform(store.make({24, 0, 0}), 5, 1.0F);
  levels.clear();
  octree::detail::visit_leaves(store, octree::default_tree_depth, note);
  CHECK(levels.size() == 7 + 7 + 8);
  check_against_tree(store);
}

TEST_CASE("The leaves of a real map come as the tree with its inner nodes has them") {
  random_bits random{3};
  octree::occupancy_octree<> map{0.05};
  for (int i = 0; i != 4; ++i) {
    const vec3f origin{0.1F * static_cast<float>(i), 0.0F, 0.0F};
    map.integrate(test::shell_scan(random, 3000, origin), origin);
  }
  std::vector<found_leaf> leaves, expected;
  std::size_t inner = 0;
  map.for_each_leaf(
      [&](const auto& l) { leaves.emplace_back(l.key.x, l.key.y, l.key.z, map.tree_depth() - l.depth, l.log_odds); });
  const auto identity = [](float v) { return v; };
  test::pruned_tree<float, decltype(identity)>{map.store(), map.tree_depth(), identity}.visit(
      tree_visitor{expected, inner});
  CHECK(leaves.size() > 1000);
  CHECK(leaves == expected);
  CHECK(map.counts().nodes == inner + leaves.size());
}

TEST_CASE("A map that is all one value keeps its root as OctoMap does and can be read back") {
  const std::string header =
      "# Octomap OcTree binary file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
      "id OcTree\nsize 9\nres 0.1\ndata\n";
  const std::string bytes = header + "UU";  // eight free children
  const auto map = octree::read_bt(std::as_bytes(std::span{bytes}));
  REQUIRE(map);
  CHECK(map->size() == 9);
  CHECK(map->num_leaves() == 8);
  CHECK(octree::bt_bytes(*map) == bytes);
  const std::string ot = octree::ot_bytes(*map);
  const auto again = octree::read_ot(std::as_bytes(std::span{ot}));
  REQUIRE(again);
  CHECK(again->size() == 9);

  const test::quiet silence;
  octomap::OcTree tree{0.1};
  std::istringstream in{bytes};
  REQUIRE(tree.readBinary(in));
  tree.prune();
  CHECK(tree.size() == 9);
}

namespace {

octree::occupancy_octree<> shell_map(octomap::OcTree* theirs = nullptr) {
  random_bits random{4};
  octree::occupancy_octree<> map{0.05};
  for (int i = 0; i != 8; ++i) {
    const vec3f origin{0.05F * static_cast<float>(i), 0.0F, 0.0F};
    const auto scan = test::shell_scan(random, 3000, origin);
    map.integrate(scan, origin);
    if (theirs != nullptr) test::insert(*theirs, scan, origin, {});
  }
  return map;
}

}  // namespace

TEST_CASE("Counting leaves gives what visiting every leaf gives") {
  octomap::OcTree theirs{0.05};
  auto map = shell_map(&theirs);
  map.set_unknown_node({40960, 40960, 40960}, 12, 1.0F);
  map.set_unknown_node({40992, 40960, 40960}, 11, -1.0F);
  octree::octree_counts expected;
  map.for_each_leaf([&](const auto& l) {
    ++expected.leaves;
    ++(l.occupied ? expected.occupied_leaves : expected.free_leaves);
  });
  const auto counts = map.counts();
  CHECK(counts.leaves == expected.leaves);
  CHECK(counts.leaves == theirs.getNumLeafNodes() + 2);
  CHECK(counts.occupied_leaves == expected.occupied_leaves);
  CHECK(counts.free_leaves == expected.free_leaves);
  CHECK(counts.occupied_leaves > 1000);
}
