// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/places/vocabulary_tree.hpp>

#include "support/catch.hpp"

using namespace orbis::places;

TEST_CASE("trees that hang together badly are refused") {
  vocabulary_tree<64> tree;
  const auto problem_of = [&](std::uint32_t nodes, std::vector<std::uint16_t> counts, std::vector<float> weights) {
    tree.node_count = nodes;
    tree.weights = std::move(weights);
    return connect_tree(tree, counts);
  };
  CHECK(problem_of(3, {2}, {1, 1}).empty());
  CHECK(problem_of(1, {}, {}).empty());
  CHECK_FALSE(problem_of(3, {1}, {1, 1}).empty());        // fewer children
  CHECK_FALSE(problem_of(3, {3}, {1, 1}).empty());        // more children
  CHECK_FALSE(problem_of(3, {0, 2}, {1, 1}).empty());     // a root without children, and a node of nobody
  CHECK_FALSE(problem_of(4, {1, 0, 2}, {1, 1}).empty());  // a node that would be its own ancestor
  CHECK_FALSE(problem_of(3, {2, 0}, {1, 1}).empty());     // a tail
  CHECK_FALSE(problem_of(3, {2}, {1}).empty());           // a word too few
  CHECK_FALSE(problem_of(3, {2}, {1, -1}).empty());
  CHECK_FALSE(problem_of(3, {2}, {1, 1e21F}).empty());
  CHECK_FALSE(problem_of(3, {2}, {1, std::nanf("")}).empty());
  CHECK_FALSE(problem_of(0xffffffffU, std::vector<std::uint16_t>(70000, 65535), {}).empty());
}
