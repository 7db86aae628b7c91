// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("A paged array and its copies hold what vectors would hold") {
  random_bits random{9};
  std::vector<std::pair<cow_pages<int>, std::vector<int>>> arrays(1);
  for (int i = 0; i != 20000; ++i) {
    auto& [array, reference] = arrays[random.below(static_cast<std::uint32_t>(arrays.size()))];
    const auto value = static_cast<int>(random.below(1000));
    switch (random.below(array.empty() ? 1U : 8U)) {
      default:
        array.push_back(value);
        reference.push_back(value);
        break;
      case 5:
      case 6: {
        const std::uint32_t at = random.below(static_cast<std::uint32_t>(reference.size()));
        array.writable(at) = value;
        reference[at] = value;
        break;
      }
      case 7:
        if (arrays.size() < 5 && random.below(50) == 0) {
          arrays.push_back({array, reference});
        } else if (random.below(500) == 0) {
          array.resize(reference.size() / 2);
          reference.resize(reference.size() / 2);
        }
        break;
    }
  }
  CHECK(arrays.size() == 5);
  for (const auto& [array, reference] : arrays) {
    REQUIRE(array.size() == reference.size());
    for (std::size_t i = 0; i != reference.size(); ++i) REQUIRE(array[i] == reference[i]);
  }
}

TEST_CASE("A moved-from array is empty and an assigned one holds its source") {
  cow_pages<int> a;
  for (int i = 0; i != 5000; ++i) a.push_back(i);
  cow_pages<int> b = std::move(a);
  CHECK(a.empty());  // NOLINT(bugprone-use-after-move): that is what is promised
  a = b;
  b.writable(4000) = -1;
  CHECK(a[4000] == 4000);
  CHECK(b[4000] == -1);
  b.clear();
  CHECK(b.memory_bytes() == 0);
  CHECK(a[4999] == 4999);
}

TEST_CASE("Readers on other threads keep their copy while the writer writes") {
  cow_pages<std::uint64_t> array;
  for (std::uint64_t i = 0; i != 20000; ++i) array.push_back(0);
  std::vector<std::jthread> readers;
  std::atomic<int> torn{0};
  for (std::uint64_t round = 1; round != 40; ++round) {
    for (std::size_t i = 0; i < array.size(); i += 3) array.writable(i) = round;
    readers.emplace_back([copy = array, round, &torn] {
      for (std::size_t i = 0; i < copy.size(); i += 3) torn += copy[i] == round ? 0 : 1;
    });
  }
  readers.clear();
  CHECK(torn == 0);
}
