// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

using descriptor = binary_descriptor<256>;
using test::random_descriptors;

}  // namespace

TEST_CASE("each stage of a chain keeps exactly what its definition keeps") {
  const auto q = random_descriptors(400, 3);
  const auto t = random_descriptors(300, 4);
  const auto all = (brute_force(hamming{}) | max_distance{256})(q, t);
  REQUIRE(all.size() == q.size());

  const auto distance = [&](std::size_t i, std::size_t j) { return hamming{}(q[i], t[j]); };
  const auto second = [&](const match& m) {
    std::uint32_t best = 1000;
    for (std::size_t j = 0; j != t.size(); ++j)
      if (j != m.train) best = std::min(best, distance(m.query, j));
    return best;
  };
  const auto mutual = [&](const match& m) {
    for (std::size_t i = 0; i != q.size(); ++i) {
      const auto d = distance(i, m.train);
      if (d < m.distance || (d == m.distance && i < m.query)) return false;
    }
    return true;
  };
  std::vector<match> by_ratio, by_cross, by_distance, by_all;
  for (const match& m : all) {
    const bool ratio = static_cast<float>(m.distance) < 0.97F * static_cast<float>(second(m));
    if (ratio) by_ratio.push_back(m);
    if (mutual(m)) by_cross.push_back(m);
    if (m.distance <= 101) by_distance.push_back(m);
    if (ratio && mutual(m) && m.distance <= 101) by_all.push_back(m);
  }
  REQUIRE(!by_all.empty());
  REQUIRE(by_all.size() < std::min({by_ratio.size(), by_cross.size(), by_distance.size()}));
  CHECK((brute_force(hamming{}) | ratio_test{0.97f})(q, t) == by_ratio);
  CHECK((brute_force(hamming{}) | cross_check{})(q, t) == by_cross);
  CHECK((brute_force(hamming{}) | max_distance{101})(q, t) == by_distance);
  CHECK((brute_force(hamming{}) | ratio_test{0.97f} | cross_check{} | max_distance{101})(q, t) == by_all);
  CHECK((brute_force(hamming{}) | max_distance{101} | cross_check{} | ratio_test{0.97f})(q, t) == by_all);
}

TEST_CASE("a single train has no rival and passes the ratio test") {
  const auto q = random_descriptors(3, 1);
  const auto t = random_descriptors(1, 2);
  CHECK((brute_force(hamming{}) | ratio_test{0.1f})(q, t).size() == 3);
}

TEST_CASE("only the nearest of those that share a train is unique") {
  std::vector<candidate> c{{0, 7, 5}, {1, 7, 3}, {2, 7, 3}, {3, 8, 9}};
  unique::workspace memory;
  unique{}(c, {}, {}, memory);
  REQUIRE(c.size() == 2);
  CHECK(c[0].query == 1);
  CHECK(c[1].query == 3);
}

TEST_CASE("matches that turn alike are consistent in rotation at every angle") {
  constexpr float turn = 2.0F * std::numbers::pi_v<float>;
  for (int step = 0; step != 60; ++step) {
    const float by = turn * static_cast<float>(step) / 60.0F;
    std::vector<keypoint> q, t;
    std::vector<candidate> c;
    random_bits random{static_cast<std::uint64_t>(step)};
    const auto add = [&](float difference) {
      const auto angle = static_cast<float>(random.uniform(0.0, static_cast<double>(turn)));
      const auto index = static_cast<std::uint32_t>(q.size());
      q.push_back({.angle = std::fmod(angle + difference, turn)});
      t.push_back({.angle = angle});
      c.push_back({index, index, 1});
    };
    for (int i = 0; i != 60; ++i) add(by + static_cast<float>(random.uniform(0.0, 0.1)));  // straddles two bins at most
    for (int i = 0; i != 2; ++i) add(by + 0.5F * turn);  // wrong: turned the other way round
    rotation_consistency::workspace memory;
    rotation_consistency{}(c, q, t, memory);
    INFO("turned by " << by);
    CHECK(c.size() == 60);
  }
}

TEST_CASE("the rotation histogram uses all of its bins") {
  // One candidate per degree of turn: three of thirty equal bins hold a tenth of them.
  std::vector<keypoint> q(360), t(360);
  std::vector<candidate> c;
  for (std::uint32_t i = 0; i != 360; ++i) {
    q[i].angle = (static_cast<float>(i) + 0.5F) * std::numbers::pi_v<float> / 180.0F;
    c.push_back({i, i, 1});
  }
  rotation_consistency::workspace memory;
  rotation_consistency{}(c, q, t, memory);
  CHECK(c.size() == 36);
}

TEST_CASE("a chain with rotation consistency takes the keypoints of features") {
  orbis::features::features f;
  f.descriptors = random_descriptors(40, 8);
  f.keypoints.resize(40);
  const auto matcher = brute_force(hamming{}) | rotation_consistency{};
  CHECK(matcher(f, f).size() == 40);
}
