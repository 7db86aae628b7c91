// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/knn/neighbor_graph.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::neighbor_table;
using orbis::cloud::detail::make_leaves;
using orbis::cloud::detail::neighbor_graph;
using orbis::test::points;

namespace {

template <class Policy>
neighbor_graph graph_of(const Policy& policy, const points& cloud, std::size_t k) {
  return {policy, make_leaves(policy, orbis::cloud::detail::viewed_points{cloud}, std::min(k, cloud.size()) + 1),
          cloud.size(), k};
}

/// Points whose row in the graph is not, bit for bit, that of the table.
std::size_t differences(const neighbor_graph& graph, const neighbor_table& table) {
  std::size_t different = 0;
  const std::vector<std::uint32_t> place_of = graph.places(table.points);
  for (std::size_t i = 0; i != table.points; ++i) {
    const auto row = table[i];
    if (place_of[i] == neighbor_graph::no_place) {
      different += row.empty() ? 0 : 1;
      continue;
    }
    std::size_t n = 0;
    bool same = graph.index(place_of[i]) == i && row.size() == graph.width();
    graph.for_each_neighbor(place_of[i], graph.width(), [&](std::uint32_t j) {
      same = same && n != row.size() && graph.index(j) == row[n].index &&
             graph.distance(place_of[i], j) == row[n].distance;
      ++n;
    });
    different += same && n == row.size() ? 0 : 1;
  }
  return different;
}

bool equal_or_both_nan(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

}  // namespace

TEST_CASE("the rows of a graph are those of the table, whatever the cloud and the policy") {
  auto clouds = orbis::test::all_clouds();
  for (const std::size_t n : {15U, 16U, 17U, 31U, 33U, 2047U, 2048U, 2049U, 4096U, 4100U})  // about leaves and chunks
    clouds.emplace_back("edge " + std::to_string(n), orbis::test::uniform_cloud(n, n));
  orbis::random_bits random{1};
  const points some = orbis::test::uniform_cloud(60, 2);
  points copies;
  for (int i = 0; i != 3000; ++i) copies.push_back(some[random.below(random.below(60) + 1)]);
  clouds.emplace_back("many copies", copies);
  points overflowing = orbis::test::uniform_cloud(20, 3, 1e17);
  for (int i = 0; i != 20; ++i) overflowing.emplace_back(1e20F * static_cast<float>(i), 0.0F, 0.0F);
  clouds.emplace_back("overflowing", overflowing);
  for (const auto& [name, cloud] : clouds) {
    for (const std::size_t k : {1U, 12U, 40U}) {
      INFO(name << " k " << k);
      const neighbor_table table = orbis::cloud::all_knn(orbis::seq, cloud, k);
      const neighbor_graph graph = graph_of(orbis::seq, cloud, k);
      CHECK(differences(graph, table) == 0);
      CHECK(differences(graph_of(orbis::par.with(3), cloud, k), table) == 0);
      for (const std::size_t averaged : {std::size_t{1}, k}) {
        const auto expected = orbis::test::mean_distances_of(table, averaged);
        const auto means = graph.mean_distance(orbis::par.with(2), averaged);
        std::size_t wrong = 0;
        for (std::size_t p = 0; p != graph.size(); ++p)
          wrong += equal_or_both_nan(means[p], expected[graph.index(p)]) ? 0 : 1;
        CHECK(wrong == 0);
      }
    }
  }
}

TEST_CASE("neighbours in more leaves than a byte or two bytes can tell") {
  for (const auto& [n, k] : {std::pair{20'000U, 100U}, {4500U, 4300U}}) {
    const points cloud = orbis::test::uniform_cloud(n, 5);
    CHECK(differences(graph_of(orbis::par, cloud, k), orbis::cloud::all_knn(orbis::par, cloud, k)) == 0);
  }
}

TEST_CASE("a graph of a part of a cloud is that of the part alone") {
  const points cloud = orbis::test::room_cloud(64, 48, 0.002, 3);
  std::vector<char> there(cloud.size(), 1);
  orbis::random_bits random{4};
  for (char& t : there) t = random.below(3) != 0 ? 1 : 0;
  points part;
  std::vector<std::uint32_t> index;
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    if (there[i] == 0) continue;
    part.push_back(cloud[i]);
    index.push_back(static_cast<std::uint32_t>(i));
  }
  const neighbor_graph graph{orbis::seq, make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 13, there),
                             cloud.size(), 12};
  const neighbor_graph alone = graph_of(orbis::seq, part, 12);
  REQUIRE(graph.size() == alone.size());
  std::size_t different = 0;
  for (std::size_t p = 0; p != graph.size(); ++p) {
    different += graph.index(p) == index[alone.index(p)] ? 0 : 1;
    std::vector<std::uint32_t> a, b;
    graph.for_each_neighbor(p, 12, [&](std::uint32_t n) { a.push_back(n); });
    alone.for_each_neighbor(p, 12, [&](std::uint32_t n) { b.push_back(n); });
    different += a == b ? 0 : 1;
  }
  CHECK(different == 0);
}

TEST_CASE("a graph of a surface takes little more than a byte for a neighbour") {
  const points cloud = orbis::test::room_cloud(320, 240, 0.001, 7);
  const neighbor_graph graph = graph_of(orbis::par, cloud, 12);
  const auto per_point = static_cast<double>(graph.memory_bytes()) / static_cast<double>(cloud.size());
  CHECK(per_point < 38.0);  // 18 are positions and indices; a table takes 96
  CHECK(per_point > 28.0);
}
