// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/places/vocabulary-inl.hpp>

#include "places/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

namespace {

/// The root with three children: one with two children, a leaf, and one whose only child has two.
template <std::size_t Bits>
vocabulary_tree<Bits> small_tree(random_bits& random) {
  const std::vector<std::uint16_t> child_counts{3, 2, 0, 1, 0, 0, 2};
  vocabulary_tree<Bits> tree;
  tree.resize(9);
  for (auto& d : tree.descriptors.values()) d = test::random_descriptor<Bits>(random);
  tree.weights.assign(5, 1.0F);
  REQUIRE(connect_tree(tree, child_counts).empty());
  REQUIRE(tree.depth == 3);
  return tree;
}

/// The way of one descriptor, written out.
template <std::size_t Bits>
std::vector<std::uint32_t> way_of(const vocabulary_tree<Bits>& tree, const bit_words<Bits>& d) {
  std::vector<std::uint32_t> way{0};
  const auto descriptors = tree.descriptors.values();
  while (!tree.is_leaf(way.back())) {
    std::uint32_t best = tree.nodes[way.back()].first_child;
    for (std::uint32_t c = best + 1; c != tree.nodes[way.back() + 1].first_child; ++c)
      if (hamming_distance(d, descriptors[c - 1]) < hamming_distance(d, descriptors[best - 1])) best = c;
    way.push_back(best);
  }
  return way;
}

template <std::size_t Bits>
void check_descent(const vocabulary_tree<Bits>& tree, std::size_t count, random_bits& random) {
  test::descriptors<Bits> queries(count);
  for (auto& q : queries) q = test::random_descriptor<Bits>(random);
  for (const simd::level l : simd::available_levels()) {
    const simd::level_limit limit{l};
    std::vector<std::uint32_t> leaves(count, 99);
    places::detail::find_leaves<Bits>(tree, {std::as_bytes(std::span{queries}).data(), count, leaves.data()});
    for (std::size_t i = 0; i != count; ++i) CHECK(leaves[i] == way_of(tree, queries[i]).back());
  }
}

}  // namespace

TEST_CASE("descriptors find their leaves, whatever their number") {
  random_bits random{1};
  const auto tree = small_tree<256>(random);
  for (const std::size_t count : {0U, 1U, 7U, 8U, 9U, 100U}) check_descent(tree, count, random);
  check_descent(small_tree<128>(random), 50, random);
}

TEST_CASE("in a tree that is only a root every descriptor is at the root") {
  random_bits random{2};
  vocabulary_tree<256> tree;
  tree.resize(1);
  tree.weights.assign(1, 1.0F);
  REQUIRE(connect_tree(tree, std::vector<std::uint16_t>{}).empty());
  check_descent(tree, 10, random);
}
