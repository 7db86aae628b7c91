// SPDX-License-Identifier: BSD-3-Clause
#include <unordered_map>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::hash_index;

TEST_CASE("A hash index remembers and forgets what a standard map does") {
  orbis::random_bits random{11};
  for (const std::uint32_t names : {20U, 300U, 5000U}) {
    hash_index index;
    std::unordered_map<std::uint64_t, std::uint32_t> reference;
    index.erase(5);
    CHECK(index.find(5) == hash_index::none);
    for (int i = 0; i != 60000; ++i) {
      const std::uint64_t code = random.below(names) * 0x100000001000ULL;  // all low bits alike
      if (random.below(2) == 0) {
        index.erase(code);
        reference.erase(code);
      } else {
        const std::uint32_t position = random.below(1000000);
        index.set(code, position);
        reference[code] = position;
      }
      const std::uint64_t asked = random.below(names) * 0x100000001000ULL;
      const auto it = reference.find(asked);
      REQUIRE(index.find(asked) == (it == reference.end() ? hash_index::none : it->second));
      REQUIRE(index.size() == reference.size());
    }
    for (std::uint64_t i = 0; i != names; ++i) {
      const auto it = reference.find(i * 0x100000001000ULL);
      REQUIRE(index.find(i * 0x100000001000ULL) == (it == reference.end() ? hash_index::none : it->second));
    }
  }
}

TEST_CASE("A window of names that rolls on for ever needs no more memory than its widest moment") {
  hash_index index;
  for (std::uint64_t i = 0; i != 1000; ++i) index.set(i, 1);
  const std::size_t bytes = index.memory_bytes();
  for (std::uint64_t i = 1000; i != 200000; ++i) {
    index.erase(i - 1000);
    index.set(i, static_cast<std::uint32_t>(i));
  }
  CHECK(index.size() == 1000);
  CHECK(index.memory_bytes() == bytes);
  CHECK(index.find(199000) == 199000);
  CHECK(index.find(198999) == hash_index::none);
  const hash_index copy = index;
  const hash_index moved = std::move(index);
  CHECK(moved.find(199000) == 199000);
  CHECK(copy.size() == 1000);
  index = copy;
  index.clear();
  CHECK(index.empty());
  CHECK(index.find(199000) == hash_index::none);
  CHECK(index.memory_bytes() == bytes);
}

TEST_CASE("numbers are found by keys that are kept elsewhere, also after others were erased") {
  struct hash {
    std::uint64_t operator()(std::uint32_t key) const { return orbis::mix64(key & 7U); }  // many alike
  };
  orbis::number_index<std::uint32_t, hash> index;
  std::vector<std::uint32_t> keys;
  const auto key_of = [&](std::uint32_t number) -> const std::uint32_t& { return keys[number]; };
  CHECK(index.find(3, key_of) == index.none);
  for (std::uint32_t i = 0; i != 300; ++i) {
    CHECK(index.find_or_insert(2 * i, i, key_of) == i);
    keys.push_back(2 * i);
  }
  for (std::uint32_t i = 0; i != 300; ++i) {
    CHECK(index.find_or_insert(2 * i, 1000, key_of) == i);
    CHECK(index.find(2 * i + 1, key_of) == index.none);
  }
  CHECK(index.size() == 300);
  const std::size_t bytes = index.memory_bytes();
  for (std::uint32_t i = 0; i != 300; i += 3) index.erase(2 * i, key_of);
  index.erase(1, key_of);  // it is not there
  CHECK(index.size() == 200);
  for (std::uint32_t i = 0; i != 300; ++i) CHECK(index.find(2 * i, key_of) == (i % 3 == 0 ? index.none : i));
  for (std::uint32_t i = 0; i != 300; ++i)
    if (i % 3 != 0 && i > 5) index.erase(2 * i, key_of);
  CHECK(index.size() == 4);
  CHECK(index.memory_bytes() < bytes);
  CHECK(index.find(2 * 5, key_of) == 5);
}
