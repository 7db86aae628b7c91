// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of vocabulary.hpp.
#pragma once

#include <array>
#include <bit>
#include <cstring>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/places/detail/nearest_child.hpp>
#include <orbis/places/vocabulary.hpp>

namespace orbis::places {
namespace detail {

// Finds the words of many descriptors in a vocabulary's tree together.
//
// In a large tree, each level costs a cache miss. Several descriptors therefore descend together, level by level: while
// one descriptor is compared with the children of its node, the children of the other nodes are prefetched.

/// Descriptors as bytes, and the output array for their leaves.
struct descent {
  const std::byte* descriptors;
  std::size_t count;
  std::uint32_t* leaves;
};

template <class Target, std::size_t Bits>
ORBIS_ALWAYS_INLINE void descend(const vocabulary_tree<Bits>& tree, const descent& d) {
  constexpr std::size_t together = 8;  // a few cache lines each: about the number of concurrent fetches of a core
  constexpr std::size_t line = 64;
  const tree_node* const nodes = tree.nodes.data();
  const std::uint32_t inner_end = tree.inner_end();
  const bit_words<Bits>* const descriptors = tree.descriptors.values().data();
  struct query_state {
    bit_words<Bits> query;
    std::uint32_t node, first, count, at;
  };
  std::array<query_state, together> states;

  for (std::size_t begin = 0; begin < d.count; begin += together) {
    std::size_t active = std::min(together, d.count - begin);
    for (std::size_t i = 0; i != active; ++i) {
      query_state& t = states[i];
      std::memcpy(t.query.data(), d.descriptors + (begin + i) * sizeof t.query, sizeof t.query);
      t.node = 0;
      t.at = static_cast<std::uint32_t>(begin + i);
    }
    while (active != 0) {
      // Remove descriptors that reached a leaf; prefetch the children for the others.
      std::size_t kept = 0;
      for (std::size_t i = 0; i != active; ++i) {
        query_state& t = states[i];
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
        if (kept != i) states[kept] = t;
        ++kept;
      }
      active = kept;
      for (std::size_t i = 0; i != active; ++i) {
        query_state& t = states[i];
        t.node = t.first + nearest_child<Target, Bits>(t.query, descriptors + (t.first - 1), t.count);
        if (t.node < inner_end) prefetch(nodes + t.node);
      }
    }
  }
}

struct descent_kernel {
  template <class Target, std::size_t Bits>
  static ORBIS_ALWAYS_INLINE void run(const vocabulary_tree<Bits>& tree, const descent& d) {
    descend<Target>(tree, d);
  }
};

/// Finds the leaves of all descriptors. O(descriptors x depth x branching).
template <std::size_t Bits>
void find_leaves(const vocabulary_tree<Bits>& tree, const descent& d) {
  using signature = void(const vocabulary_tree<Bits>&, const descent&);
  simd::kernel<descent_kernel, signature, simd::popcnt, simd::avx2>()(tree, d);
}

}  // namespace detail

template <std::size_t Bits>
std::uint32_t basic_vocabulary<Bits>::word_of_bytes(const std::byte* descriptor) const noexcept {
  std::uint32_t leaf = 0;
  detail::find_leaves(*tree_, {descriptor, 1, &leaf});
  return tree_->word_of_leaf(leaf);
}

template <std::size_t Bits>
void basic_vocabulary<Bits>::transform_bytes(const std::byte* descriptors, std::size_t count, bag_of_words& bag,
                                             transform_workspace& memory) const {
  bag.words.clear();
  memory.words.resize(count);
  if (empty()) return;
  detail::find_leaves(*tree_, {descriptors, count, memory.words.data()});
  for (std::uint32_t& leaf : memory.words) leaf = tree_->word_of_leaf(leaf);
  sort(memory);
  this->count(memory.words, bag);
  normalize(bag);
}

template <std::size_t Bits>
void basic_vocabulary<Bits>::sort(transform_workspace& memory) const {
  if (memory.words.size() < 64) return std::sort(memory.words.begin(), memory.words.end());
  constexpr unsigned digit = 8;
  const auto digits = (static_cast<unsigned>(std::bit_width(size() - 1)) + digit - 1) / digit;
  memory.sorted.resize(memory.words.size());
  for (unsigned shift = 0; shift != digits * digit; shift += digit) {
    const auto digit_of = [shift](std::uint32_t word) { return (word >> shift) & 0xffU; };
    std::array<std::uint32_t, 256> begin{};
    for (const std::uint32_t word : memory.words) ++begin[digit_of(word)];
    std::uint32_t before = 0;
    for (std::uint32_t& at : begin) before += std::exchange(at, before);
    for (const std::uint32_t word : memory.words) memory.sorted[begin[digit_of(word)]++] = word;
    memory.words.swap(memory.sorted);
  }
}

template <std::size_t Bits>
void basic_vocabulary<Bits>::count(std::span<const std::uint32_t> sorted, bag_of_words& bag) const {
  const bool counted = weighting() == places::weighting::tf_idf || weighting() == places::weighting::tf;
  for (std::size_t i = 0; i != sorted.size();) {
    const std::size_t first = i;
    while (i != sorted.size() && sorted[i] == sorted[first]) ++i;
    const float w = weight(sorted[first]);
    if (w > 0.0F) bag.words.push_back({sorted[first], counted ? w * static_cast<float>(i - first) : w});
  }
}

}  // namespace orbis::places
