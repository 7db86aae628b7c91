// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Builds a tree from a list of nodes with parent indices, the format of other programs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace dbow {

using namespace orbis;
using namespace orbis::places;

/// A list of nodes. Entry `i` is the node with the index `i + 1`; 0 is the root, which is not in the list.
template <std::size_t Bits>
struct parent_list {
  std::vector<std::uint32_t> parents;  ///< index of each node's parent, at most the number of nodes
  std::vector<bit_words<Bits>> descriptors;
  std::vector<float> weights;

  [[nodiscard]] std::size_t size() const noexcept { return parents.size(); }
};

/// An error in a list, and the node in question (0: none).
struct list_problem {
  std::string what;
  std::size_t node = 0;
};

/// Numbers the nodes level by level; children keep the order of the list. `is_word(node)`: true if the file marks the
/// node as a word. O(nodes).
/// @pre one parent (at most the number of nodes), one descriptor and one weight per node
template <std::size_t Bits, class IsWord>
[[nodiscard]] list_problem order_by_level(const parent_list<Bits>& list, IsWord&& is_word,
                                          vocabulary_tree<Bits>& tree) {
  const std::size_t n = list.size() + 1;
  std::vector<std::uint32_t> begin(n + 1, 0), children(list.size());
  for (const std::uint32_t parent : list.parents) ++begin[parent + 1U];
  for (std::size_t i = 1; i != begin.size(); ++i) begin[i] += begin[i - 1];
  for (std::size_t i = 0; i != list.size(); ++i) {
    // The start of each parent's children thereby advances to the start of the next parent's children.
    children[begin[list.parents[i]]++] = static_cast<std::uint32_t>(i + 1);
  }
  const auto first_of = [&](std::uint32_t node) { return node == 0 ? 0U : begin[node - 1]; };

  tree.resize(static_cast<std::uint32_t>(n));
  std::vector<std::uint32_t> order{0};
  order.reserve(n);
  std::vector<std::uint16_t> child_counts;
  for (std::size_t i = 0; i != order.size(); ++i) {
    const std::uint32_t node = order[i];
    const std::uint32_t count = begin[node] - first_of(node);
    if (count > std::numeric_limits<std::uint16_t>::max()) return {"has more than 65535 children", node};
    if (node != 0 && is_word(node) != (count == 0))
      return {count == 0 ? "is not a word and has no children" : "is a word but has children", node};
    child_counts.push_back(static_cast<std::uint16_t>(count));
    if (node != 0) tree.descriptors.values()[i - 1] = list.descriptors[node - 1];
    if (node != 0 && count == 0) tree.weights.push_back(list.weights[node - 1]);
    for (std::uint32_t c = 0; c != count; ++c) order.push_back(children[first_of(node) + c]);
  }
  if (order.size() != n) {
    std::vector<bool> seen(n);
    for (const std::uint32_t node : order) seen[node] = true;
    return {"is part of a cycle or below one", static_cast<std::size_t>(std::ranges::find(seen, false) - seen.begin())};
  }
  while (!child_counts.empty() && child_counts.back() == 0) child_counts.pop_back();
  return {connect_tree(tree, child_counts), 0};
}

}  // namespace dbow
