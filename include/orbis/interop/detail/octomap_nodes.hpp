// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion between the nodes of OctoMap trees and the nodes of a map.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/voxel_layer.hpp>

namespace orbis::interop::detail {

/// Exposes protected members of a tree to the builder below.
template <class Tree>
class open_tree : public Tree {
 public:
  using Tree::Tree;
  [[nodiscard]] auto* begin() {
    this->root = new typename Tree::NodeType;
    this->tree_size = 1;
    this->size_changed = true;
    return this->root;
  }
};

/// Builds OctoMap nodes from the nodes of an `.ot` file. Calls `finish_leaf(tree, node, code, level)` for each leaf in
/// Morton order.
template <class Tree, class FinishLeaf>
class tree_builder {
 public:
  using node = typename Tree::NodeType;
  tree_builder(open_tree<Tree>& tree, const char* nodes, FinishLeaf& finish_leaf)
      : tree_{tree}, next_{nodes}, finish_leaf_{finish_leaf} {}

  void build(node* n, std::uint64_t code, int level) {
    n->setLogOdds(load_number<float>(next_));
    const std::uint32_t children = load_number<std::uint8_t>(next_ + 4);
    next_ += 5;
    if (children == 0) finish_leaf_(tree_, n, code, level);
    for (unsigned i = 0; i != 8; ++i)
      if ((children >> i & 1U) != 0) build(tree_.createNodeChild(n, i), code << 3U | i, level - 1);
  }

 private:
  open_tree<Tree>& tree_;
  const char* next_;
  FinishLeaf& finish_leaf_;
};

template <class Tree, octree::octomap_model Model, class FinishLeaf>
[[nodiscard]] std::unique_ptr<Tree> make_tree(const octree::occupancy_octree<Model>& map, FinishLeaf finish_leaf) {
  assert(map.tree_depth() == octree::default_tree_depth);
  // The `.ot` format stores every node with its value in preorder, after a text header.
  const std::string file = octree::ot_bytes(map);
  constexpr std::string_view end_of_header = "\ndata\n";
  const std::size_t nodes = file.find(end_of_header) + end_of_header.size();
  open_tree<Tree> built{map.resolution()};
  if (nodes != file.size())
    tree_builder<Tree, FinishLeaf>{built, file.data() + nodes, finish_leaf}.build(built.begin(), 0, map.tree_depth());
  auto tree = std::make_unique<Tree>(map.resolution());
  tree->swapContent(built);
  const auto probability = [](float log_odds) { return octree::to_probability(static_cast<double>(log_odds)); };
  tree->setProbHit(probability(Model::hit));
  tree->setProbMiss(probability(Model::miss));
  tree->setClampingThresMin(probability(Model::clamp_min));
  tree->setClampingThresMax(probability(Model::clamp_max));
  tree->setOccupancyThres(probability(Model::occupancy_threshold));
  return tree;
}

/// The level of an octant, the largest node that occupancy_octree::edit_octant changes in one call.
inline constexpr int octant_level = 2;

/// Builds a map from OctoMap nodes. Calls `see_leaf(node, key, level)` for each leaf; the callback returns false to
/// stop.
template <class Tree, class Model, class SeeLeaf>
class tree_reader {
 public:
  using node = typename Tree::NodeType;
  tree_reader(const Tree& tree, octree::occupancy_octree<Model>& map, SeeLeaf& see_leaf)
      : tree_{tree}, map_{map}, see_leaf_{see_leaf} {}

  /// Reads a node at `level`. Returns false on error; see problem().
  [[nodiscard]] bool read(const node& n, const octree::voxel_key& key, int level) {
    if (!tree_.nodeHasChildren(&n)) {
      float value = 0;
      if (!take(n, key, level, value)) return false;
      map_.set_unknown_node(key, map_.tree_depth() - level, value);
      return true;
    }
    if (level == octant_level) {
      bool good = true;
      map_.edit_octant(key, [&](octree::block<float>& voxels) { good = read_octant(n, key, voxels); });
      return good;
    }
    return for_each_child(n, [&](unsigned i, const node& child) {
      return read(child, octree::child_key(key, i, octree::node_cells(level - 1)), level - 1);
    });
  }
  [[nodiscard]] const error& problem() const noexcept { return problem_; }

 private:
  template <class Visit>
  [[nodiscard]] bool for_each_child(const node& n, Visit&& visit) const {
    for (unsigned i = 0; i != 8; ++i)
      if (tree_.nodeChildExists(&n, i) && !visit(i, *tree_.getNodeChild(&n, i))) return false;
    return true;
  }
  [[nodiscard]] bool give_up(errc code, const char* why) {
    problem_ = {code, "octomap tree", why};
    return false;
  }
  [[nodiscard]] bool take(const node& n, const octree::voxel_key& key, int level, float& value) {
    value = n.getLogOdds() + 0.0F;  // -0 becomes 0
    if (!std::isfinite(value)) return give_up(errc::malformed, "a log-odds value is not finite");
    return see_leaf_(n, key, level) ||
           give_up(errc::unsupported, "a leaf of more than 32x32x32 voxels has a colour; expand it first");
  }
  [[nodiscard]] bool read_octant(const node& n, const octree::voxel_key& key, octree::block<float>& voxels) {
    return for_each_child(n, [&](unsigned g, const node& group) {
      const octree::voxel_key group_key = octree::child_key(key, g, 2);
      float* const v = voxels.value.data() + 8 * g;
      if (!tree_.nodeHasChildren(&group)) {
        float value = 0;
        if (!take(group, group_key, 1, value)) return false;
        std::fill(v, v + 8, value);
        voxels.known |= std::uint64_t{0xff} << (8 * g);
        return true;
      }
      return for_each_child(group, [&](unsigned i, const node& voxel) {
        voxels.known |= std::uint64_t{1} << (8 * g + i);
        return take(voxel, octree::child_key(group_key, i, 1), 0, v[i]);
      });
    });
  }

  const Tree& tree_;
  octree::occupancy_octree<Model>& map_;
  SeeLeaf& see_leaf_;
  error problem_;
};

template <octree::octomap_model Model, class Tree, class SeeLeaf>
[[nodiscard]] result<octree::occupancy_octree<Model>> read_tree(const Tree& tree, SeeLeaf see_leaf) {
  if (tree.getTreeDepth() != static_cast<unsigned>(octree::default_tree_depth))
    return fail(errc::unsupported, "octomap tree",
                "is " + std::to_string(tree.getTreeDepth()) + " levels deep, not " +
                    std::to_string(octree::default_tree_depth));
  octree::occupancy_octree<Model> map{tree.getResolution(), octree::default_tree_depth};
  tree_reader<Tree, Model, SeeLeaf> reader{tree, map, see_leaf};
  if (tree.getRoot() != nullptr && !reader.read(*tree.getRoot(), {}, octree::default_tree_depth))
    return fail(reader.problem());
  return map;
}

/// Sets the colours of leaves from their voxels, in Morton order.
template <class Color>
class leaf_painter {
 public:
  explicit leaf_painter(const octree::voxel_layer<Color>& colors) {
    colors.for_each([&](const octree::voxel_key& key, const Color& payload) {
      const rgb8 c = payload.color();
      colors_.push_back({octree::morton_code(key), {c.r, c.g, c.b}});
    });
  }
  template <class Tree>
  void operator()(Tree& tree, octomap::ColorOcTreeNode* node, std::uint64_t code, int level) {
    const auto shift = 3 * static_cast<unsigned>(level);
    while (next_ != colors_.size() && colors_[next_].code < code << shift) ++next_;
    std::size_t end = next_;
    bool equal = true;
    for (; end != colors_.size() && colors_[end].code >> shift == code; ++end)
      equal = equal && colors_[end].color == colors_[next_].color;
    if (end == next_) return;
    if (equal && end - next_ == std::size_t{1} << shift) {
      node->setColor(colors_[next_].color);
      next_ = end;
      return;
    }
    for (unsigned i = 0; i != 8; ++i) {
      octomap::ColorOcTreeNode* const child = tree.createNodeChild(node, i);
      child->setLogOdds(node->getLogOdds());
      (*this)(tree, child, code << 3U | i, level - 1);
    }
  }

 private:
  struct colored_voxel {
    std::uint64_t code;
    octomap::ColorOcTreeNode::Color color;
  };
  std::vector<colored_voxel> colors_;
  std::size_t next_ = 0;
};

}  // namespace orbis::interop::detail
