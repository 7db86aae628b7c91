// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Many descriptors down a vocabulary's tree at once.
///
/// In a large tree the way down is a chain of cache misses. So several descriptors go down together, level by level:
/// while one is compared with the children of its node, the children of the others' are on their way from memory.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <orbis/core/bit_string.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/places/detail/nearest_child.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places::detail {

/// Descriptors of somebody else's type, as bytes; and where their leaves, and their nodes at `node_depth` (or the
/// leaf, where that is higher), go.
struct descent {
  const std::byte* descriptors;
  std::size_t count;
  std::uint32_t node_depth;
  std::uint32_t* leaves;
  std::uint32_t* nodes;  ///< or null
};

template <class Ops, std::size_t Bits>
[[gnu::always_inline]] inline void descend(const vocabulary_tree<Bits>& tree, const descent& d) {
  constexpr std::size_t together = 8;  // each asks for a few lines: about as many as a core can have on their way
  constexpr std::size_t line = 64;
  const tree_node* const nodes = tree.nodes.data();
  const std::uint32_t inner_end = tree.inner_end();
  const bit_words<Bits>* const descriptors = tree.descriptors.values().data();
  struct traveller {
    bit_words<Bits> query;
    std::uint32_t node, first, count, at;
  };
  std::array<traveller, together> on_the_way;

  for (std::size_t begin = 0; begin < d.count; begin += together) {
    std::size_t active = std::min(together, d.count - begin);
    for (std::size_t i = 0; i != active; ++i) {
      traveller& t = on_the_way[i];
      std::memcpy(t.query.data(), d.descriptors + (begin + i) * sizeof t.query, sizeof t.query);
      t.node = 0;
      t.at = static_cast<std::uint32_t>(begin + i);
      if (d.nodes != nullptr) d.nodes[t.at] = 0;
    }
    for (std::uint32_t depth = 1; active != 0; ++depth) {
      // Who has arrived leaves; for the others the children are sent for.
      std::size_t kept = 0;
      for (std::size_t i = 0; i != active; ++i) {
        traveller& t = on_the_way[i];
        const std::uint32_t first = t.node < inner_end ? nodes[t.node].first_child : 0;
        const std::uint32_t count = t.node < inner_end ? nodes[t.node + 1].first_child - first : 0;
        if (count == 0) {
          d.leaves[t.at] = t.node;
          continue;
        }
        t.first = first;
        t.count = count;
        const auto* const bytes = reinterpret_cast<const std::byte*>(descriptors + (first - 1));
        for (std::size_t b = 0; b < count * sizeof t.query; b += line) prefetch(bytes + b);
        if (kept != i) on_the_way[kept] = t;
        ++kept;
      }
      active = kept;
      for (std::size_t i = 0; i != active; ++i) {
        traveller& t = on_the_way[i];
        t.node = t.first + Ops::template nearest<Bits>(t.query, descriptors + (t.first - 1), t.count);
        if (t.node < inner_end) prefetch(nodes + t.node);
        if (d.nodes != nullptr && depth <= d.node_depth) d.nodes[t.at] = t.node;
      }
    }
  }
}

template <std::size_t Bits>
using descent_kernel = void(const vocabulary_tree<Bits>&, const descent&);

template <std::size_t Bits>
void descend_portable(const vocabulary_tree<Bits>& tree, const descent& d) {
  descend<nearest_portable>(tree, d);
}
#if ORBIS_X86
template <std::size_t Bits>
ORBIS_TARGET("popcnt")
void descend_popcnt(const vocabulary_tree<Bits>& tree, const descent& d) {
  descend<nearest_popcnt>(tree, d);
}
template <std::size_t Bits>
ORBIS_TARGET("popcnt,avx2")
void descend_avx2(const vocabulary_tree<Bits>& tree, const descent& d) {
  descend<nearest_avx2>(tree, d);
}
#endif

/// The leaves, and the nodes, of all descriptors; the same at every level of instructions.
template <std::size_t Bits>
void find_leaves(simd::level level, const vocabulary_tree<Bits>& tree, const descent& d) {
#if ORBIS_X86
  simd::select<descent_kernel<Bits>>(
      level, {.portable = descend_portable<Bits>, .popcnt = descend_popcnt<Bits>, .avx2 = descend_avx2<Bits>})(tree, d);
#else
  static_cast<void>(level);
  descend_portable(tree, d);
#endif
}

}  // namespace orbis::places::detail
