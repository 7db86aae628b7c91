// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bags of visual words: the words that occur in an image, with their values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace orbis::places {

/// Weighting scheme: the value of a word in an image.
enum class weighting : std::uint8_t {
  tf_idf,  ///< term frequency times inverse document frequency
  tf,      ///< term frequency: number of occurrences in the image
  idf,     ///< inverse document frequency: rarity across images
  binary   ///< value 1 for every word
};

/// A word and its value, which is positive.
struct word_value {
  std::uint32_t word = 0;
  float value = 0.0F;
  friend bool operator==(const word_value&, const word_value&) = default;
};

/// The words that occur in an image, in ascending order without duplicates.
struct bag_of_words {
  std::vector<word_value> words;

  [[nodiscard]] std::size_t size() const noexcept { return words.size(); }
  [[nodiscard]] bool empty() const noexcept { return words.empty(); }
  friend bool operator==(const bag_of_words&, const bag_of_words&) = default;
};

/// Maximum weight of a word; keeps values and their sums finite.
inline constexpr float largest_weight = 1e20F;

/// Scales the values to a sum of 1; erases words whose value underflows to zero. Does nothing for an empty bag.
/// O(words).
inline void normalize(bag_of_words& bag) noexcept {
  double sum = 0.0;
  for (const word_value& w : bag.words) sum += static_cast<double>(w.value);
  if (!(sum > 0.0)) return;
  const double scale = 1.0 / sum;
  for (word_value& w : bag.words) w.value = static_cast<float>(static_cast<double>(w.value) * scale);
  std::erase_if(bag.words, [](const word_value& w) { return !(w.value > 0.0F); });
}

/// Similarity of two normalised bags, from 0 (no common words) to 1 (equal): the sum over all words of the smaller of
/// the two values, which equals 1 - |a - b| / 2 with the L1 norm. Exactly symmetric. O(words). Source: D. Nister, H.
/// Stewenius, "Scalable recognition with a vocabulary tree", CVPR 2006; D. Galvez-Lopez, J. D. Tardos, "Bags of binary
/// words for fast place recognition in image sequences", IEEE T-RO 2012.
[[nodiscard]] inline double similarity(const bag_of_words& a, const bag_of_words& b) noexcept {
  double sum = 0.0;
  const word_value *i = a.words.data(), *j = b.words.data();
  const word_value *const end_i = i + a.size(), *const end_j = j + b.size();
  while (i != end_i && j != end_j) {
    const std::uint32_t x = i->word, y = j->word;
    if (x == y) sum += std::min(static_cast<double>(i->value), static_cast<double>(j->value));
    // Branch-free, because the comparison is unpredictable.
    i += x <= y ? 1 : 0;
    j += y <= x ? 1 : 0;
  }
  return std::clamp(sum, 0.0, 1.0);
}

/// Number of words that two bags have in common. O(words).
[[nodiscard]] inline std::size_t shared_words(const bag_of_words& a, const bag_of_words& b) noexcept {
  std::size_t shared = 0;
  for (std::size_t i = 0, j = 0; i != a.size() && j != b.size();) {
    const std::uint32_t x = a.words[i].word, y = b.words[j].word;
    shared += x == y ? 1U : 0U;
    i += x <= y ? 1U : 0U;
    j += y <= x ? 1U : 0U;
  }
  return shared;
}

}  // namespace orbis::places
