// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A vocabulary tree: converts descriptors to visual words and images to bags of words.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/vocabulary_tree.hpp>

namespace orbis::places {

/// Reusable memory for `transform`.
struct transform_workspace {
  std::vector<std::uint32_t> words, sorted;
};

/// A tree of descriptors of `Bits` bits. Starting at the root, a descriptor descends to the nearest child at each node;
/// the leaf that it reaches is its word.
///
/// The library orbis::compiled contains the vocabulary for 256 bits; for other lengths, include vocabulary-inl.hpp.
///
/// Immutable, and cheap to copy: copies share the tree. Created by `train`, `read_vocabulary`, `default_vocabulary` and
/// readers for other formats. A default-constructed vocabulary has no words.
///
/// Source: D. Nister, H. Stewenius, "Scalable recognition with a vocabulary tree", CVPR 2006; D. Galvez-Lopez,
/// J. D. Tardos, "Bags of binary words for fast place recognition in image sequences", IEEE T-RO 2012.
template <std::size_t Bits>
class basic_vocabulary {
 public:
  static constexpr std::size_t bits = Bits;
  using tree_type = vocabulary_tree<Bits>;

  basic_vocabulary() : tree_{std::make_shared<tree_type>(empty_tree())} {}
  /// @pre the tree is connected, see `connect_tree`
  explicit basic_vocabulary(tree_type&& tree) : tree_{std::make_shared<tree_type>(std::move(tree))} {}
  // Moving copies the pointer, so that a moved-from vocabulary keeps its words.
  basic_vocabulary(const basic_vocabulary&) noexcept = default;
  basic_vocabulary& operator=(const basic_vocabulary&) noexcept = default;
  ~basic_vocabulary() = default;

  /// The number of words.
  [[nodiscard]] std::size_t size() const noexcept { return tree_->word_count(); }
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  /// The number of nodes, including the root.
  [[nodiscard]] std::size_t nodes() const noexcept { return tree_->node_count; }
  /// Number of levels below the root.
  [[nodiscard]] std::uint32_t depth() const noexcept { return tree_->depth; }
  /// Maximum number of children of a node.
  [[nodiscard]] std::uint32_t branching() const noexcept { return tree_->branching; }
  [[nodiscard]] places::weighting weighting() const noexcept { return tree_->weights_are; }
  /// The weight of a word (the part of its value that does not depend on the image). @pre word < size()
  [[nodiscard]] float weight(std::uint32_t word) const noexcept { return tree_->weights[word]; }
  [[nodiscard]] const tree_type& tree() const noexcept { return *tree_; }

  /// The word of a descriptor. @pre !empty()
  template <bit_string D>
  requires(8 * sizeof(D) == Bits) [[nodiscard]] std::uint32_t find_word(const D& descriptor) const noexcept {
    assert(!empty());
    return word_of_bytes(reinterpret_cast<const std::byte*>(&descriptor));
  }
  template <bit_string D>
  requires(8 * sizeof(D) == Bits) [[deprecated("use find_word")]] [[nodiscard]] std::uint32_t
      word_of(const D& descriptor) const noexcept {
    return find_word(descriptor);
  }

  /// Computes the normalised bag of words for the descriptors of an image. Allocates nothing if a previous image had
  /// the same number of descriptors. O(descriptors x depth x branching); safe to call from several threads, each with
  /// its own memory.
  template <bit_string_range_of<Bits> Descriptors>
  void transform(const Descriptors& descriptors, bag_of_words& bag, transform_workspace& memory) const {
    transform_bytes(reinterpret_cast<const std::byte*>(std::ranges::data(descriptors)), std::ranges::size(descriptors),
                    bag, memory);
  }

  /// Returns the bag; allocates its own memory.
  template <bit_string_range_of<Bits> Descriptors>
  [[nodiscard]] bag_of_words transform(const Descriptors& descriptors) const {
    bag_of_words bag;
    transform_workspace memory;
    transform(descriptors, bag, memory);
    return bag;
  }

  friend bool operator==(const basic_vocabulary& a, const basic_vocabulary& b) {
    const auto same_node = [](const tree_node& x, const tree_node& y) { return x.first_child == y.first_child; };
    return a.weighting() == b.weighting() && a.tree_->weights == b.tree_->weights &&
           std::ranges::equal(a.tree_->nodes, b.tree_->nodes, same_node) &&
           std::ranges::equal(a.tree_->descriptors.values(), b.tree_->descriptors.values());
  }

 private:
  [[nodiscard]] static tree_type empty_tree() {
    tree_type tree;
    tree.nodes.assign(1, {1, 0});
    return tree;
  }

  [[nodiscard]] std::uint32_t word_of_bytes(const std::byte* descriptor) const noexcept;
  void transform_bytes(const std::byte* descriptors, std::size_t count, bag_of_words& bag,
                       transform_workspace& memory) const;
  /// Radix sort: a comparison sort would take a quarter of the time of a transform.
  void sort(transform_workspace& memory) const;
  void count(std::span<const std::uint32_t> sorted, bag_of_words& bag) const;

  std::shared_ptr<const tree_type> tree_;
};

/// A vocabulary for descriptors of 256 bits, such as ORB's.
using vocabulary = basic_vocabulary<256>;

}  // namespace orbis::places

#ifndef ORBIS_COMPILED
#include <orbis/places/vocabulary-inl.hpp>
#endif
