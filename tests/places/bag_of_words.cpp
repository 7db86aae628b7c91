// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/bag_of_words.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

namespace {

[[nodiscard]] bag_of_words random_bag(std::size_t steps, std::uint32_t stride, random_bits& random) {
  bag_of_words bag;
  std::uint32_t word = 0;
  for (std::size_t i = 0; i != steps; ++i) {
    word += 1 + random.below(stride);
    bag.words.push_back({word, static_cast<float>(random.uniform(0.01, 3.0))});
  }
  return bag;
}

/// The definition over all words, without what they have in common in mind.
[[nodiscard]] double by_definition(const bag_of_words& a, const bag_of_words& b) {
  std::map<std::uint32_t, std::pair<double, double>> both;
  for (const auto& [word, value] : a.words) both[word].first = static_cast<double>(value);
  for (const auto& [word, value] : b.words) both[word].second = static_cast<double>(value);
  double l1 = 0;
  for (const auto& [word, v] : both) l1 += std::abs(v.first - v.second);
  return 1 - l1 / 2;
}

}  // namespace

TEST_CASE("the similarity of bags is what it is defined to be, from 0 to 1, symmetric, and 1 for the same") {
  random_bits random{1};
  for (int i = 0; i != 200; ++i) {
    const auto stride = 1 + random.below(6);
    auto a = random_bag(1 + random.below(300), stride, random);
    auto b = random_bag(1 + random.below(300), stride, random);
    normalize(a);
    normalize(b);
    const double s = similarity(a, b);
    CHECK(s >= 0.0);
    CHECK(s <= 1.0);
    CHECK(s == similarity(b, a));
    CHECK(s == Approx(by_definition(a, b)).margin(2e-4));
    CHECK(similarity(a, a) == Approx(1.0).margin(1e-6));
    auto elsewhere = a;
    for (auto& w : elsewhere.words) w.word += 100000;
    CHECK(similarity(a, elsewhere) == 0.0);
    CHECK(similarity(a, {}) == 0.0);
  }
  CHECK(similarity({}, {}) == 0.0);
}

TEST_CASE("bags are scaled to a sum of one") {
  random_bits random{1};
  const auto bag = random_bag(50, 4, random);
  auto scaled = bag;
  normalize(scaled);
  double sum = 0.0;
  for (std::size_t i = 0; i != bag.size(); ++i) {
    CHECK(scaled.words[i].word == bag.words[i].word);
    sum += static_cast<double>(scaled.words[i].value);
  }
  CHECK(sum == Approx(1.0).margin(1e-6));
  bag_of_words uneven{{{1, 1e-30F}, {2, 1e20F}}};
  normalize(uneven);
  CHECK(uneven == bag_of_words{{{2, 1.0F}}});
  bag_of_words none;
  normalize(none);
  CHECK(none.empty());
}

TEST_CASE("words that two bags share are counted") {
  const bag_of_words a{{{1, 1}, {5, 1}, {9, 1}, {12, 1}}}, b{{{0, 1}, {5, 1}, {12, 1}, {40, 1}}};
  CHECK(shared_words(a, b) == 2);
  CHECK(shared_words(b, a) == 2);
  CHECK(shared_words(a, a) == 4);
  CHECK(shared_words(a, {}) == 0);
}
