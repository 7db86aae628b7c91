// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Descriptors of images that were never taken, and a vocabulary of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/places/train-inl.hpp>
#include <orbis/places/vocabulary-inl.hpp>

namespace orbis::test {

using namespace places;

template <std::size_t Bits = 256>
using descriptors = std::vector<bit_words<Bits>>;

template <std::size_t Bits = 256>
[[nodiscard]] bit_words<Bits> random_descriptor(random_bits& random) {
  bit_words<Bits> d;
  for (auto& word : d) word = random();
  return d;
}

/// With `flips` bits, some perhaps twice, turned over.
template <std::size_t Words>
[[nodiscard]] std::array<std::uint64_t, Words> noisy(std::array<std::uint64_t, Words> d, int flips,
                                                     random_bits& random) {
  for (int i = 0; i != flips; ++i) {
    const std::uint32_t bit = random.below(64 * Words);
    d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return d;
}

/// Each image shows some of `things` things, with noise: images share what they show.
template <std::size_t Bits = 256>
[[nodiscard]] std::vector<descriptors<Bits>> make_images(std::size_t images, std::size_t features, std::uint64_t seed,
                                                         std::uint32_t things = 300, int flips = 12) {
  random_bits kinds{99}, random{seed};
  descriptors<Bits> prototypes;
  for (std::uint32_t i = 0; i != things; ++i) prototypes.push_back(random_descriptor<Bits>(kinds));
  std::vector<descriptors<Bits>> made(images);
  for (auto& image : made)
    for (std::size_t i = 0; i != features; ++i) image.push_back(noisy(prototypes[random.below(things)], flips, random));
  return made;
}

template <std::size_t Bits = 256>
[[nodiscard]] basic_vocabulary<Bits> small_vocabulary(std::uint32_t branching = 6, std::uint32_t depth = 4,
                                                      weighting kind = weighting::tf_idf) {
  return train(seq, make_images<Bits>(40, 60, 5),
               training_options{.branching = branching, .depth = depth, .weighting = kind})
      .value();
}

/// Leaf, and nodes on the way there, by the plainest loop.
template <std::size_t Bits>
[[nodiscard]] std::vector<std::uint32_t> naive_way(const basic_vocabulary<Bits>& words, const bit_words<Bits>& query) {
  const auto& tree = words.tree();
  std::vector<std::uint32_t> way{0};
  while (!tree.is_leaf(way.back())) {
    const std::uint32_t node = way.back();
    std::uint32_t best = 0, least = ~0U;
    for (std::uint32_t c = tree.nodes[node].first_child; c != tree.nodes[node + 1].first_child; ++c) {
      std::uint32_t distance = 0;
      for (std::size_t bit = 0; bit != Bits; ++bit)
        distance += (((query[bit / 64] ^ tree.descriptors.values()[c - 1][bit / 64]) >> (bit % 64)) & 1U) != 0 ? 1 : 0;
      if (distance < least) {
        least = distance;
        best = c;
      }
    }
    way.push_back(best);
  }
  return way;
}

}  // namespace orbis::test
