// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Converts maps to `octomap::OcTree` and `octomap::ColorOcTree`, and these to maps.
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
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/voxel_layer.hpp>

namespace orbis::interop {

/// A payload of voxels that takes in colours and has one.
template <class P>
concept color_payload = octree::voxel_payload<P> && requires(P& payload, const P& constant, const rgb8& color) {
  payload.update(color);
  { constant.color() } -> std::convertible_to<rgb8>;
};

/// A map, and the colours of its voxels.
template <octree::sensor_model Model, color_payload Color>
struct colored_map {
  octree::occupancy_octree<Model> map;
  octree::voxel_layer<Color> colors;
};

/// Converts a map to an `octomap::OcTree` with the same nodes and log-odds, pruned; its parameters are the sensor
/// model's constants. O(nodes). @pre map.tree_depth() == octree::default_tree_depth
template <octree::octomap_model Model>
[[nodiscard]] std::unique_ptr<octomap::OcTree> to_octomap(const octree::occupancy_octree<Model>& map) {
  return detail::make_tree<octomap::OcTree>(map, [](auto&&...) {});
}
/// Converts a map and its colours to an `octomap::ColorOcTree`. A leaf is split where the colours of its voxels
/// differ, so that none is lost; OctoMap's own `prune()` would merge and average them. Inner nodes have the average of
/// their children. For OctoMap white means no colour; colours of unknown voxels are left out. O(nodes).
/// @pre map.tree_depth() == octree::default_tree_depth
template <octree::octomap_model Model, color_payload Color>
[[nodiscard]] std::unique_ptr<octomap::ColorOcTree> to_octomap(const octree::occupancy_octree<Model>& map,
                                                               const octree::voxel_layer<Color>& colors) {
  auto tree = detail::make_tree<octomap::ColorOcTree>(map, detail::leaf_painter<Color>{colors});
  if (tree->size() != 0) tree->updateInnerOccupancy();
  return tree;
}

/// Converts an `octomap::OcTree` to a map. The tree's sensor parameters are not used; the map has those of the Model.
/// Errors: malformed for a log-odds that is not finite, unsupported for a tree of another depth than 16.
template <octree::octomap_model Model = octree::log_odds<>>
[[nodiscard]] result<octree::occupancy_octree<Model>> from_octomap(const octomap::OcTree& tree) {
  return detail::read_tree<Model>(tree, [](auto&&...) { return true; });
}
/// Converts an `octomap::ColorOcTree` to a map and the colours of its leaves, one observation each; colours of inner
/// nodes are not read. Errors: those above, and unsupported for a leaf of more than 32x32x32
/// voxels that has a colour, since each voxel takes its own.
template <octree::octomap_model Model = octree::log_odds<>, color_payload Color = octree::rgb_mean>
[[nodiscard]] result<colored_map<Model, Color>> from_octomap(const octomap::ColorOcTree& tree) {
  octree::voxel_layer<Color> colors;
  const auto paint = [&](const octomap::ColorOcTreeNode& node, const octree::voxel_key& key, int level) {
    if (!node.isColorSet()) return true;
    constexpr int largest = 5;  // of 32x32x32 voxels
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
