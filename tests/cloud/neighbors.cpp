// SPDX-License-Identifier: BSD-3-Clause
//
// What a search finds, against brute force.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/cloud/nanoflann.hpp>
#include <orbis/cloud/neighbors.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::nanoflann_search;
using orbis::cloud::neighbor;
using orbis::test::points;

namespace {

/// All finite points with squared distances, nearest first.
std::vector<neighbor<float>> all_squared(const points& cloud, const std::array<float, 3>& q) {
  std::vector<neighbor<float>> all;
  for (std::uint32_t j = 0; j != cloud.size(); ++j) {
    if (!orbis::test::finite(cloud[j])) continue;
    all.push_back({j, orbis::test::squared({q[0], q[1], q[2]}, cloud[j])});
  }
  std::sort(all.begin(), all.end(), orbis::cloud::is_nearer<float>);
  return all;
}

/// The roots of squares, in the order that neighbours come in.
std::vector<neighbor<float>> plain(std::vector<neighbor<float>> squared) {
  for (auto& n : squared) n.distance = std::sqrt(n.distance);
  std::sort(squared.begin(), squared.end(), orbis::cloud::is_nearer<float>);
  return squared;
}

/// Checks all verbs of a search at points of the cloud and elsewhere.
void check(const nanoflann_search<points>& search, const points& cloud) {
  std::vector<std::array<float, 3>> queries{{0.5F, 0.4F, 0.3F}, {-3.0F, 100.0F, 0.0F}};
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 30) {
    if (orbis::test::finite(cloud[i])) queries.push_back({cloud[i].x(), cloud[i].y(), cloud[i].z()});
  }
  for (const auto& q : queries) {
    const auto all = all_squared(cloud, q);
    CHECK(search.size() == all.size());
    std::vector<neighbor<float>> found;
    for (const std::size_t k : {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{12}, std::size_t{40},
                                cloud.size(), cloud.size() + 1}) {
      search.knn(q, k, found);
      const std::size_t wanted = std::min(k, all.size());
      REQUIRE(found.size() == wanted);
      bool distances = true;
      bool ordered = true;
      for (std::size_t n = 0; n != wanted; ++n) {
        distances = distances && found[n].distance == std::sqrt(all[n].distance);
        const auto& p = cloud[found[n].index];
        distances = distances && std::sqrt(orbis::test::squared({q[0], q[1], q[2]}, p)) == found[n].distance;
        ordered = ordered && (n == 0 || orbis::cloud::is_nearer(found[n - 1], found[n]));
      }
      CHECK(distances);
      CHECK(ordered);
    }
    for (const std::size_t rank : {std::size_t{0}, std::size_t{5}, std::size_t{60}}) {
      if (rank >= all.size()) continue;
      const float r = std::sqrt(all[rank].distance);
      auto expected = all;
      std::erase_if(expected, [&](const auto& n) { return n.distance > r * r; });
      search.radius(q, r, found);
      CHECK(found == plain(expected));
    }
  }
}

}  // namespace

TEST_CASE("every search finds what brute force finds") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    check(nanoflann_search{cloud}, cloud);
  }
}

TEST_CASE("searches take shuffled clouds and more neighbours than a leaf") {
  points cloud = orbis::test::room_cloud(120, 90, 0.002, 3);
  orbis::random_bits random{4};
  for (std::size_t i = cloud.size(); i-- > 1;) {
    std::swap(cloud[i], cloud[random.below(static_cast<std::uint32_t>(i + 1))]);
  }
  check(nanoflann_search{cloud}, cloud);
}

TEST_CASE("identical points do not take quadratic time in searches") {
  const points identical(100'000, orbis::vec3f{0.5F, 0.5F, 0.5F});
  const nanoflann_search search{identical};
  std::vector<neighbor<float>> found;
  std::size_t total = 0;
  for (int i = 0; i != 20'000; ++i) {
    search.knn({0.5F, 0.5F, 0.5F}, 10, found);
    total += found.size();
  }
  CHECK(total == 200'000);
}

TEST_CASE("doubles are searched as doubles") {
  const std::vector<orbis::vec3> cloud{{1e9, 0, 0}, {1e9 + 3, 4, 0}, {1e9 + 1, 0, 0}};
  const nanoflann_search search{cloud};
  std::vector<neighbor<double>> found;
  search.knn({1e9, 0, 0}, 3, found);
  CHECK(found == std::vector<neighbor<double>>{{0, 0.0}, {2, 1.0}, {1, 5.0}});
}
