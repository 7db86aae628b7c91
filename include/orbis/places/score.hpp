// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How alike two bags of words are: from 0 (nothing in common) to 1 (equal).
///
/// Each score is a type that says how its bags have to be scaled. They are symmetric to the last bit, and cost one
/// pass over both bags. Source: D. Nister, H. Stewenius, "Scalable recognition with a vocabulary tree", CVPR 2006
/// (the norms, written as sums over what is common), and D. Galvez-Lopez, J. D. Tardos, "Bags of binary words for
/// fast place recognition in image sequences", IEEE T-RO 2012 (scaled to [0, 1]).
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include <orbis/places/bag_of_words.hpp>

namespace orbis::places {

/// A similarity of two bags that are normalised by its `norm`: from 0 to 1.
template <class S>
concept bag_score = std::default_initializable<S> && requires(const S& score, const bag_of_words& bag) {
  { S::norm } -> std::convertible_to<bag_norm>;
  { score(bag, bag) } -> std::convertible_to<double>;
};

namespace detail {

/// The sum of `term(value in a, value in b)` over the words that both have, in the order of the words.
template <class Term>
[[nodiscard]] double sum_over_common(const bag_of_words& a, const bag_of_words& b, Term&& term) noexcept {
  double sum = 0.0;
  const word_value *i = a.words.data(), *j = b.words.data();
  const word_value *const end_i = i + a.size(), *const end_j = j + b.size();
  while (i != end_i && j != end_j) {
    const std::uint32_t x = i->word, y = j->word;
    if (x == y) sum += term(static_cast<double>(i->value), static_cast<double>(j->value));
    // Which one is less cannot be predicted: no branches.
    i += x <= y ? 1 : 0;
    j += y <= x ? 1 : 0;
  }
  return std::clamp(sum, 0.0, 1.0);
}

}  // namespace detail

/// 1 - |a - b| / 2 in the sum of absolute values, that is, the sum of what both have.
struct l1_score {
  static constexpr bag_norm norm = bag_norm::l1;
  [[nodiscard]] double operator()(const bag_of_words& a, const bag_of_words& b) const noexcept {
    return detail::sum_over_common(a, b, [](double x, double y) { return std::min(x, y); });
  }
};

/// The cosine of the angle between the bags.
struct cosine_score {
  static constexpr bag_norm norm = bag_norm::l2;
  [[nodiscard]] double operator()(const bag_of_words& a, const bag_of_words& b) const noexcept {
    return detail::sum_over_common(a, b, [](double x, double y) { return x * y; });
  }
};

}  // namespace orbis::places
