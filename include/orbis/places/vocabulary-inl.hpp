// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of vocabulary.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/detail/descent.hpp>
#include <orbis/places/vocabulary.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places {

template <std::size_t Bits>
std::uint32_t basic_vocabulary<Bits>::word_of_bytes(const std::byte* descriptor) const noexcept {
  std::uint32_t leaf = 0;
  detail::find_leaves(*tree_, {descriptor, 1, 0, &leaf, nullptr});
  return tree_->word_of_leaf(leaf);
}

template <std::size_t Bits>
void basic_vocabulary<Bits>::transform_bytes(const std::byte* descriptors, std::size_t count, bag_of_words& bag,
                                             std::uint32_t* nodes, transform_workspace& memory,
                                             const transform_options& options) const {
  bag.words.clear();
  memory.words.resize(count);
  if (empty()) {
    if (nodes != nullptr) std::fill_n(nodes, count, 0U);
    return;
  }
  detail::find_leaves(*tree_, {descriptors, count, options.node_depth, memory.words.data(), nodes});
  for (std::uint32_t& leaf : memory.words) leaf = tree_->word_of_leaf(leaf);
  sort(memory);
  this->count(memory.words, bag);
  normalize(bag, options.norm);
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
