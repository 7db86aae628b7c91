// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>

#include <orbis/optimize/detail/sparse/block_symbolic.hpp>

#include "optimize/block_matrices.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize::detail;

namespace {

/// Rows below the diagonal of each column of the factor, by elimination.
std::vector<std::set<std::uint32_t>> columns_of_factor(const block_symbolic& s, const test::places& places) {
  std::vector<std::set<std::uint32_t>> columns(s.size());
  for (const block_place& p : places) {
    const std::uint32_t a = s.position[p.row], b = s.position[p.column];
    columns[std::min(a, b)].insert(std::max(a, b));
  }
  for (std::uint32_t k = 0; k != s.size(); ++k)
    if (!columns[k].empty()) {
      const std::uint32_t parent = *columns[k].begin();
      columns[parent].insert(std::next(columns[k].begin()), columns[k].end());
    }
  return columns;
}

void check_structure(std::size_t size, const test::places& places) {
  const block_symbolic s = analyze_blocks(size, places);
  REQUIRE(s.size() == size);
  for (std::uint32_t k = 0; k != size; ++k) REQUIRE(s.position[s.order[k]] == k);

  const auto columns = columns_of_factor(s, places);
  std::uint32_t next = 0;
  std::size_t blocks = 0;
  std::set<std::tuple<std::size_t, std::uint32_t, std::uint32_t>> updated;  // target, source, row
  for (std::uint32_t i = 0; i != s.supernodes.size(); ++i) {
    const supernode& node = s.supernodes[i];
    REQUIRE(node.first == next);
    next += node.columns;
    const auto rows = s.rows_of(node);
    REQUIRE(std::is_sorted(rows.begin(), rows.end()));
    const std::set<std::uint32_t> row_set(rows.begin(), rows.end());
    REQUIRE(row_set.size() == rows.size());
    for (std::uint32_t k = node.first; k != next; ++k) {
      REQUIRE(s.supernode_of[k] == i);
      for (const std::uint32_t row : columns[k]) REQUIRE((row < next || row_set.contains(row)));
    }
    // The last column has all rows: none is there for nothing.
    REQUIRE(columns[next - 1].size() == rows.size());
    blocks += std::size_t{node.columns} * (node.columns + 1) / 2 + std::size_t{node.columns} * node.rows;
    for (const supernode_update& u : s.updates_of(i)) {
      REQUIRE(u.source < i);
      for (std::uint32_t at = u.begin; at != u.end; ++at) {
        const std::uint32_t row = s.rows_of(s.supernodes[u.source])[at];
        REQUIRE(s.supernode_of[row] == i);
        REQUIRE(updated.insert({i, u.source, row}).second);
      }
    }
  }
  REQUIRE(next == size);
  REQUIRE(s.factor_blocks == blocks);
  std::size_t rows = 0;
  for (const supernode& node : s.supernodes) rows += node.rows;
  REQUIRE(updated.size() == rows);

  // Merging columns wastes no more than it is allowed to.
  std::size_t needed = size;
  for (const auto& column : columns) needed += column.size();
  CHECK(s.factor_blocks >= needed);
  CHECK(static_cast<double>(s.factor_blocks) <= 1.7 * static_cast<double>(needed) + 10.0);
}

}  // namespace

TEST_CASE("The structure holds every block of the factor, each supernode its rows and updates") {
  check_structure(0, {});
  check_structure(1, {});
  check_structure(5, {});
  check_structure(2, {{1, 0}});
  check_structure(400, test::grid_places(20, 20));
  random_bits random{331};
  for (int trial = 0; trial != 100; ++trial) {
    const std::uint32_t size = 2 + random.below(120);
    check_structure(size, test::random_places(random, size, random.below(std::min(3 * size, size * (size - 1) / 2))));
  }
}

TEST_CASE("A clique is one supernode") {
  test::places clique;
  for (std::uint32_t i = 0; i != 15; ++i)
    for (std::uint32_t j = 0; j != i; ++j) clique.push_back({i, j});
  const block_symbolic s = analyze_blocks(15, clique);
  REQUIRE(s.supernodes.size() == 1);
  CHECK(s.supernodes[0].columns == 15);
  CHECK(s.rows.empty());
}
