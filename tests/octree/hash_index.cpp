// SPDX-License-Identifier: BSD-3-Clause
#include <unordered_map>

#include <orbis/core/random.hpp>
#include <orbis/octree/hash_index.hpp>

#include "support/catch.hpp"

using orbis::octree::hash_index;

TEST_CASE("A hash index remembers what a standard map remembers") {
  orbis::random_bits random{11};
  hash_index index;
  std::unordered_map<std::uint64_t, std::uint32_t> reference;
  CHECK(index.find(5) == hash_index::none);
  for (int i = 0; i != 50000; ++i) {
    const std::uint64_t name = random.below(20000) * 4096ULL;  // all low bits alike
    const std::uint32_t position = random.below(1000) == 0 ? hash_index::none : random.below(1000000);
    index.set(name, position);
    reference[name] = position;
  }
  for (std::uint64_t i = 0; i != 20000; ++i) {
    const auto it = reference.find(i * 4096);
    REQUIRE(index.find(i * 4096) == (it == reference.end() ? hash_index::none : it->second));
  }
  const std::size_t bytes = index.memory_bytes();
  index.clear();
  CHECK(index.find(4096) == hash_index::none);
  CHECK(index.memory_bytes() == bytes);
}
