// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/bag_of_words.hpp>
#include <orbis/places/score.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

namespace {

[[nodiscard]] bag_of_words random_bag(std::size_t steps, std::uint32_t stride, bag_norm norm, random_bits& random) {
  bag_of_words bag;
  std::uint32_t word = 0;
  for (std::size_t i = 0; i != steps; ++i) {
    word += 1 + random.below(stride);
    bag.words.push_back({word, static_cast<float>(random.uniform(0.01, 3.0))});
  }
  normalize(bag, norm);
  return bag;
}

/// The definitions over all words, without what they have in common in mind.
template <class Score>
[[nodiscard]] double by_definition(const bag_of_words& a, const bag_of_words& b) {
  std::map<std::uint32_t, std::pair<double, double>> both;
  for (const auto& [word, value] : a.words) both[word].first = static_cast<double>(value);
  for (const auto& [word, value] : b.words) both[word].second = static_cast<double>(value);
  double l1 = 0, dot = 0;
  for (const auto& [word, v] : both) {
    const auto [x, y] = v;
    l1 += std::abs(x - y);
    dot += x * y;
  }
  if constexpr (std::is_same_v<Score, l1_score>) return 1 - l1 / 2;
  return dot;
}

}  // namespace

TEMPLATE_TEST_CASE("scores are what they are defined to be, from 0 to 1, symmetric, and 1 for the same", "", l1_score,
                   cosine_score) {
  constexpr TestType score{};
  random_bits random{1};
  for (int i = 0; i != 200; ++i) {
    const auto stride = 1 + random.below(6);
    const auto a = random_bag(1 + random.below(300), stride, TestType::norm, random);
    const auto b = random_bag(1 + random.below(300), stride, TestType::norm, random);
    const double s = score(a, b);
    CHECK(s >= 0.0);
    CHECK(s <= 1.0);
    CHECK(s == score(b, a));
    CHECK(s == Approx(by_definition<TestType>(a, b)).margin(2e-4));
    CHECK(score(a, a) == Approx(1.0).margin(1e-6));
    auto elsewhere = a;
    for (auto& w : elsewhere.words) w.word += 100000;
    CHECK(score(a, elsewhere) == 0.0);
    CHECK(score(a, {}) == 0.0);
  }
  CHECK(score({}, {}) == 0.0);
}

TEST_CASE("bags are scaled to a norm of one") {
  random_bits random{1};
  const auto bag = random_bag(50, 4, bag_norm::none, random);
  for (const bag_norm norm : {bag_norm::l1, bag_norm::l2}) {
    auto scaled = bag;
    normalize(scaled, norm);
    double sum = 0.0;
    for (std::size_t i = 0; i != bag.size(); ++i) {
      CHECK(scaled.words[i].word == bag.words[i].word);
      const auto v = static_cast<double>(scaled.words[i].value);
      sum += norm == bag_norm::l1 ? v : v * v;
    }
    CHECK(sum == Approx(1.0).margin(1e-6));
  }
  bag_of_words uneven{{{1, 1e-30F}, {2, 1e20F}}};
  normalize(uneven, bag_norm::l1);
  CHECK(uneven == bag_of_words{{{2, 1.0F}}});
  bag_of_words none;
  normalize(none, bag_norm::l1);
  CHECK(none.empty());
}

TEST_CASE("words that two bags share are counted") {
  const bag_of_words a{{{1, 1}, {5, 1}, {9, 1}, {12, 1}}}, b{{{0, 1}, {5, 1}, {12, 1}, {40, 1}}};
  CHECK(shared_words(a, b) == 2);
  CHECK(shared_words(b, a) == 2);
  CHECK(shared_words(a, a) == 4);
  CHECK(shared_words(a, {}) == 0);
}
