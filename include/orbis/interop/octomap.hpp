// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From and to `octomap::OcTree`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include <octomap/OcTree.h>

#include <orbis/core/result.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::interop {

/// The same map as an `octomap::OcTree`: the same nodes with the same log-odds, pruned, and the
/// sensor model's constants as its parameters.
template <octree::octomap_model Model>
[[nodiscard]] std::unique_ptr<octomap::OcTree> to_octomap(const octree::occupancy_octree<Model>& map) {
  /// Gives the protected building blocks of a tree to the builder below.
  class open_tree : public octomap::OcTree {
   public:
    using octomap::OcTree::OcTree;
    void begin() {
      root = new octomap::OcTreeNode;
      tree_size = 1;
      size_changed = true;
    }
    octomap::OcTreeNode* top() { return root; }
    void swap_into(octomap::OcTree& other) { other.swapContent(*this); }
  };
  /// Follows the preorder visit; `open[l]` is the inner node at level l that is being filled.
  struct builder {
    open_tree& tree;
    std::array<octomap::OcTreeNode*, octree::default_tree_depth + 1> open{};

    octomap::OcTreeNode* node(const octree::voxel_key& key, int level) {
      if (level == octree::default_tree_depth) {
        tree.begin();
        return tree.top();
      }
      const auto bit = static_cast<unsigned>(level);
      const unsigned child = (key.x >> bit & 1U) | (key.y >> bit & 1U) << 1U | (key.z >> bit & 1U) << 2U;
      return tree.createNodeChild(open[static_cast<std::size_t>(level + 1)], child);
    }
    void leaf(const octree::voxel_key& key, int level, float value) { node(key, level)->setLogOdds(value); }
    void inner(const octree::voxel_key& key, int level, float value, const std::array<octree::node_entry<float>, 8>&) {
      auto* const made = node(key, level);
      made->setLogOdds(value);
      open[static_cast<std::size_t>(level)] = made;
    }
  };

  open_tree built{map.resolution()};
  map.visit_tree(builder{built});
  auto tree = std::make_unique<octomap::OcTree>(map.resolution());
  built.swap_into(*tree);
  const auto probability = [](float log_odds) { return octree::probability_of(static_cast<double>(log_odds)); };
  tree->setProbHit(probability(Model::hit));
  tree->setProbMiss(probability(Model::miss));
  tree->setClampingThresMin(probability(Model::clamp_min));
  tree->setClampingThresMax(probability(Model::clamp_max));
  tree->setOccupancyThres(probability(Model::occupancy_threshold));
  return tree;
}

/// The same map as an `octomap::OcTree`. The tree's own sensor parameters are not carried over: they
/// are the Model's. Errors: malformed for a log-odds that is not finite, unsupported for a tree of
/// another depth than 16.
template <octree::octomap_model Model = octree::log_odds<>>
[[nodiscard]] result<octree::occupancy_octree<Model>> from_octomap(const octomap::OcTree& tree) {
  if (tree.getTreeDepth() != static_cast<unsigned>(octree::default_tree_depth))
    return fail(errc::unsupported, "octomap::OcTree", "is " + std::to_string(tree.getTreeDepth()) + " levels deep");
  octree::occupancy_octree<Model> map{tree.getResolution()};
  for (auto it = tree.begin_leafs(), end = tree.end_leafs(); it != end; ++it) {
    if (!std::isfinite(it->getLogOdds())) return fail(errc::malformed, "octomap::OcTree", "a value that is not finite");
    // OctoMap names a node by its middle voxel, we by its lowest.
    const auto depth = static_cast<int>(it.getDepth());
    const std::uint32_t inside = octree::node_cells(octree::default_tree_depth - depth) - 1;
    const octomap::OcTreeKey key = it.getKey();
    map.set_unknown_node({key[0] & ~inside, key[1] & ~inside, key[2] & ~inside}, depth, it->getLogOdds());
  }
  return map;
}

}  // namespace orbis::interop
