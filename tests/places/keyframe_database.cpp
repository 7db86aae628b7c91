// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/keyframe_database.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

namespace {

/// Bags of a world of `words` words, of which each place shows some.
[[nodiscard]] bag_of_words random_bag(random_bits& random, std::uint32_t words = 400, std::uint32_t place = 0) {
  bag_of_words bag;
  for (std::uint32_t w = 0; w != words; ++w) {
    const bool of_place = (w + 37 * place) % 5 == 0;
    if (random.below(100) < (of_place ? 70U : 8U))
      bag.words.push_back({w, static_cast<float>(random.uniform(0.1, 2.0))});
  }
  normalize(bag);
  return bag;
}

using neighbors_of = std::map<std::uint32_t, std::vector<std::uint32_t>>;

/// The criteria over all keyframes, one after the other.
[[nodiscard]] std::vector<place_candidate<std::uint32_t>> brute_force(const std::map<std::uint32_t, bag_of_words>& all,
                                                                      const bag_of_words& image,
                                                                      const query_options& options,
                                                                      const std::set<std::uint32_t>& excluded,
                                                                      const neighbors_of& neighbors) {
  std::map<std::uint32_t, std::pair<std::uint32_t, double>> scored;
  std::size_t most = 0;
  for (const auto& [id, bag] : all)
    if (!excluded.contains(id)) most = std::max(most, shared_words(image, bag));
  for (const auto& [id, bag] : all) {
    const std::size_t shared = shared_words(image, bag);
    if (shared == 0 || excluded.contains(id) ||
        !(static_cast<double>(shared) > options.shared_words * static_cast<double>(most)))
      continue;
    scored[id] = {static_cast<std::uint32_t>(shared), similarity(image, bag)};
  }
  std::vector<place_candidate<std::uint32_t>> groups;
  for (const auto& [id, s] : scored) {
    if (s.second < options.min_score) continue;
    place_candidate<std::uint32_t> group{id, s.first, s.second, s.second};
    if (const auto near = neighbors.find(id); near != neighbors.end())
      for (const std::uint32_t n : near->second) {
        const auto at = scored.find(n);
        if (at == scored.end() || n == id) continue;
        group.group_score += at->second.second;
        if (at->second.second > group.score || (at->second.second == group.score && n < group.id)) {
          group.id = n;
          group.shared_words = at->second.first;
          group.score = at->second.second;
        }
      }
    groups.push_back(group);
  }
  double best = 0.0;
  for (const auto& g : groups) best = std::max(best, g.group_score);
  std::map<std::uint32_t, place_candidate<std::uint32_t>> kept;
  for (const auto& g : groups)
    if (g.group_score > options.group_score * best) {
      const auto [at, fresh] = kept.try_emplace(g.id, g);
      if (!fresh && at->second.group_score < g.group_score) at->second = g;
    }
  std::vector<place_candidate<std::uint32_t>> found;
  for (const auto& [id, g] : kept) found.push_back(g);
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.group_score > b.group_score; });
  return found;
}

}  // namespace

TEST_CASE("after any additions and erasures a query finds what a look at all keyframes finds") {
  random_bits random{GENERATE(1U, 2U, 3U)};
  keyframe_database database;
  std::map<std::uint32_t, bag_of_words> all;
  neighbors_of neighbors;
  std::vector<keyframe_database::candidate> found;
  keyframe_database::workspace memory;
  std::size_t candidates = 0, grouped = 0;
  for (int step = 0; step != 400; ++step) {
    const std::uint32_t id = random.below(90);
    if (random.below(4) == 0) {
      const std::uint32_t to = random.below(90);
      const bool can = all.contains(id) && !all.contains(to);
      CHECK(database.rename(id, to) == can);
      if (can) all[to] = std::move(all.extract(id).mapped());
      if (can) CHECK(database.bag(to) == all[to]);
    } else if (random.below(3) != 0) {
      const auto bag = random_bag(random, 400, id / 10);
      CHECK(database.add(id, bag) == !all.contains(id));
      all.try_emplace(id, bag);
      neighbors[id].clear();
      for (int n = 0; n != 6; ++n) neighbors[id].push_back(id / 10 * 10 + random.below(12));
      if (id % 4 == 0) neighbors[id].clear();
    } else {
      CHECK(database.erase(id) == (all.erase(id) != 0));
    }
    CHECK(database.size() == all.size());
    CHECK(database.contains(id) == all.contains(id));
    if (step % 4 != 0) continue;
    const auto image = random_bag(random, 400, random.below(9));
    std::set<std::uint32_t> excluded;
    for (std::uint32_t n = random.below(30); n != 0; --n) excluded.insert(random.below(90));
    const query_options options{.shared_words = 0.3 + 0.1 * random.below(7), .min_score = 0.05 * random.below(5)};
    const auto expected = brute_force(all, image, options, excluded, neighbors);
    database.query(
        image, found, memory, options, [&](std::uint32_t i) { return excluded.contains(i); },
        [&](std::uint32_t i) -> const std::vector<std::uint32_t>& { return neighbors[i]; });
    CHECK(found == expected);
    CHECK(database.query(image, options, [&](std::uint32_t i) { return excluded.contains(i); }) ==
          brute_force(all, image, options, excluded, {}));
    candidates += found.size();
    for (const auto& c : found) grouped += c.group_score > c.score ? 1 : 0;

    auto by_score = brute_force(all, image, {.shared_words = 0.0, .group_score = 0.0}, {}, {});
    std::erase_if(by_score, [](const auto& c) { return c.score == 0.0; });
    auto best = database.best(image, 5);
    std::erase_if(best, [](const auto& c) { return c.score == 0.0; });
    CHECK(best.size() == std::min<std::size_t>(5, by_score.size()));
    CHECK(std::equal(best.begin(), best.end(), by_score.begin()));
  }
  CHECK(candidates > 100);
  CHECK(grouped > 20);
}

TEST_CASE("what was added and erased has never been there") {
  random_bits random{1};
  keyframe_database clean, used;
  std::vector<bag_of_words> bags;
  for (std::uint32_t i = 0; i != 120; ++i) bags.push_back(random_bag(random, 400, i % 6));
  for (std::uint32_t i = 0; i != 120; ++i) used.add(i, bags[i]);
  for (std::uint32_t i = 0; i != 120; ++i)
    if (i % 3 != 1) used.erase(119 - i);
  for (std::uint32_t i = 120; i-- != 0;)
    if ((119 - i) % 3 == 1 || i > 100) {
      used.add(i, bags[i]);
      clean.add(i, bags[i]);
    }
  CHECK(used.size() == clean.size());
  for (int q = 0; q != 50; ++q) {
    const auto image = random_bag(random, 400, random.below(6));
    CHECK(used.query(image, {.shared_words = 0.5}) == clean.query(image, {.shared_words = 0.5}));
    CHECK(used.best(image, 20) == clean.best(image, 20));
  }
}

TEST_CASE("a database from which as much is erased as added does not grow, and allocates nothing for queries") {
  random_bits random{1};
  keyframe_database database;
  std::vector<keyframe_database::candidate> found;
  keyframe_database::workspace memory;
  std::vector<bag_of_words> bags;
  for (int i = 0; i != 64; ++i) bags.push_back(random_bag(random, 2000, random.below(6)));
  std::uint32_t next = 0;
  const auto turn_over = [&](std::uint32_t times) {
    for (std::uint32_t i = 0; i != times; ++i, ++next) {
      database.add(next, bags[next % 64]);
      if (next >= 50) database.erase(next - 50);
    }
  };
  turn_over(500);
  const std::size_t before = database.memory();
  turn_over(5000);
  CHECK(database.memory() <= before + before / 10);
  const auto neighbors = [](std::uint32_t i) { return std::array<std::uint32_t, 2>{i - 1, i + 1}; };
  for (const auto& bag : bags) database.query(bag, found, memory, {}, none_excluded{}, neighbors);
  const std::size_t allocations = test::allocations();
  for (const auto& bag : bags) database.query(bag, found, memory, {}, none_excluded{}, neighbors);
  if (test::counts_allocations()) CHECK(test::allocations() == allocations);
  for (std::uint32_t i = next - 50; i != next; ++i) CHECK(database.erase(i));
  CHECK(database.empty());
  CHECK(database.best(bags[0], 3).empty());
}

TEST_CASE("keyframes may be named by anything with an order and a hash") {
  basic_keyframe_database<std::string> database;
  bag_of_words kitchen{{{1, 1}, {2, 1}, {3, 1}}}, hall{{{3, 1}, {4, 1}, {5, 2}}};
  normalize(kitchen);
  normalize(hall);
  CHECK(database.add("kitchen", kitchen));
  CHECK(database.add("hall", hall));
  CHECK_FALSE(database.add("hall", kitchen));
  CHECK(database.bag("hall") == hall);
  CHECK(database.score(kitchen, "hall") == similarity(kitchen, hall));
  const auto found = database.query(hall);
  REQUIRE(found.size() == 1);
  CHECK(found[0].id == "hall");
  CHECK(found[0].shared_words == 3);
  CHECK(found[0].score == Approx(1.0));
  CHECK(database.best(hall, 5).size() == 2);
  database.clear();
  CHECK(database.empty());
  CHECK(database.query(hall).empty());
  CHECK(database.query({}).empty());
}

TEST_CASE("equal keyframes come in the order of their names, and one place gives one candidate") {
  const bag_of_words bag{{{1, 0.5F}, {2, 0.5F}}};
  keyframe_database database;
  for (const std::uint32_t id : {7U, 3U, 9U, 5U}) database.add(id, bag);
  const auto apart = database.query(bag);
  REQUIRE(apart.size() == 4);
  for (std::size_t i = 0; i != 4; ++i) CHECK(apart[i].id == 3 + 2 * i);
  const auto together = database.query(bag, {}, none_excluded{}, [](std::uint32_t) {
    return std::vector<std::uint32_t>{3, 5, 7, 9, 11};
  });
  REQUIRE(together.size() == 1);
  CHECK(together[0].id == 3);
  CHECK(together[0].group_score == 4.0);
}
