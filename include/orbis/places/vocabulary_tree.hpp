// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The tree of a vocabulary, constructed by readers of other formats.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/table_memory.hpp>
#include <orbis/places/bag_of_words.hpp>

namespace orbis::places {

/// The links of a node, stored separately from its descriptor.
struct tree_node {
  std::uint32_t first_child = 0;   ///< index of the first child; the children end where those of the next node begin
  std::uint32_t inner_before = 0;  ///< number of nodes with children before this one
};

/// A tree of descriptors of `Bits` bits. Nodes are numbered level by level, starting with 0 for the root, and within a
/// level in the order of their parents, so that the children of a node are contiguous. Words are the leaves in that
/// order.
///
/// To build a tree, call `resize`, fill in `descriptors` and `weights`, then call `connect_tree`.
template <std::size_t Bits>
struct vocabulary_tree {
  table_memory<bit_words<Bits>> descriptors;  ///< the descriptor of node i is at i - 1; the root has none
  std::vector<tree_node> nodes;  ///< nodes up to the last one with children, and an end marker; later ones are leaves
  std::vector<float> weights;    ///< weights of the words
  std::uint32_t node_count = 1;
  std::uint32_t branching = 0;  ///< maximum number of children of a node
  std::uint32_t depth = 0;      ///< levels below the root
  weighting weights_are = weighting::tf_idf;

  /// Allocates `nodes_with_root` nodes; their descriptors are uninitialised. @pre nodes_with_root > 0
  void resize(std::uint32_t nodes_with_root) {
    node_count = nodes_with_root;
    descriptors = table_memory<bit_words<Bits>>(nodes_with_root - 1);
  }

  [[nodiscard]] std::uint32_t word_count() const noexcept { return static_cast<std::uint32_t>(weights.size()); }
  /// Index of the first node after the last one with children; this node and all later ones are leaves.
  [[nodiscard]] std::uint32_t inner_end() const noexcept { return static_cast<std::uint32_t>(nodes.size() - 1); }
  [[nodiscard]] bool is_leaf(std::uint32_t node) const noexcept {
    return node >= inner_end() || nodes[node].first_child == nodes[node + 1].first_child;
  }
  /// The word of a leaf. @pre is_leaf(leaf)
  [[nodiscard]] std::uint32_t word_of_leaf(std::uint32_t leaf) const noexcept {
    return leaf - nodes[std::min(leaf, inner_end())].inner_before;
  }
};

/// Connects the nodes of a tree after its descriptors and weights are set: `child_counts[i]` is the number of children
/// of node i, for the nodes up to the last one with children. Returns the reason for a failure, or an empty string.
/// O(nodes).
template <std::size_t Bits>
[[nodiscard]] std::string connect_tree(vocabulary_tree<Bits>& tree, std::span<const std::uint16_t> child_counts) {
  tree.nodes.assign(child_counts.size() + 1, {});
  tree.branching = tree.depth = 0;
  std::uint64_t next = 1;
  std::uint32_t inner = 0;
  std::uint64_t level_end = 1;  // first node after the level of node i
  for (std::size_t i = 0; i != child_counts.size(); ++i) {
    if (i >= next) return "node " + std::to_string(i) + " has no parent";
    if (i == level_end) level_end = next;
    if (child_counts[i] != 0 && next == level_end) ++tree.depth;  // the first child of a new level
    tree.nodes[i] = {static_cast<std::uint32_t>(next), inner};
    next += child_counts[i];
    inner += child_counts[i] != 0 ? 1U : 0U;
    tree.branching = std::max<std::uint32_t>(tree.branching, child_counts[i]);
    if (next > tree.node_count) return "more children than nodes";
  }
  tree.nodes.back() = {static_cast<std::uint32_t>(next), inner};
  if (next != tree.node_count) return "some nodes have no parent";
  if (!child_counts.empty() && child_counts.back() == 0) return "the last inner node has no children";
  if (tree.node_count - inner != (tree.word_count() == 0 ? 1 : tree.word_count()))
    return std::to_string(tree.node_count - inner) + " leaves, but " + std::to_string(tree.word_count()) + " words";
  for (const float weight : tree.weights)
    if (!(weight >= 0.0F && weight <= largest_weight)) return "a weight is negative, above 1e20 or NaN";
  return {};
}

}  // namespace orbis::places
