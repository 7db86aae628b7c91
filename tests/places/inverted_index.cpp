// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/inverted_index.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;

TEST_CASE("the lists of an index hold who has a word, after any additions and erasures") {
  random_bits random{1};
  inverted_index index;
  std::map<std::uint32_t, bag_of_words> there;
  std::size_t memory = 0;
  for (int step = 0; step != 3000; ++step) {
    const std::uint32_t image = random.below(60);
    if (const auto at = there.find(image); at != there.end()) {
      index.erase(image, at->second);
      there.erase(at);
    } else {
      bag_of_words bag;
      for (std::uint32_t w = 0; w != 40; ++w)
        if (random.below(3) != 0) bag.words.push_back({w, 1.0F});
      index.add(image, bag);
      there.emplace(image, std::move(bag));
    }
    if (step == 1000) memory = index.memory();
    if (step % 50 != 0) continue;
    for (std::uint32_t w = 0; w != 45; ++w) {
      const auto list = index.images_with(w);
      std::multiset<std::uint32_t> found(list.begin(), list.end()), expected;
      for (const auto& [i, bag] : there)
        for (const word_value& v : bag.words)
          if (v.word == w) expected.insert(i);
      CHECK(found == expected);
    }
  }
  CHECK(index.memory() <= 2 * memory);
}
