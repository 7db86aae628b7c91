// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <orbis/cloud/nanoflann.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::nanoflann_search;
using orbis::cloud::neighbor;

TEST_CASE("k-d tree searches find what brute force finds") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const nanoflann_search search{cloud};
    std::vector<neighbor<float>> found;
    for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 40) {
      if (!orbis::test::finite(cloud[i])) continue;
      const std::array<float, 3> q{cloud[i].x(), cloud[i].y(), cloud[i].z()};
      std::vector<neighbor<float>> all;
      for (std::uint32_t j = 0; j != cloud.size(); ++j) {
        if (!orbis::test::finite(cloud[j])) continue;
        all.push_back({j, std::sqrt(orbis::test::squared(cloud[i], cloud[j]))});
      }
      std::sort(all.begin(), all.end(), orbis::cloud::is_nearer<float>);
      CHECK(search.size() == all.size());

      search.knn(q, 12, found);
      REQUIRE(found.size() == std::min<std::size_t>(12, all.size()));
      for (std::size_t j = 0; j != found.size(); ++j) {
        CHECK(found[j].distance == all[j].distance);  // which of several equally near ones is open
        CHECK(std::sqrt(orbis::test::squared(cloud[i], cloud[found[j].index])) == found[j].distance);
        if (j > 0) CHECK(orbis::cloud::is_nearer<float>(found[j - 1], found[j]));
      }

      const float radius = all[std::min<std::size_t>(7, all.size() - 1)].distance * 1.5F;
      search.radius(q, radius, found);
      std::erase_if(all, [&](const neighbor<float>& n) { return n.distance * n.distance > radius * radius * 1.0001F; });
      const auto clear = [&](const neighbor<float>& n) { return std::abs(n.distance - radius) > 1e-4F * radius; };
      std::erase_if(all, [&](const auto& n) { return radius > 0 && !clear(n); });
      std::erase_if(found, [&](const auto& n) { return radius > 0 && !clear(n); });
      CHECK(found == all);
    }
  }
}

TEST_CASE("distances are plain metres and a radius includes its border") {
  const std::vector<orbis::vec3> cloud{{0, 0, 0}, {0, 3, 4}, {0, 0, 10}};
  const nanoflann_search search{cloud};
  std::vector<neighbor<double>> found;
  search.knn({0, 0, 0}, 3, found);
  CHECK(found == std::vector<neighbor<double>>{{0, 0.0}, {1, 5.0}, {2, 10.0}});
  search.radius({0, 0, 0}, 5.0, found);
  CHECK(found == std::vector<neighbor<double>>{{0, 0.0}, {1, 5.0}});
  search.knn({0, 0, 0}, 0, found);
  CHECK(found.empty());
}
