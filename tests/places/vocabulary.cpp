// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/features/descriptor.hpp>
#include <orbis/places/vocabulary.hpp>

#include "places/images.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;
using orbis::test::naive_way;

static_assert(bit_string<features::binary_descriptor<256>> && bit_string<features::binary_descriptor<512>>);
static_assert(bit_string<std::array<unsigned char, 32>> && !bit_string<double> && !bit_string<std::array<char, 33>>);
static_assert(!bit_string<std::vector<std::uint64_t>>);

namespace {

/// Words as the plainest descent finds them, counted in a map.
template <std::size_t Bits>
void check_transform(const basic_vocabulary<Bits>& words, const test::descriptors<Bits>& image) {
  bag_of_words expected;
  std::map<std::uint32_t, int> counts;
  for (const auto& d : image) ++counts[words.tree().word_of_leaf(naive_way(words, d).back())];
  for (const auto& [word, count] : counts)
    if (words.weight(word) > 0.0F) expected.words.push_back({word, words.weight(word) * static_cast<float>(count)});
  normalize(expected);
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    transform_workspace memory;
    bag_of_words bag;
    words.transform(image, bag, memory);
    CHECK(bag == expected);
  }
}

}  // namespace

TEST_CASE("a transform equals the plainest descent, at every level of instructions") {
  const auto branching = GENERATE(2U, 6U, 33U);
  const auto words = test::small_vocabulary(branching, 4);
  REQUIRE(words.size() > 14);
  for (const std::size_t features : {0U, 1U, 15U, 16U, 17U, 63U, 64U, 500U})
    check_transform(words, test::make_images(1, features, 8, 300, 40)[0]);
}

TEST_CASE("descriptors of any length of whole words have a vocabulary") {
  check_transform(test::small_vocabulary<64>(5, 3), test::make_images<64>(1, 300, 8)[0]);
  check_transform(test::small_vocabulary<512>(10, 3), test::make_images<512>(1, 300, 8)[0]);
}

TEST_CASE("leaves above the deepest level are words") {
  // A root with three children, of which the middle one has two: words 0 and 1 are nodes 1 and 3.
  vocabulary_tree<64> tree;
  tree.resize(6);
  const std::array<std::uint64_t, 5> bits{0x0, 0xff, ~std::uint64_t{0}, 0x0f, 0xf0};
  for (std::size_t i = 0; i != 5; ++i) tree.descriptors.values()[i] = {bits[i]};
  tree.weights = {1.0F, 2.0F, 3.0F, 4.0F};
  const std::vector<std::uint16_t> child_counts{3, 0, 2};
  REQUIRE(connect_tree(tree, child_counts).empty());
  const basic_vocabulary<64> words{std::move(tree)};
  CHECK(words.size() == 4);
  CHECK(words.depth() == 2);
  CHECK(words.branching() == 3);
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    CHECK(words.find_word(std::uint64_t{0x1}) == 0);
    CHECK(words.find_word(~std::uint64_t{0x1}) == 1);
    CHECK(words.find_word(std::uint64_t{0x1f}) == 2);
    CHECK(words.find_word(std::uint64_t{0xf1}) == 3);
    CHECK(words.find_word(std::uint64_t{0x77}) == 2);  // as near to one as to the other: the first
  }
  check_transform(words, test::make_images<64>(1, 200, 3)[0]);
}

TEST_CASE("weights count as their kind says") {
  const auto image = test::make_images(1, 400, 8)[0];
  for (const weighting kind : {weighting::tf_idf, weighting::tf, weighting::idf, weighting::binary}) {
    const auto words = test::small_vocabulary(6, 3, kind);
    const bool rarity = kind == weighting::tf_idf || kind == weighting::idf;
    const bool counted = kind == weighting::tf_idf || kind == weighting::tf;
    std::map<std::uint32_t, float> expected;
    for (const auto& d : image) {
      const std::uint32_t word = words.find_word(d);
      if (!rarity) CHECK(words.weight(word) == 1.0F);
      expected[word] = counted ? expected[word] + words.weight(word) : words.weight(word);
    }
    std::erase_if(expected, [](const auto& e) { return e.second == 0.0F; });
    float sum = 0.0F;
    for (const auto& [word, value] : expected) sum += value;
    const auto bag = words.transform(image);
    REQUIRE(bag.size() == expected.size());
    for (const auto& [word, value] : bag.words) CHECK(value == Approx(expected[word] / sum));
  }
}

TEST_CASE("a vocabulary of nothing has no words") {
  const vocabulary none;
  CHECK(none.empty());
  CHECK(none.nodes() == 1);
  bag_of_words bag{{{1, 1.0F}}};
  transform_workspace memory;
  none.transform(test::make_images(1, 3, 1)[0], bag, memory);
  CHECK(bag.empty());
}

TEST_CASE("a transform in memory that has been used allocates nothing") {
  const auto words = test::small_vocabulary();
  const auto images = test::make_images(2, 1000, 8);
  bag_of_words bag;
  transform_workspace memory;
  for (const auto& image : images) words.transform(image, bag, memory);
  const std::size_t before = test::allocations();
  for (const auto& image : images) words.transform(image, bag, memory);
  if (test::counts_allocations()) CHECK(test::allocations() == before);
  CHECK(bag == words.transform(images[1]));
}
