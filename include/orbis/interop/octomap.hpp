// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From and to `octomap::OcTree` and `octomap::ColorOcTree`.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <concepts>
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

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/octree/files.hpp>
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

namespace detail {

/// Gives the protected building blocks of a tree to the builder below.
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

/// Makes OctoMap's nodes of those an `.ot` file would have. `finish_leaf(tree, node, code, level)` is
/// called for each leaf in Morton order.
template <class Tree, class FinishLeaf>
class tree_builder {
 public:
  using node = typename Tree::NodeType;
  tree_builder(open_tree<Tree>& tree, const char* nodes, FinishLeaf& finish_leaf)
      : tree_{tree}, next_{nodes}, finish_leaf_{finish_leaf} {}

  void build(node* n, std::uint64_t code, int level) {
    const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(next_[i])}; };
    n->setLogOdds(std::bit_cast<float>(byte(0) | byte(1) << 8U | byte(2) << 16U | byte(3) << 24U));
    const std::uint32_t children = byte(4);
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
  // The `.ot` format holds every node with its value in preorder, behind a text header.
  const std::string file = octree::ot_bytes(map);
  constexpr std::string_view end_of_header = "\ndata\n";
  const std::size_t nodes = file.find(end_of_header) + end_of_header.size();
  open_tree<Tree> built{map.resolution()};
  if (nodes != file.size())
    tree_builder<Tree, FinishLeaf>{built, file.data() + nodes, finish_leaf}.build(built.begin(), 0, map.tree_depth());
  auto tree = std::make_unique<Tree>(map.resolution());
  tree->swapContent(built);
  const auto probability = [](float log_odds) { return octree::probability_of(static_cast<double>(log_odds)); };
  tree->setProbHit(probability(Model::hit));
  tree->setProbMiss(probability(Model::miss));
  tree->setClampingThresMin(probability(Model::clamp_min));
  tree->setClampingThresMax(probability(Model::clamp_max));
  tree->setOccupancyThres(probability(Model::occupancy_threshold));
  return tree;
}

/// The level of an octant, the largest node that occupancy_octree::edit_octant changes in one call.
inline constexpr int octant_level = 2;

/// Makes a map of OctoMap's nodes. `see_leaf(node, key, level)` is called for each leaf and returns whether to
/// go on.
template <class Tree, class Model, class SeeLeaf>
class tree_reader {
 public:
  using node = typename Tree::NodeType;
  tree_reader(const Tree& tree, octree::occupancy_octree<Model>& map, SeeLeaf& see_leaf)
      : tree_{tree}, map_{map}, see_leaf_{see_leaf} {}

  /// Reads a node at `level`; false: see problem().
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
    if (!std::isfinite(value)) return give_up(errc::malformed, "a value that is not finite");
    return see_leaf_(n, key, level) ||
           give_up(errc::unsupported, "a leaf of more than 32x32x32 voxels that has a colour");
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
    return fail(errc::unsupported, "octomap tree", "is " + std::to_string(tree.getTreeDepth()) + " levels deep");
  octree::occupancy_octree<Model> map{tree.getResolution(), octree::default_tree_depth};
  tree_reader<Tree, Model, SeeLeaf> reader{tree, map, see_leaf};
  if (tree.getRoot() != nullptr && !reader.read(*tree.getRoot(), {}, octree::default_tree_depth))
    return fail(reader.problem());
  return map;
}

/// Gives leaves the colours of their voxels, in Morton order.
template <color_payload Color>
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

}  // namespace detail

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
