// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/change_log.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

using masks = std::map<std::uint64_t, std::uint64_t>;  // by the octant's Morton code

masks since(const change_log& log, std::uint64_t revision) {
  masks all;
  log.for_each_since(revision, [&](const voxel_key& octant, std::uint64_t mask) {
    const std::uint64_t code = morton_code(octant);
    REQUIRE(code % 64 == 0);
    REQUIRE(mask != 0);
    REQUIRE((all.empty() || all.rbegin()->first < code / 64));  // sorted, each once
    all.emplace(code / 64, mask);
  });
  return all;
}

/// When each voxel changed last.
struct reference {
  std::map<std::uint64_t, std::uint64_t> last;

  void record(const voxel_key& k, std::uint64_t mask, std::uint64_t revision) {
    for (; mask != 0; mask &= mask - 1)
      last[(morton_code(k) / 64) * 64 + static_cast<std::uint64_t>(std::countr_zero(mask))] = revision;
  }
  [[nodiscard]] masks since(std::uint64_t revision) const {
    masks all;
    for (const auto& [voxel, changed] : last)
      if (changed > revision) all[voxel / 64] |= std::uint64_t{1} << (voxel % 64);
    return all;
  }
};

struct change {
  voxel_key key;
  std::uint64_t mask;
};
change random_change(random_bits& random, std::uint32_t extent) {
  const std::uint64_t sparse = random() & random() & random();
  return {{random.below(extent), random.below(extent), random.below(extent)}, random.below(50) == 0 ? 0 : sparse};
}

}  // namespace

TEST_CASE("A change log knows what changed after every revision") {
  random_bits random{21};
  for (const std::uint32_t extent : {8U, 40U, 1U << 21U}) {
    change_log log;
    reference expected;
    CHECK(log.revision() == 0);
    CHECK(since(log, 0).empty());
    for (std::uint64_t revision = 1; revision != 40; ++revision) {
      REQUIRE(log.begin_revision() == revision);
      REQUIRE(log.revision() == revision);
      if (random.below(5) == 0) continue;  // nothing changes
      for (std::uint32_t i = random.below(60); i != 0; --i) {
        const auto [key, mask] = random_change(random, extent);
        log.record(key, mask);
        expected.record(key, mask, revision);
      }
      const change_log copy = log;
      for (std::uint64_t r = 0; r <= revision; ++r) REQUIRE(since(copy, r) == expected.since(r));
    }
    CHECK(log.exact_since() == 0);
    CHECK(log.complete_since() == 0);
  }
}

TEST_CASE("A full change log stays exact for young revisions and tells too much of old ones but never too little") {
  random_bits random{22};
  for (const std::size_t capacity : {std::size_t{0}, std::size_t{1}, std::size_t{30}, std::size_t{200}}) {
    change_log log;
    log.set_capacity(capacity);
    CHECK(log.capacity() == capacity);
    reference expected;
    bool merged = false;
    for (std::uint64_t revision = 1; revision != 60; ++revision) {
      log.begin_revision();
      for (std::uint32_t i = random.below(40); i != 0; --i) {
        const auto [key, mask] = random_change(random, 20);
        log.record(key, mask);
        expected.record(key, mask, revision);
      }
      REQUIRE(log.exact_since() < revision);  // the newest revision is never merged
      REQUIRE(log.complete_since() == 0);
      const masks ever = expected.since(0);
      REQUIRE(since(log, 0) == ever);
      for (std::uint64_t r = 0; r <= revision; ++r) {
        const masks told = since(log, r), truth = expected.since(r);
        if (r >= log.exact_since()) REQUIRE(told == truth);
        REQUIRE(told.size() == truth.size());  // no octant too many, whatever the voxels
        for (const auto& [octant, mask] : truth) REQUIRE((told.at(octant) & mask) == mask);
        for (const auto& [octant, mask] : told) REQUIRE((ever.at(octant) & mask) == mask);
      }
      merged |= log.exact_since() != 0;
    }
    REQUIRE(merged);
  }
}

TEST_CASE("The memory of a change log is bounded by its capacity and the octants that changed") {
  random_bits random{23};
  change_log log;
  log.set_capacity(1000);
  std::size_t early = 0;
  for (int revision = 1; revision != 3000; ++revision) {
    log.begin_revision();
    for (int i = 0; i != 200; ++i)
      log.record({random.below(40), random.below(40), random.below(40)}, 1 + random.below(1000));
    if (revision == 200) early = log.memory_bytes();
  }
  CHECK(log.memory_bytes() <= early);
  CHECK(log.revision() - log.exact_since() >= 2);
  // One revision that goes on for ever: a thousand octants, again and again.
  const std::uint64_t before = log.begin_revision() - 1;
  for (int i = 0; i != 300000; ++i) log.record({random.below(40), random.below(40), random.below(40)}, 1);
  CHECK(log.memory_bytes() < 2 * early + 100000);
  CHECK(since(log, before).size() == 1000);
  CHECK(log.exact_since() <= before);
}

TEST_CASE("What is forgotten need not be asked about and the rest stays right") {
  random_bits random{24};
  for (const std::size_t capacity : {std::size_t{100}, std::size_t{100000}}) {
    change_log log;
    log.set_capacity(capacity);
    reference expected;
    for (std::uint64_t revision = 1; revision != 80; ++revision) {
      log.begin_revision();
      for (std::uint32_t i = random.below(30); i != 0; --i) {
        const auto [key, mask] = random_change(random, 16);
        log.record(key, mask);
        expected.record(key, mask, revision);
      }
      if (random.below(4) == 0) {
        const std::uint64_t floor = random.below(static_cast<std::uint32_t>(revision) + 1);
        const std::uint64_t had = log.complete_since();
        log.forget_before(floor);
        REQUIRE(log.complete_since() == std::max(had, floor));
      }
      REQUIRE(log.exact_since() >= log.complete_since());
      for (std::uint64_t r = log.complete_since(); r <= revision; ++r) {
        const masks told = since(log, r), truth = expected.since(r);
        if (r >= log.exact_since()) REQUIRE(told == truth);
        for (const auto& [octant, mask] : truth) REQUIRE((told.at(octant) & mask) == mask);
      }
    }
    log.forget_before(1000);
    CHECK(log.complete_since() == log.revision());
    CHECK(since(log, log.revision()).empty());
    log.begin_revision();
    log.record({1, 2, 3}, 5);
    CHECK(since(log, log.revision() - 1) == masks{{0, 5}});
  }
}

TEST_CASE("A cleared change log goes on counting and has nothing to tell") {
  change_log log;
  log.set_capacity(10);
  for (std::uint32_t i = 0; i != 50; ++i) {
    log.begin_revision();
    log.record({4 * i, 0, 0}, 1);
  }
  log.clear();
  CHECK(log.revision() == 50);
  CHECK(log.complete_since() == 50);
  CHECK(log.capacity() == 10);
  CHECK(log.memory_bytes() == 0);
  log.begin_revision();
  log.record({8, 4, 0}, 2);
  log.record({9, 5, 1}, 4);  // the same octant
  CHECK(since(log, 50) == masks{{morton_code({8, 4, 0}) / 64, 6}});

  change_log moved = std::move(log);
  log = change_log{};
  CHECK(log.revision() == 0);
  CHECK(since(moved, 50) == masks{{morton_code({8, 4, 0}) / 64, 6}});
}

TEST_CASE("A stopped change log answers nobody until it is cleared") {
  change_log log;
  log.stop();
  CHECK(log.complete_since() == 0);  // it never had a revision
  log.begin_revision();
  log.record({4, 0, 0}, 1);
  for (int again = 0; again != 2; ++again) {
    log.stop();
    CHECK(log.revision() == 1);
    CHECK(log.complete_since() > log.revision());
    CHECK(log.memory_bytes() == 0);
  }
  log.forget_before(7);
  CHECK(log.complete_since() > log.revision());
  log.begin_revision();
  log.clear();
  CHECK(log.complete_since() == 2);
  CHECK(since(log, 2).empty());
}
