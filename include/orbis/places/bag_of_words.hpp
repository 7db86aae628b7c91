// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An image as a bag of visual words: the words that occur in it, with their values.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace orbis::places {

/// How the value of a word in an image is computed.
enum class weighting : std::uint8_t {
  tf_idf,  ///< how often it occurs, times how rare it is among images
  tf,      ///< how often it occurs
  idf,     ///< how rare it is
  binary   ///< one
};

/// How the values of a bag are normalised.
enum class bag_norm : std::uint8_t {
  none,
  l1,  ///< their sum is 1
  l2   ///< the sum of their squares is 1
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

/// Normalises the values; words whose value underflows to zero are erased. Does nothing for an empty bag or for `none`.
/// O(words).
inline void normalize(bag_of_words& bag, bag_norm norm) noexcept {
  if (norm == bag_norm::none) return;
  double sum = 0.0;
  for (const word_value& w : bag.words) {
    const auto value = static_cast<double>(w.value);
    sum += norm == bag_norm::l1 ? value : value * value;  // the square of a float is exact in a double
  }
  if (!(sum > 0.0)) return;
  const double scale = 1.0 / (norm == bag_norm::l1 ? sum : std::sqrt(sum));
  for (word_value& w : bag.words) w.value = static_cast<float>(static_cast<double>(w.value) * scale);
  std::erase_if(bag.words, [](const word_value& w) { return !(w.value > 0.0F); });
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
