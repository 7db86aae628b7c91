// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vocabularies as other programs write them.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/places/vocabulary.hpp>

namespace orbis::test {

using namespace places;

/// "0 1 2 ... ", so many.
[[nodiscard]] inline std::string byte_list(std::size_t count) {
  std::string list;
  for (std::size_t i = 0; i != count; ++i) list += std::to_string(i) + " ";
  return list;
}

/// A node as other programs see it.
struct foreign_node {
  std::size_t parent = 0;  ///< as listed, from 1; 0: the root
  bool word = false;
  std::string bytes;   ///< with a blank behind each
  std::string weight;  ///< all digits
};

/// The nodes but the root, by level or by depth first.
[[nodiscard]] inline std::vector<foreign_node> listed_nodes(const vocabulary& words, bool depth_first) {
  const auto& tree = words.tree();
  std::vector<foreign_node> list;
  const auto add = [&](std::uint32_t node, std::size_t parent) {
    foreign_node n{parent, tree.is_leaf(node), {}, "0"};
    for (const std::uint64_t word : tree.descriptors.values()[node - 1])
      for (unsigned b = 0; b != 8; ++b) n.bytes += std::to_string((word >> (8 * b)) & 0xffU) + " ";
    if (n.word) {
      char buffer[32];
      const auto end = std::to_chars(buffer, buffer + sizeof buffer, words.weight(tree.word_of_leaf(node))).ptr;
      n.weight.assign(buffer, end);
    }
    list.push_back(std::move(n));
    return list.size();
  };
  // Of a node all children are listed, then what is below each of them; or level by level.
  std::vector<std::pair<std::uint32_t, std::size_t>> pending{{0, 0}};
  while (!pending.empty()) {
    const auto [node, listed_as] = depth_first ? pending.back() : pending.front();
    if (depth_first) {
      pending.pop_back();
    } else {
      pending.erase(pending.begin());
    }
    if (tree.is_leaf(node)) continue;
    for (std::uint32_t c = tree.nodes[node].first_child; c != tree.nodes[node + 1].first_child; ++c)
      pending.emplace_back(c, add(c, listed_as));
  }
  return list;
}

[[nodiscard]] inline std::string dbow_text_of(const vocabulary& words, bool depth_first) {
  std::string text = "6 4 0 " + std::to_string(static_cast<int>(words.weighting())) + "\n";
  for (const foreign_node& n : listed_nodes(words, depth_first))
    text += std::to_string(n.parent) + (n.word ? " 1 " : " 0 ") + n.bytes + n.weight + "\n";
  return text;
}

/// `before`: what stands before the bytes of a descriptor; `quote`: around it.
[[nodiscard]] inline std::string dbow_yaml_of(const vocabulary& words, bool depth_first, const std::string& before,
                                              const std::string& quote) {
  std::string text = "%YAML:1.0\n---\nvocabulary:\n   k: 6\n   L: 4\n   scoringType: 0\n   weightingType: " +
                     std::to_string(static_cast<int>(words.weighting())) + "\n   nodes:\n";
  const auto nodes = listed_nodes(words, depth_first);
  for (std::size_t i = 0; i != nodes.size(); ++i)
    text += "      - { nodeId:" + std::to_string(i + 1) + ", parentId:" + std::to_string(nodes[i].parent) +
            ", weight:" + nodes[i].weight + ",\n          descriptor:" + quote + before + nodes[i].bytes + quote +
            " }\n";
  text += "   words:\n";
  std::size_t word = 0;
  for (std::size_t i = 0; i != nodes.size(); ++i)
    if (nodes[i].word)
      text += "      - { wordId:" + std::to_string(word++) + ", nodeId:" + std::to_string(i + 1) + " }\n";
  return text;
}

}  // namespace orbis::test
