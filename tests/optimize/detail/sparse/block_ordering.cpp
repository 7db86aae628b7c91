// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>
#include <set>

#include <orbis/optimize/detail/sparse/block_ordering.hpp>

#include "optimize/block_matrices.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize::detail;

namespace {

bool is_permutation_of(const std::vector<std::uint32_t>& order, std::size_t size) {
  std::vector<std::uint32_t> sorted = order, all(size);
  std::iota(all.begin(), all.end(), 0U);
  std::sort(sorted.begin(), sorted.end());
  return sorted == all;
}

/// Blocks of the factor, the diagonal included, by eliminating one after the other.
std::size_t fill(std::size_t size, const test::places& places, const std::vector<std::uint32_t>& order) {
  std::vector<std::set<std::uint32_t>> neighbors(size);
  for (const block_place& p : places) {
    neighbors[p.row].insert(p.column);
    neighbors[p.column].insert(p.row);
  }
  std::size_t blocks = 0;
  for (const std::uint32_t i : order) {
    blocks += 1 + neighbors[i].size();
    for (const std::uint32_t a : neighbors[i]) {
      neighbors[a].insert(neighbors[i].begin(), neighbors[i].end());
      neighbors[a].erase(a);
      neighbors[a].erase(i);
    }
    neighbors[i].clear();
  }
  return blocks;
}

/// The same by the exact minimum degree, ties to the lowest index.
std::size_t minimum_degree_fill(std::size_t size, const test::places& places) {
  std::vector<std::set<std::uint32_t>> neighbors(size);
  for (const block_place& p : places) {
    neighbors[p.row].insert(p.column);
    neighbors[p.column].insert(p.row);
  }
  std::set<std::uint32_t> left;
  for (std::uint32_t i = 0; i != size; ++i) left.insert(i);
  std::size_t blocks = 0;
  while (!left.empty()) {
    const std::uint32_t i = *std::min_element(left.begin(), left.end(), [&](std::uint32_t a, std::uint32_t b) {
      return neighbors[a].size() < neighbors[b].size();
    });
    left.erase(i);
    blocks += 1 + neighbors[i].size();
    for (const std::uint32_t a : neighbors[i]) {
      neighbors[a].insert(neighbors[i].begin(), neighbors[i].end());
      neighbors[a].erase(a);
      neighbors[a].erase(i);
    }
  }
  return blocks;
}

std::vector<std::uint32_t> order_of(std::size_t size, const test::places& places) {
  return minimum_degree_order(block_adjacency{size, places});
}

}  // namespace

TEST_CASE("Adjacency is both ways round") {
  const block_adjacency graph{4, test::places{{0, 2}, {3, 0}}};
  CHECK(std::ranges::equal(graph.neighbors(0), std::vector<std::uint32_t>{2, 3}));
  CHECK(graph.neighbors(1).empty());
  CHECK(std::ranges::equal(graph.neighbors(2), std::vector<std::uint32_t>{0}));
  CHECK(std::ranges::equal(graph.neighbors(3), std::vector<std::uint32_t>{0}));
}

TEST_CASE("An order has every block once, whatever the graph") {
  CHECK(order_of(0, {}).empty());
  CHECK(order_of(1, {}) == std::vector<std::uint32_t>{0});
  CHECK(is_permutation_of(order_of(7, {}), 7));
  CHECK(is_permutation_of(order_of(2, {{0, 1}, {0, 1}, {1, 0}}), 2));  // given several times
  random_bits random{321};
  for (int trial = 0; trial != 200; ++trial) {
    const std::uint32_t size = 2 + random.below(60);
    const std::size_t most = std::size_t{size} * (size - 1) / 2;
    const auto places = test::random_places(random, size, random.below(static_cast<std::uint32_t>(most + 1)));
    const auto order = order_of(size, places);
    REQUIRE(is_permutation_of(order, size));
    REQUIRE(order == order_of(size, places));
  }
}

TEST_CASE("Trees and cliques are ordered without fill") {
  test::places chain, star, clique;
  for (std::uint32_t i = 1; i != 200; ++i) {
    chain.push_back({i - 1, i});
    star.push_back({0, i});
  }
  for (std::uint32_t i = 0; i != 20; ++i)
    for (std::uint32_t j = 0; j != i; ++j) clique.push_back({i, j});
  CHECK(fill(200, chain, order_of(200, chain)) == 399);
  CHECK(fill(200, star, order_of(200, star)) == 399);
  CHECK(fill(20, clique, order_of(20, clique)) == 210);
  // A binary tree with shuffled names.
  random_bits random{322};
  std::vector<std::uint32_t> name(127);
  std::iota(name.begin(), name.end(), 0U);
  for (std::uint32_t i = 127; i > 1; --i) std::swap(name[i - 1], name[random.below(i)]);
  test::places tree;
  for (std::uint32_t i = 1; i != 127; ++i) tree.push_back({name[i], name[(i - 1) / 2]});
  CHECK(fill(127, tree, order_of(127, tree)) == 253);
}

TEST_CASE("Fill is about that of the exact minimum degree") {
  const auto grid = test::grid_places(24, 24);
  CHECK(static_cast<double>(fill(576, grid, order_of(576, grid))) <
        1.15 * static_cast<double>(minimum_degree_fill(576, grid)));
  random_bits random{323};
  for (int trial = 0; trial != 20; ++trial) {
    const std::uint32_t size = 50 + random.below(150);
    const auto places = test::random_places(random, size, size + random.below(size));
    CHECK(static_cast<double>(fill(size, places, order_of(size, places))) <
          1.25 * static_cast<double>(minimum_degree_fill(size, places)));
  }
}
