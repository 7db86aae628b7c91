// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/spanning_tree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::keyframe_id;
using slam::no_id;
using slam::spanning_tree;
using ids = std::vector<keyframe_id>;

namespace {

constexpr auto nothing_shared = [](keyframe_id, keyframe_id) { return 0U; };

/// Parents, children and root tell of one tree with exactly these keyframes.
void check_tree(const spanning_tree& tree, const std::set<keyframe_id>& present,
                const std::set<std::pair<keyframe_id, keyframe_id>>& loops, keyframe_id end) {
  REQUIRE(tree.size() == present.size());
  REQUIRE((tree.root() == no_id) == present.empty());
  std::map<keyframe_id, ids> children;
  for (keyframe_id k = 0; k != end; ++k) {
    REQUIRE(tree.contains(k) == present.contains(k));
    if (!tree.contains(k)) continue;
    REQUIRE((tree.parent(k) == no_id) == (k == tree.root()));
    if (tree.parent(k) != no_id) children[tree.parent(k)].push_back(k);
    std::size_t steps = 0;
    for (keyframe_id up = k; up != tree.root(); up = tree.parent(up)) REQUIRE(++steps < present.size());
    ids others;
    for (const keyframe_id o : present)
      if (loops.contains(std::minmax(k, o))) others.push_back(o);
    REQUIRE(tree.loop_edges(k) == others);
  }
  for (const keyframe_id k : present) REQUIRE(tree.children(k) == children[k]);
}

}  // namespace

TEST_CASE("Children of an erased keyframe go where they share most") {
  // 0 - 1 - 2 - {3, 4, 5, 6}
  spanning_tree tree;
  tree.add(0, no_id);
  tree.add(1, 0);
  tree.add(2, 1);
  for (const keyframe_id k : {3U, 4U, 5U, 6U}) tree.add(k, 2);
  const std::map<std::pair<keyframe_id, keyframe_id>, std::uint32_t> shared{
      {{1, 4}, 30}, {{3, 4}, 50}, {{1, 3}, 10}, {{3, 5}, 5}, {{4, 5}, 4}};
  const auto replacement = tree.erase(2, [&](keyframe_id a, keyframe_id b) {
    const auto at = shared.find(std::minmax(a, b));
    return at == shared.end() ? 0U : at->second;
  });
  CHECK(replacement == 1);
  CHECK(tree.parent(4) == 1);  // the strongest tie to the parent
  CHECK(tree.parent(3) == 4);  // then a stronger one to that
  CHECK(tree.parent(5) == 3);
  CHECK(tree.parent(6) == 1);  // shares nothing
  CHECK(tree.children(1) == ids{4, 6});
  CHECK_FALSE(tree.contains(2));
}

TEST_CASE("The root's place is taken by its oldest child") {
  spanning_tree tree;
  tree.add(7, no_id);
  tree.add(8, 7);
  tree.add(9, 7);
  tree.add(10, 9);
  tree.add_loop_edge(7, 10);
  CHECK(tree.erase(7, nothing_shared) == 8);
  CHECK(tree.root() == 8);
  CHECK(tree.parent(8) == no_id);
  CHECK(tree.parent(9) == 8);
  CHECK(tree.loop_edges(8) == ids{10});  // the loop passes on
  CHECK(tree.loop_edges(10) == ids{8});
  for (const keyframe_id k : {8U, 9U}) tree.erase(k, nothing_shared);
  CHECK(tree.loop_edges(10).empty());  // with itself
  CHECK(tree.erase(10, nothing_shared) == no_id);
  CHECK(tree.root() == no_id);
  CHECK(tree.size() == 0);
  tree.add(11, no_id);
  CHECK(tree.root() == 11);
}

TEST_CASE("Any keyframe can be made the root") {
  spanning_tree tree;
  tree.add(0, no_id);
  tree.add(1, 0);
  tree.add(2, 1);
  tree.add(3, 1);
  tree.set_root(2);
  CHECK(tree.parent(2) == no_id);
  CHECK(tree.parent(1) == 2);
  CHECK(tree.parent(0) == 1);
  CHECK(tree.children(1) == ids{0, 3});
}

TEST_CASE("A tree stays one tree after any sequence of operations") {
  random_bits random(31);
  spanning_tree tree;
  std::set<keyframe_id> present;
  std::set<std::pair<keyframe_id, keyframe_id>> loops;
  keyframe_id end = 0;
  const auto shared = [](keyframe_id a, keyframe_id b) {
    return (a.value() * 7 + b.value() * 7 + a.value() * b.value()) % 23;
  };
  const auto any = [&] {
    auto at = present.begin();
    std::advance(at, random.below(static_cast<std::uint32_t>(present.size())));
    return *at;
  };
  for (int step = 0; step != 5000; ++step) {
    const auto kind = present.empty() ? 0U : random.below(6);
    if (kind <= (present.size() < 25 ? 2U : 0U)) {
      tree.add(end, present.empty() ? no_id : any());
      present.insert(end++);
    } else if (kind == 3) {
      tree.set_root(any());
    } else if (kind == 4) {
      const keyframe_id a = any(), b = any();
      if (a != b) {
        tree.add_loop_edge(a, b);
        loops.insert(std::minmax(a, b));
      }
    } else {
      const keyframe_id k = any();
      const keyframe_id replacement = tree.erase(k, shared);
      present.erase(k);
      REQUIRE((replacement == no_id ? present.empty() : present.contains(replacement)));
      for (const auto& [a, b] : std::set(loops)) {
        if (a != k && b != k) continue;
        loops.erase({a, b});
        const keyframe_id other = a == k ? b : a;
        if (replacement != no_id && other != replacement) loops.insert(std::minmax(replacement, other));
      }
    }
    if (step % 10 == 0) check_tree(tree, present, loops, end);
  }
  check_tree(tree, present, loops, end);

  const keyframe_id at = any(), by = any();
  spanning_tree twice = tree;
  twice.append(spanning_tree(tree), end.value(), at, by);
  auto all = present;
  auto all_loops = loops;
  for (const keyframe_id k : present) all.insert(k + end.value());
  for (const auto& [a, b] : loops) all_loops.insert({a + end.value(), b + end.value()});
  check_tree(twice, all, all_loops, end + end.value());
  CHECK(twice.parent(by + end.value()) == at);
  CHECK(twice.root() == tree.root());

  spanning_tree from_nothing;
  from_nothing.append(spanning_tree(tree), 3, no_id, no_id);
  CHECK(from_nothing.root() == tree.root() + 3);
  from_nothing.append(spanning_tree{}, end.value() + 3, no_id, no_id);
  CHECK(from_nothing.size() == present.size());
}
