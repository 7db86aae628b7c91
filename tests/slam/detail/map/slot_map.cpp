// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <memory>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/map/slot_map.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::no_id;
template <class T>
using slot_map = slam::detail::slot_map<T, slam::keyframe_id>;

TEST_CASE("Numbers ascend, stay, and are never used again") {
  slot_map<std::vector<int>> all;
  CHECK(all.empty());
  CHECK(all.add({0}) == 0);
  CHECK(all.add({1, 1}) == 1);
  CHECK(all.add({2}) == 2);
  const auto& second = all[1];
  all.erase(0);
  CHECK(all.add({3}) == 3);  // in the place of the first
  for (int i = 0; i != 100; ++i) all.add({i});
  CHECK(second == std::vector<int>{1, 1});  // not moved
  CHECK(&second == &all[1]);
  CHECK_FALSE(all.contains(0));
  CHECK_FALSE(all.contains(all.end_id()));
  CHECK_FALSE(all.contains(no_id));
  CHECK(all.size() == 103);
  CHECK(all.end_id() == 104);
  CHECK(all.front() == std::vector<int>{1, 1});
  CHECK(all.back() == std::vector<int>{99});
  all.erase(103);
  CHECK(all.back() == std::vector<int>{98});
}

TEST_CASE("What is erased frees its memory at once") {
  slot_map<std::shared_ptr<int>> all;
  const auto watched = std::make_shared<int>(1);
  all.add(watched);
  CHECK(watched.use_count() == 2);
  all.erase(0);
  CHECK(watched.use_count() == 1);
}

TEST_CASE("A number leads to what took its place in the end") {
  slot_map<int> all;
  for (int i = 0; i != 6; ++i) all.add(i);
  all.erase(0, 1);
  all.erase(1, 5);
  all.erase(2);
  CHECK(all.replacement(0) == 5);
  CHECK(all.replacement(1) == 5);
  CHECK(all.replacement(2) == no_id);
  CHECK(all.replacement(3) == 3);
  CHECK(all.replacement(6) == no_id);
  CHECK(all.replacement(no_id) == no_id);
  all.erase(5);
  CHECK(all.replacement(0) == no_id);
}

TEST_CASE("A store behaves as a map from numbers after any sequence of operations, appended ones included") {
  random_bits random(11);
  struct pair {
    slot_map<int> tested;
    std::map<std::uint32_t, int> plain;
    std::map<std::uint32_t, std::uint32_t> successor;
    std::uint32_t end = 0;
  };
  pair a, b;
  const auto check = [](const pair& p) {
    REQUIRE(p.tested.size() == p.plain.size());
    REQUIRE(p.tested.end_id() == p.end);
    REQUIRE(std::vector<int>(p.tested.begin(), p.tested.end()) == [&] {
      std::vector<int> values;
      for (const auto& [id, value] : p.plain) values.push_back(value);
      return values;
    }());
    for (std::uint32_t id = 0; id != p.end; ++id) {
      REQUIRE(p.tested.contains(id) == p.plain.contains(id));
      std::uint32_t now = id;
      while (now != no_id && !p.plain.contains(now)) now = p.successor.at(now);
      REQUIRE(p.tested.replacement(id) == now);
    }
  };
  for (int step = 0; step != 4000; ++step) {
    pair& p = random.below(2) == 0 ? a : b;
    const auto id = p.end == 0 ? 0 : random.below(p.end);
    switch (random.below(step < 3000 ? 3 : 5)) {
      case 0:
        p.plain[p.end] = step;
        REQUIRE(p.tested.add(step) == p.end++);
        break;
      case 1:
        if (random.below(20) != 0) break;
        p.successor[p.end] = no_id;
        REQUIRE(p.tested.add_erased(no_id) == p.end++);
        break;
      default:
        if (!p.plain.contains(id)) break;
        std::uint32_t to = random.below(p.end);
        if (to == id || !p.plain.contains(to)) to = no_id;
        p.tested.erase(id, to);
        p.plain.erase(id);
        p.successor[id] = to;
    }
    if (step % 500 == 250) {
      const auto shift = a.end;
      for (const auto& [i, value] : b.plain) a.plain[i + shift] = value;
      for (const auto& [i, to] : b.successor) a.successor[i + shift] = to == no_id ? no_id : to + shift;
      a.end += b.end;
      REQUIRE(a.tested.append(std::move(b.tested)) == shift);
      b = pair{};
    }
    if (step % 50 == 0) {
      check(a);
      check(b);
    }
  }
  check(a);
  CHECK(a.end > 500);
}

TEST_CASE("A store that need not remember forgets what replaced an object long ago") {
  slam::detail::slot_map<int, slam::landmark_id, 1000> all;
  for (int i = 0; i != 5; ++i) all.add(i);
  all.erase(0, 4);
  all.erase(1, 4);
  for (std::uint32_t i = 5; i != 505; ++i) {
    all.add(static_cast<int>(i));
    all.erase(i, 4);
  }
  CHECK(all.replacement(0) == 4);
  CHECK(all.replacement(300) == 4);
  for (std::uint32_t i = 505; i != 3000; ++i) {
    all.add(static_cast<int>(i));
    all.erase(i);
  }
  CHECK(all.replacement(0) == 4);  // its neighbours are there
  CHECK(all.replacement(300) == no_id);
  CHECK(all.size() == 3);
  CHECK(std::vector<int>(all.begin(), all.end()) == std::vector{2, 3, 4});
  CHECK(all.next_id(0) == 2);
  CHECK(all.next_id(5) == all.end_id());
  CHECK(all.next_known_id(0) == 0);

  // What another store has erased is erased here when it is appended.
  decltype(all) recent;
  for (int i = 0; i != 5000; ++i) recent.add(i);
  for (std::uint32_t i = 0; i != 256; ++i) recent.erase(i, 300);
  decltype(all) into;
  into.append(std::move(recent));
  CHECK(into.replacement(0) == 300);
  CHECK(into.back() == 4999);

  decltype(all) other;
  other.add_gone(100);
  other.add(77);
  other.add_erased(100);
  CHECK(all.append(std::move(other)) == 3000);
  CHECK(all.end_id() == 3102);
  CHECK(all[3100] == 77);
  CHECK(all.replacement(3101) == 3100);
  CHECK(all.replacement(3050) == no_id);
}
