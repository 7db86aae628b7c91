// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An image as a bag of visual words: the words that occur in it, with their values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace orbis::places {

/// How the value of a word in an image is computed.
enum class weighting : std::uint8_t {
  tf_idf,  ///< how often it occurs, times how rare it is among images
  tf,      ///< how often it occurs
  idf,     ///< how rare it is
  binary   ///< one
};

/// A word and its value, > 0.
struct word_value {
  std::uint32_t word = 0;
  float value = 0.0F;
  friend bool operator==(const word_value&, const word_value&) = default;
};

/// The words that occur, ascending, each once.
struct bag_of_words {
  std::vector<word_value> words;

  [[nodiscard]] std::size_t size() const noexcept { return words.size(); }
  [[nodiscard]] bool empty() const noexcept { return words.empty(); }
  friend bool operator==(const bag_of_words&, const bag_of_words&) = default;
};

/// The largest weight of a word, so that values and their sums stay finite.
inline constexpr float largest_weight = 1e20F;

/// Scales the values to a sum of 1; words whose value underflows to zero are erased. Does nothing for an empty bag.
/// O(words).
inline void normalize(bag_of_words& bag) noexcept {
  double sum = 0.0;
  for (const word_value& w : bag.words) sum += static_cast<double>(w.value);
  if (!(sum > 0.0)) return;
  const double scale = 1.0 / sum;
  for (word_value& w : bag.words) w.value = static_cast<float>(static_cast<double>(w.value) * scale);
  std::erase_if(bag.words, [](const word_value& w) { return !(w.value > 0.0F); });
}

/// How alike two normalised bags are, from 0 (nothing in common) to 1 (equal): the sum of what both have, which is
/// 1 - |a - b| / 2 in the sum of absolute values. Symmetric to the last bit. O(words).
/// Source: D. Nister, H. Stewenius, "Scalable recognition with a vocabulary tree", CVPR 2006; D. Galvez-Lopez, J. D.
/// Tardos, "Bags of binary words for fast place recognition in image sequences", IEEE T-RO 2012.
[[nodiscard]] inline double similarity(const bag_of_words& a, const bag_of_words& b) noexcept {
  double sum = 0.0;
  const word_value *i = a.words.data(), *j = b.words.data();
  const word_value *const end_i = i + a.size(), *const end_j = j + b.size();
  while (i != end_i && j != end_j) {
    const std::uint32_t x = i->word, y = j->word;
    if (x == y) sum += std::min(static_cast<double>(i->value), static_cast<double>(j->value));
    // Which one is less cannot be predicted: no branches.
    i += x <= y ? 1 : 0;
    j += y <= x ? 1 : 0;
  }
  return std::clamp(sum, 0.0, 1.0);
}

/// How many words two bags share. O(words).
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
