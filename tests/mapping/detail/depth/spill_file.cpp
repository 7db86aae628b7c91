// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <unistd.h>

#include <orbis/core/random.hpp>
#include <orbis/mapping/detail/depth/spill_file.hpp>

#include "support/catch.hpp"

namespace {

using orbis::errc;
using orbis::mapping::detail::free_ranges;
using orbis::mapping::detail::spill_file;

std::filesystem::path unused_name() {
  return std::filesystem::temp_directory_path() / ("orbis_spill_" + std::to_string(::getpid()));
}

TEST_CASE("ranges of a file do not overlap, and are used again") {
  orbis::random_bits random{1};
  free_ranges ranges;
  std::map<std::uint64_t, std::uint64_t> used;
  std::uint64_t bytes = 0, most = 0;
  for (int step = 0; step != 5000; ++step) {
    if (!used.empty() && random.below(used.size() > 20 ? 2 : 3) == 0) {
      auto at = used.begin();
      std::advance(at, random.below(static_cast<std::uint32_t>(used.size())));
      ranges.give(at->first, at->second);
      bytes -= at->second;
      used.erase(at);
    } else if (used.size() < 40) {
      const std::uint64_t size = 1 + random.below(100), start = ranges.take(size);
      const auto next = used.lower_bound(start);
      REQUIRE((next == used.end() || start + size <= next->first));
      REQUIRE((next == used.begin() || std::prev(next)->first + std::prev(next)->second <= start));
      used.emplace(start, size);
      bytes += size;
      most = std::max(most, bytes);
    }
    if (!used.empty()) REQUIRE(ranges.end() >= used.rbegin()->first + used.rbegin()->second);
  }
  CHECK(ranges.end() < 3 * most);
  for (const auto& [start, size] : used) ranges.give(start, size);
  CHECK(ranges.end() == 0);
}

TEST_CASE("records come back from the file, and other bytes in their place do not") {
  spill_file file{unused_name()};
  const std::vector<std::byte> a(1000, std::byte{1}), b(500, std::byte{2}), none;
  const auto at_a = file.write(a).value(), at_b = file.write(b).value(), at_none = file.write(none).value();
  CHECK_FALSE(std::filesystem::exists(unused_name()));
  CHECK(file.read(at_a).value() == a);
  CHECK(file.read(at_b).value() == b);
  CHECK(file.read(at_none).value() == none);

  file.erase(at_a);
  const std::vector<std::byte> c(1000, std::byte{3});
  const auto at_c = file.write(c).value();
  CHECK(at_c.start == at_a.start);
  const auto gone = file.read(at_a);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().code == errc::malformed);
  file.erase(at_c);
  file.erase(at_b);
  const auto beyond = file.read(at_b);
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().code == errc::malformed);
  CHECK(beyond.error().where == unused_name().string());
}

}  // namespace
