// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>

#include <orbis/octree/detail/storage/octant_record.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>

#include "support/catch.hpp"

using namespace orbis::octree::detail;

TEST_CASE("Records of every pool keep what is written, places that are free are used again") {
  octant_pools<float> pools;
  std::array<std::uint32_t, octant_pools<float>::plain + 1> record{};
  for (unsigned number = 0; number != record.size(); ++number) {
    record[number] = pools.add(number);
    CHECK(octant_pools<float>::pool_number(record[number]) == number);
    pools.write(record[number], [&](auto& r) { r.known = 100 + number; });
  }
  for (unsigned number = 0; number != record.size(); ++number)
    CHECK(pools.read(record[number], [](const auto& r) { return r.known; }) == 100 + number);
  pools.erase(record[3]);
  const std::uint32_t other = pools.add(2);
  CHECK(other != record[2]);
  CHECK(pools.add(3) == record[3]);
}

TEST_CASE("A copy of pools keeps its records while the original writes") {
  octant_pools<float> pools;
  const std::uint32_t record = pools.add(1);
  pools.write(record, [](auto& r) { r.known = 1; });
  const octant_pools<float> copy = pools;
  pools.write(record, [](auto& r) { r.known = 2; });
  CHECK(copy.read(record, [](const auto& r) { return r.known; }) == 1);
  CHECK(pools.read(record, [](const auto& r) { return r.known; }) == 2);
}
