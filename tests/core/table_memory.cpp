// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>
#include <utility>

#include <orbis/core/table_memory.hpp>

#include "support/catch.hpp"

using orbis::table_memory;

TEST_CASE("tables begin at a cache line, large ones at a huge page") {
  using entry = std::array<std::uint64_t, 3>;
  const auto address = [](const table_memory<entry>& t) { return reinterpret_cast<std::uintptr_t>(t.values().data()); };
  const table_memory<entry> small(5), large((std::size_t{4} << 20U) / sizeof(entry) + 1);
  CHECK(small.values().size() == 5);
  CHECK(address(small) % 64 == 0);
  CHECK(address(large) % (std::size_t{1} << 21U) == 0);
}

TEST_CASE("a table keeps its values when it is moved, and an empty one has none") {
  table_memory<int> table(1000);
  for (int i = 0; i != 1000; ++i) table.values()[static_cast<std::size_t>(i)] = i;
  const int* const before = table.values().data();
  const table_memory<int> moved = std::move(table);
  CHECK(moved.values().data() == before);
  CHECK(table.values().empty());  // NOLINT: what is left of it
  CHECK((moved.values()[0] == 0 && moved.values()[999] == 999));
  CHECK(table_memory<int>{}.values().empty());
  CHECK(table_memory<int>{0}.values().empty());
}
