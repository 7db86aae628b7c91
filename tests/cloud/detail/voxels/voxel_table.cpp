// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_table.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::cloud::detail::mixed_key;
using orbis::cloud::detail::voxel_key;
using orbis::cloud::detail::voxel_table;

namespace {

struct count {
  std::uint32_t n;
};

/// Takes keys into a table as `key(i)` gives them, for i below `n`, and looks at its rows.
template <class Key>
void fill(voxel_table<count>& table, std::uint32_t n, const Key& key) {
  struct expected {
    voxel_key key;
    std::uint32_t first, n;
  };
  std::map<voxel_key, std::size_t> row_of;
  std::vector<expected> rows;
  for (std::uint32_t i = 0; i != n; ++i) {
    const voxel_key k = key(i);
    const auto [at, is_new] = row_of.try_emplace(k, rows.size());
    if (is_new) rows.push_back({k, i, 7});
    std::uint32_t& times = rows[at->second].n;
    table.reserve_more(1, 6'000);
    table.update(k, mixed_key(k), i, [&](count& c) { REQUIRE(c.n++ == times); });
    ++times;
    REQUIRE(table.rows().size() == rows.size());
  }
  for (std::size_t r = 0; r != rows.size(); ++r) {
    REQUIRE(table.rows()[r].key == rows[r].key);
    REQUIRE(table.rows()[r].first == rows[r].first);
    REQUIRE(table.rows()[r].record.n == rows[r].n);
  }
}

}  // namespace

TEST_CASE("a table of voxels keeps the rows in the order in which they came") {
  voxel_table<count> table{{7}};
  orbis::random_bits random{1};
  for (const std::size_t expected : {100U, 5'000U, 0U}) {  // a table that was cleared is as a new one
    fill(table, 5'000, [&](std::uint32_t) {
      return voxel_key{static_cast<std::int32_t>(random.below(10)) - 5,
                       static_cast<std::int32_t>(random.below(10)) * 200'000'000 - 1'000'000'000,
                       static_cast<std::int32_t>(random.below(10))};
    });
    table.clear(expected);
    REQUIRE(table.rows().empty());
  }
}

TEST_CASE("a table of voxels that is asked to expect large blocks is the same") {
  voxel_table<count> table{{7}};
  table.clear(40'000);  // large enough that it fetches rows before they are needed
  std::vector<std::uint32_t> hashes;
  for (std::int32_t i = 0; i != 256; ++i) hashes.push_back(mixed_key({i, -i, 3}));
  table.expect(hashes);
  fill(table, 512, [](std::uint32_t i) {
    const auto k = static_cast<std::int32_t>(i % 256);
    return voxel_key{k, -k, 3};
  });
  table.expect(hashes);
}

TEST_CASE("a table that grows keeps all rows, even if their keys come in the order of their hashes") {
  std::vector<voxel_key> keys;
  for (std::int32_t i = 0; i != 200'000; ++i) keys.push_back({i % 100, i / 100 % 100, i / 10'000});
  std::sort(keys.begin(), keys.end(),
            [](const voxel_key& a, const voxel_key& b) { return mixed_key(a) < mixed_key(b); });
  voxel_table<count> table{{0}};
  for (const voxel_key& k : keys) {  // were the rows to lie side by side, it would take twenty times as long
    table.reserve_more(1, keys.size());
    table.update(k, mixed_key(k), 0, [](count& c) { ++c.n; });
  }
  CHECK(table.rows().size() == keys.size());
}

TEST_CASE("voxels have hashes of their own, close together and far apart") {
  for (const std::int32_t apart : {1, 2, 8, 1000, 1 << 16, 1 << 20, 1 << 24, 1 << 27}) {
    std::map<std::uint32_t, int> slots;
    int most = 0;
    for (std::int32_t x = -8; x != 8; ++x)
      for (std::int32_t y = -8; y != 8; ++y)
        for (std::int32_t z = -8; z != 8; ++z)
          ++slots[mixed_key({x * apart, y * apart, z * apart}) >> 19U];  // 4096 keys, 8192 slots
    for (const auto& [slot, keys] : slots) most = std::max(most, keys);
    INFO(apart);
    CHECK(slots.size() > 2800);  // of 3223 for random ones
    CHECK(most < 12);
  }
}
