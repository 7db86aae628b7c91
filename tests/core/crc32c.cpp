// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/crc32c.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {
std::uint32_t sum_of(std::string_view text, simd::level level) {
  return crc32c(std::as_bytes(std::span{text}), 0, level);
}
}  // namespace

TEST_CASE("the checksum is that of RFC 3720, at every level") {
  const auto level = GENERATE(simd::level::portable, simd::level::popcnt, simd::level::avx512);
  CHECK(sum_of("", level) == 0);
  CHECK(sum_of("123456789", level) == 0xe3069283U);
  CHECK(sum_of(std::string(32, '\0'), level) == 0x8a9136aaU);
  CHECK(sum_of(std::string(32, '\xff'), level) == 0x62a8ab43U);
  const auto bytes_of = [](std::string_view text) { return std::as_bytes(std::span{text}); };
  CHECK(crc32c(bytes_of("56789"), crc32c(bytes_of("1234"), 0, level), level) == sum_of("123456789", level));
  std::string ascending;
  for (int i = 0; i != 32; ++i) ascending += static_cast<char>(i);
  CHECK(sum_of(ascending, level) == 0x46dd794eU);
}

TEST_CASE("a checksum goes on behind another, wherever the cut, and levels agree on any length") {
  random_bits random{1};
  std::string bytes;
  for (int length = 0; length != 70; ++length) {
    const auto all = std::as_bytes(std::span{bytes});
    const std::uint32_t whole = crc32c(all, 0, simd::level::portable);
    CHECK(crc32c(all) == whole);
    for (std::size_t cut = 0; cut <= bytes.size(); cut += 5)
      CHECK(crc32c(all.subspan(cut), crc32c(all.first(cut))) == whole);
    bytes += static_cast<char>(random());
  }
}
