// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/cloud/all_knn-inl.hpp>
#include <orbis/cloud/all_knn.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::neighbor;
using orbis::cloud::neighbor_table;
using orbis::test::points;

namespace {

/// The neighbours of point `i` by definition.
std::vector<neighbor<float>> reference_neighbors(const points& cloud, std::size_t i, std::size_t k) {
  std::vector<std::pair<float, std::uint32_t>> others;
  if (!orbis::test::finite(cloud[i])) return {};
  for (std::size_t j = 0; j != cloud.size(); ++j) {
    if (j == i || !orbis::test::finite(cloud[j])) continue;
    others.emplace_back(orbis::test::squared(cloud[i], cloud[j]), static_cast<std::uint32_t>(j));
  }
  std::sort(others.begin(), others.end());
  others.resize(std::min(k, others.size()));
  std::vector<neighbor<float>> out;
  for (const auto& [squared, j] : others) out.push_back({j, std::sqrt(squared)});
  std::sort(out.begin(), out.end(), orbis::cloud::is_nearer<float>);
  return out;
}

}  // namespace

TEST_CASE("the neighbours of all points are those that brute force finds, ties by index") {
  auto clouds = orbis::test::all_clouds();
  points copies;  // many copies of few points among others, in no order
  orbis::random_bits random{1};
  const points some = orbis::test::uniform_cloud(60, 2);
  for (int i = 0; i != 700; ++i) copies.push_back(some[random.below(random.below(60) + 1)]);
  clouds.emplace_back("many copies", copies);
  points overflowing = orbis::test::uniform_cloud(20, 3, 1e17);
  for (int i = 0; i != 20; ++i) overflowing.emplace_back(1e20F * static_cast<float>(i), 0.0F, 0.0F);
  clouds.emplace_back("overflowing", overflowing);
  for (auto& hard : orbis::test::hard_clouds()) clouds.push_back(std::move(hard));
  for (const auto& [name, cloud] : clouds) {
    for (const std::size_t k : {1U, 2U, 3U, 4U, 6U, 40U}) {
      using orbis::simd::level;
      for (const level l : {level::portable, level::avx2, level::avx512}) {
        INFO(name << " k " << k << " level " << static_cast<int>(l));
        const orbis::simd::level_limit limit{l};
        const neighbor_table found = orbis::cloud::all_knn(orbis::par.with(2), cloud, k);
        std::size_t different = 0;
        for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 150) {
          const auto row = found[i];
          const auto expected = reference_neighbors(cloud, i, k);
          different += std::equal(row.begin(), row.end(), expected.begin(), expected.end()) ? 0 : 1;
        }
        CHECK(different == 0);
      }
    }
  }
}

TEST_CASE("the neighbours are the same where too many leaves are near to be shared") {
  points cloud = orbis::test::uniform_cloud(9'000, 21, 1.0);
  const points far = orbis::test::uniform_cloud(60, 22, 200.0);
  cloud.insert(cloud.end(), far.begin(), far.end());
  using orbis::simd::level;
  for (const level l : {level::portable, level::avx2, level::avx512}) {
    const orbis::simd::level_limit limit{l};
    for (const std::size_t k : {1U, 2U, 3U, 4U, 9U}) {
      INFO("k " << k << " level " << static_cast<int>(l));
      const neighbor_table found = orbis::cloud::all_knn(orbis::seq, cloud, k);
      std::size_t different = 0;
      for (std::size_t i = 0; i < cloud.size(); i += i < 9'000 ? 97 : 1) {
        const auto expected = reference_neighbors(cloud, i, k);
        different += std::equal(found[i].begin(), found[i].end(), expected.begin(), expected.end()) ? 0 : 1;
      }
      CHECK(different == 0);
    }
  }
}

TEST_CASE("neighbours come in plain metres, identical points among them") {
  const std::vector<orbis::vec3> cloud{{0, 0, 0}, {0, 3, 4}, {0, 0, 0}, {0, 0, 10}};
  const neighbor_table found = orbis::cloud::all_knn(orbis::seq, cloud, 2);
  CHECK(found.width == 2);
  CHECK(std::vector(found[0].begin(), found[0].end()) == std::vector<neighbor<float>>{{2, 0.0F}, {1, 5.0F}});
  CHECK(std::vector(found[1].begin(), found[1].end()) == std::vector<neighbor<float>>{{0, 5.0F}, {2, 5.0F}});
  CHECK(orbis::cloud::all_knn(orbis::seq, cloud, 9)[3].size() == 3);
  CHECK(orbis::cloud::all_knn(orbis::seq, points{}, 9).rows.empty());
  CHECK(orbis::cloud::all_knn(orbis::seq, points(1), 9)[0].empty());
}

TEST_CASE("mean neighbour distances equal brute force bit for bit") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const std::size_t k : {1U, 8U, 51U}) {
      INFO(name << " k " << k);
      const auto expected = orbis::test::reference_mean_distances(cloud, k);
      const auto found = orbis::cloud::all_mean_knn_distance(orbis::par.with(2), cloud, k);
      REQUIRE(found.size() == expected.size());
      std::size_t different = 0;
      for (std::size_t i = 0; i != found.size(); ++i) {
        const bool same = std::isnan(expected[i]) ? std::isnan(found[i]) : found[i] == expected[i];
        if (!same) ++different;
      }
      CHECK(different == 0);
    }
  }
}

TEST_CASE("the mean of roots does not depend on the order of the distances") {
  orbis::random_bits random{3};
  for (int round = 0; round != 2000; ++round) {
    std::vector<float> squares;
    for (int i = 0; i != 51; ++i) squares.push_back(static_cast<float>(random.uniform(0.0, 1e-3)));
    std::vector<float> sorted = squares;
    std::sort(sorted.begin(), sorted.end());
    double sum = 0;
    for (const float s : sorted) sum += std::sqrt(double{s});
    CHECK(orbis::cloud::detail::mean_root(squares, 50.0) == static_cast<float>(sum / 50.0));
  }
}
