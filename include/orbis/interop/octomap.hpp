// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of maps to and from `octomap::OcTree` and `octomap::ColorOcTree`; planning directly on an
/// `octomap::OcTree`.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <utility>

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/interop/detail/octomap_nodes.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/sensor_model.hpp>
#include <orbis/octree/voxel_layer.hpp>

namespace orbis::interop {

/// A voxel payload that combines observed colours into one.
template <class P>
concept color_payload = octree::voxel_payload<P> && requires(P& payload, const P& constant, const rgb8& color) {
  payload.update(color);
  { constant.color() } -> std::convertible_to<rgb8>;
};

/// A map with the colours of its voxels.
template <octree::sensor_model Model, color_payload Color>
struct colored_map {
  octree::occupancy_octree<Model> map;
  octree::voxel_layer<Color> colors;
};

/// Converts a map to a pruned `octomap::OcTree` with the same nodes and log-odds; its parameters are the sensor model's
/// constants. O(nodes). @pre map.tree_depth() == octree::default_tree_depth
template <octree::octomap_model Model>
[[nodiscard]] std::unique_ptr<octomap::OcTree> to_octomap(const octree::occupancy_octree<Model>& map) {
  return detail::make_tree<octomap::OcTree>(map, [](auto&&...) {});
}
/// Converts a map and its colours to an `octomap::ColorOcTree`. A leaf is split where the colours of its voxels differ,
/// so that no colour is lost; OctoMap's own `prune()` would merge and average them. Inner nodes have the average colour
/// of their children. In OctoMap, white means no colour. Colours of unknown voxels are omitted. O(nodes).
/// @pre map.tree_depth() == octree::default_tree_depth
template <octree::octomap_model Model, color_payload Color>
[[nodiscard]] std::unique_ptr<octomap::ColorOcTree> to_octomap(const octree::occupancy_octree<Model>& map,
                                                               const octree::voxel_layer<Color>& colors) {
  auto tree = detail::make_tree<octomap::ColorOcTree>(map, detail::leaf_painter<Color>{colors});
  if (tree->size() != 0) tree->updateInnerOccupancy();
  return tree;
}

/// Converts an `octomap::OcTree` to a map. The tree's sensor parameters are ignored; the map uses those of `Model`.
/// Errors: malformed if a log-odds value is not finite, unsupported if the tree depth is not 16.
template <octree::octomap_model Model = octree::log_odds<>>
[[nodiscard]] result<octree::occupancy_octree<Model>> from_octomap(const octomap::OcTree& tree) {
  return detail::read_tree<Model>(tree, [](auto&&...) { return true; });
}
/// Converts an `octomap::ColorOcTree` to a map and the colours of its leaves, each as one observation; colours of inner
/// nodes are ignored. Errors: those of the overload above, and unsupported for a coloured leaf of more than 32x32x32
/// voxels, because each voxel stores its own colour.
template <octree::octomap_model Model = octree::log_odds<>, color_payload Color = octree::rgb_mean>
[[nodiscard]] result<colored_map<Model, Color>> from_octomap(const octomap::ColorOcTree& tree) {
  octree::voxel_layer<Color> colors;
  const auto paint = [&](const octomap::ColorOcTreeNode& node, const octree::voxel_key& key, int level) {
    if (!node.isColorSet()) return true;
    constexpr int largest = 5;  // level of a node of 32x32x32 voxels
    if (level > largest) return false;
    const octomap::ColorOcTreeNode::Color c = node.getColor();
    const std::uint32_t cells = octree::node_cells(level);
    for (std::uint32_t z = 0; z != cells; ++z)
      for (std::uint32_t y = 0; y != cells; ++y)
        for (std::uint32_t x = 0; x != cells; ++x)
          colors.make({key.x + x, key.y + y, key.z + z}).update(rgb8{c.r, c.g, c.b});
    return true;
  };
  auto map = detail::read_tree<Model>(tree, paint);
  if (!map) return fail(map.error());
  return colored_map<Model, Color>{*std::move(map), std::move(colors)};
}

}  // namespace orbis::interop

/// Gives `nav` direct access to an `octomap::OcTree`. The tree has no change log, so each `update` of a distance field
/// compares the whole tree. Only leaves are read, so inner nodes need not be up to date.
template <>
struct orbis::nav::map_access<octomap::OcTree> {
  [[nodiscard]] static octree::voxel_grid grid(const octomap::OcTree& tree) {
    return octree::voxel_grid{tree.getResolution()};
  }
  [[nodiscard]] static auto octants(const octomap::OcTree& tree) {
    return [&tree](const octree::voxel_key& k) {
      const octomap::OcTreeNode* node = tree.getRoot();
      for (unsigned level = tree.getTreeDepth();
           node != nullptr && level-- > octant_level && tree.nodeHasChildren(node);)
        node = child(tree, node, (k.x >> level & 1U) | (k.y >> level & 1U) << 1U | (k.z >> level & 1U) << 2U);
      return node == nullptr ? octree::octant_states{} : states(tree, node);
    };
  }
  template <class Visit>
  static void for_each_octant(const octomap::OcTree& tree, Visit&& visit) {
    if (tree.getRoot() != nullptr) descend(tree, tree.getRoot(), {0, 0, 0}, tree.getTreeDepth(), visit);
  }
  [[nodiscard]] static octree::occupancy state(const octomap::OcTree& tree, const octree::voxel_key& k) {
    const auto along = [](std::uint32_t c) { return static_cast<octomap::key_type>(c); };
    const octomap::OcTreeNode* const node = tree.search(octomap::OcTreeKey{along(k.x), along(k.y), along(k.z)});
    if (node == nullptr) return octree::occupancy::unknown;
    return tree.isNodeOccupied(node) ? octree::occupancy::occupied : octree::occupancy::free;
  }

 private:
  static constexpr unsigned octant_level = 2;

  [[nodiscard]] static const octomap::OcTreeNode* child(const octomap::OcTree& tree, const octomap::OcTreeNode* node,
                                                        unsigned i) {
    return tree.nodeChildExists(node, i) ? tree.getNodeChild(node, i) : nullptr;
  }
  template <class Visit>
  static void descend(const octomap::OcTree& tree, const octomap::OcTreeNode* node, const octree::voxel_key& low,
                      unsigned level, Visit& visit) {
    if (level == octant_level || !tree.nodeHasChildren(node)) {
      visit(low, static_cast<int>(level), states(tree, node));
      return;
    }
    for (unsigned i = 0; i != 8; ++i)
      if (const octomap::OcTreeNode* const c = child(tree, node, i))
        descend(tree, c, octree::child_key(low, i, octree::node_cells(static_cast<int>(level) - 1)), level - 1, visit);
  }
  /// States of the voxels of an octant. For a leaf larger than an octant: the states of each octant in it, all equal.
  [[nodiscard]] static octree::octant_states states(const octomap::OcTree& tree, const octomap::OcTreeNode* node) {
    octree::octant_states s;
    const auto add = [&](const octomap::OcTreeNode* leaf, std::uint64_t voxels) {
      s.known |= voxels;
      if (tree.isNodeOccupied(leaf)) s.occupied |= voxels;
    };
    if (!tree.nodeHasChildren(node)) add(node, ~std::uint64_t{0});
    for (unsigned i = 0; i != 8; ++i) {
      const octomap::OcTreeNode* const group = child(tree, node, i);
      if (group == nullptr) continue;
      if (!tree.nodeHasChildren(group)) add(group, std::uint64_t{0xff} << (8 * i));
      for (unsigned j = 0; j != 8; ++j)
        if (const octomap::OcTreeNode* const leaf = child(tree, group, j)) add(leaf, std::uint64_t{1} << (8 * i + j));
    }
    return s;
  }
};
