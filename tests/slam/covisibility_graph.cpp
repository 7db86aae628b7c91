// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/covisibility_graph.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::covisibility_graph;
using slam::covisible;
using slam::keyframe_id;
using slam::no_id;

namespace {

[[nodiscard]] std::vector<covisible> sharing(const covisibility_graph& graph, keyframe_id k) {
  const auto pairs = graph.sharing(k);
  return {pairs.begin(), pairs.end()};
}

}  // namespace

TEST_CASE("Neighbours come by weight, the older first where equal") {
  covisibility_graph graph(15);
  graph.share(5, 1, 20);
  graph.share(5, 9, 40);
  graph.share(5, 2, 20);
  graph.share(5, 3, 14);
  graph.share(9, 3, 16);
  graph.share(5, 0, 15);
  CHECK(graph.neighbors(5) == std::vector<covisible>{{9, 40}, {1, 20}, {2, 20}, {0, 15}});
  CHECK(graph.neighbors(5, 2) == std::vector<covisible>{{9, 40}, {1, 20}});
  CHECK(graph.neighbors(5, 0).empty());
  CHECK(graph.at_least(5, 20) == std::vector<covisible>{{9, 40}, {1, 20}, {2, 20}});
  CHECK(graph.at_least(5, 1).size() == 5);
  CHECK(sharing(graph, 5) == std::vector<covisible>{{0, 15}, {1, 20}, {2, 20}, {3, 14}, {9, 40}});
  CHECK(graph.strongest(5) == covisible{9, 40});
  CHECK(graph.shared(9, 5) == 40);
  CHECK(graph.shared(9, 1) == 0);
  CHECK(graph.neighbors(77).empty());
  CHECK(graph.strongest(77) == covisible{});
}

TEST_CASE("A keyframe that shares little has one edge, and the other end has it too") {
  covisibility_graph graph(15);
  graph.share(0, 1, 50);
  graph.share(2, 0, 3);
  graph.share(2, 1, 4);
  CHECK(graph.neighbors(2) == std::vector<covisible>{{1, 4}});
  CHECK(graph.neighbors(1) == std::vector<covisible>{{0, 50}, {2, 4}});
  CHECK(graph.neighbors(0) == std::vector<covisible>{{1, 50}});
  CHECK(graph.connected(1, 2));
  CHECK(graph.connected(2, 1));
  CHECK_FALSE(graph.connected(2, 0));
  graph.unshare(2, 1, 2);  // now it shares most with another
  CHECK(graph.connected(0, 2));
  CHECK_FALSE(graph.connected(1, 2));
  graph.share(2, 0, 12);  // an edge as good as any
  CHECK(graph.neighbors(2) == std::vector<covisible>{{0, 15}});
}

namespace {

/// The same by counting afresh.
struct counted_pairs {
  std::map<std::pair<keyframe_id, keyframe_id>, std::uint32_t> pairs;  // both ways
  std::uint32_t min_shared;

  [[nodiscard]] std::vector<covisible> sharing(keyframe_id k) const {
    std::vector<covisible> all;
    for (auto at = pairs.lower_bound({k, 0}); at != pairs.end() && at->first.first == k; ++at)
      all.push_back({at->first.second, at->second});
    return all;
  }
  [[nodiscard]] covisible best(keyframe_id k) const {
    covisible b;
    for (const covisible& c : sharing(k))
      if (c.shared > b.shared) b = c;
    return b;
  }
  [[nodiscard]] bool connected(keyframe_id a, keyframe_id b) const {
    const auto at = pairs.find({a, b});
    if (at == pairs.end()) return false;
    return at->second >= min_shared || (best(a).keyframe == b && best(a).shared < min_shared) ||
           (best(b).keyframe == a && best(b).shared < min_shared);
  }
};

void check_equal(const covisibility_graph& graph, const counted_pairs& plain, keyframe_id end) {
  for (keyframe_id k = 0; k != end; ++k) {
    REQUIRE(sharing(graph, k) == plain.sharing(k));
    REQUIRE(graph.strongest(k) == plain.best(k));
    std::vector<covisible> neighbors;
    for (const covisible& c : plain.sharing(k)) {
      REQUIRE(graph.connected(k, c.keyframe) == plain.connected(k, c.keyframe));
      REQUIRE(graph.connected(c.keyframe, k) == graph.connected(k, c.keyframe));
      if (plain.connected(k, c.keyframe)) neighbors.push_back(c);
    }
    std::stable_sort(neighbors.begin(), neighbors.end(), [](auto& a, auto& b) { return a.shared > b.shared; });
    REQUIRE(graph.neighbors(k) == neighbors);
    REQUIRE(neighbors.empty() == plain.sharing(k).empty());
    neighbors.resize(std::min<std::size_t>(neighbors.size(), 3));
    REQUIRE(graph.neighbors(k, 3) == neighbors);
  }
}

}  // namespace

TEST_CASE("After any sequence of changes the graph is what counting afresh gives") {
  random_bits random(23);
  for (const std::uint32_t min_shared : {1U, 6U, 100U}) {
    covisibility_graph graph(min_shared);
    counted_pairs plain{{}, min_shared};
    constexpr std::uint32_t end = 18;
    for (int step = 0; step != 6000; ++step) {
      const keyframe_id a = random.below(end), b = random.below(end);
      if (a == b) continue;
      const auto shared = plain.pairs.contains({a, b}) ? plain.pairs[{a, b}] : 0U;
      const std::uint32_t n = random.below(random.below(8) == 0 ? 9 : 3);
      switch (random.below(16)) {
        case 0:
          if (random.below(12) != 0) break;
          graph.erase(a);
          std::erase_if(plain.pairs, [&](const auto& p) { return p.first.first == a || p.first.second == a; });
          break;
        case 1:
        case 2:
        case 3:
        case 4:
        case 5:
        case 6:
          graph.unshare(a, b, std::min(n, shared));
          if (shared <= n) {
            plain.pairs.erase({a, b});
            plain.pairs.erase({b, a});
          } else {
            plain.pairs[{a, b}] = plain.pairs[{b, a}] = shared - n;
          }
          break;
        default:
          graph.share(a, b, n);
          if (shared + n != 0) plain.pairs[{a, b}] = plain.pairs[{b, a}] = shared + n;
      }
      if (step % 20 == 0) check_equal(graph, plain, end);
    }
    check_equal(graph, plain, end);
    CHECK(plain.pairs.size() > 50);

    // Appended behind itself it is there twice, side by side.
    covisibility_graph twice = graph;
    twice.append(covisibility_graph(graph), 30);
    counted_pairs plain_twice = plain;
    for (const auto& [p, n] : plain.pairs) plain_twice.pairs[{p.first + 30, p.second + 30}] = n;
    check_equal(twice, plain_twice, 60);
  }
}
