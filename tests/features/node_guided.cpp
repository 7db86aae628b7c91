// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/features/matcher.hpp>
#include <orbis/features/node_guided.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("guided by nodes, exactly the pairs with a common node are compared, at every level") {
  const simd::level_limit limit{GENERATE(from_range(simd::available_levels()))};
  const int nodes = GENERATE(1, 7, 60, 100000);
  const auto q = test::random_features(200, 1);
  const auto t = test::random_features(301, 2);
  random_bits random{3};
  const auto node_of = [&] {
    return random.below(10) == 0 ? none : static_cast<std::uint32_t>(random.below(static_cast<std::uint32_t>(nodes)));
  };
  std::vector<std::uint32_t> a(q.size()), b(t.size());
  for (auto& n : a) n = node_of();
  for (auto& n : b) n = node_of();
  const auto expected =
      test::naive_candidates(q, t, [&](std::uint32_t i, std::uint32_t j) { return a[i] != none && a[i] == b[j]; });
  const auto source = node_guided(hamming{});
  const node_index query_nodes{a}, train_nodes{b};
  const search_needs reverse{.reverse = true};
  CHECK(candidates_of(source, view_of(q), view_of(t), reverse, query_nodes, train_nodes) == expected);
  CHECK(candidates_of(source, view_of(q), view_of(t), reverse, query_nodes.groups(), train_nodes.groups()) == expected);
  if (nodes < 100) CHECK(expected.size() > 100);
}

TEST_CASE("a node index lists each feature under its node, and survives being moved and used again") {
  node_index index{std::vector<std::uint32_t>{5, 2, none, 5, 0}};
  node_index moved{std::move(index)};
  REQUIRE(moved.groups().size() == 3);
  CHECK(moved.groups()[0].node == 0);
  CHECK(moved.groups()[2].node == 5);
  CHECK(std::vector<std::uint32_t>(moved.groups()[2].features.begin(), moved.groups()[2].features.end()) ==
        std::vector<std::uint32_t>{0, 3});
  moved.assign({});
  CHECK(moved.groups().empty());
}

TEST_CASE("a guided chain finds nothing without common nodes") {
  const auto f = test::random_features(20, 1);
  constexpr auto matcher = node_guided(hamming{}) | cross_check{} | unique{};
  const std::vector<std::uint32_t> ones(20, 1), twos(20, 2);
  CHECK(matcher(f, f, node_index{ones}, node_index{twos}).empty());
  CHECK(matcher(f, f, node_index{ones}, node_index{}).empty());
  CHECK_FALSE(matcher(f, f, node_index{ones}, node_index{ones}).empty());
}
