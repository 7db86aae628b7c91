// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/bytes.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {
std::uint32_t sum_of(std::string_view text) { return crc32c(std::as_bytes(std::span{text})); }

/// `bytes`, filled up with zeros to a multiple of four, as cmake/default_vocabulary.py writes them.
std::string to_base85(std::string_view bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k != 4; ++k)
      value = value << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    std::string group(5, ' ');
    for (std::size_t k = 5; k-- != 0; value /= 85) group[k] = orbis::detail::base85_character(value % 85);
    text += group;
  }
  return text;
}
}  // namespace

TEST_CASE("the checksum is that of RFC 3720, at every level") {
  const simd::level_limit limit{GENERATE(simd::level::portable, simd::level::popcnt, simd::level::avx512)};
  CHECK(sum_of("") == 0);
  CHECK(sum_of("123456789") == 0xe3069283U);
  CHECK(sum_of(std::string(32, '\0')) == 0x8a9136aaU);
  CHECK(sum_of(std::string(32, '\xff')) == 0x62a8ab43U);
  const auto bytes_of = [](std::string_view text) { return std::as_bytes(std::span{text}); };
  CHECK(crc32c(bytes_of("56789"), crc32c(bytes_of("1234"))) == sum_of("123456789"));
  std::string ascending;
  for (int i = 0; i != 32; ++i) ascending += static_cast<char>(i);
  CHECK(sum_of(ascending) == 0x46dd794eU);
}

TEST_CASE("a checksum goes on behind another, wherever the cut, and levels agree on any length") {
  random_bits random{1};
  std::string bytes;
  for (int length = 0; length != 70; ++length) {
    const auto all = std::as_bytes(std::span{bytes});
    std::uint32_t whole = 0;
    {
      const simd::level_limit limit{simd::level::portable};
      whole = crc32c(all);
    }
    CHECK(crc32c(all) == whole);
    for (std::size_t cut = 0; cut <= bytes.size(); cut += 5)
      CHECK(crc32c(all.subspan(cut), crc32c(all.first(cut))) == whole);
    bytes += static_cast<char>(random());
  }
}

TEST_CASE("bytes come back from text, and the text can stand in a literal") {
  random_bits random{1};
  std::string bytes;
  for (int length = 0; length != 200; ++length) {
    const std::string text = to_base85(bytes);
    CHECK(text.find_first_of("\"\\?\n ") == std::string::npos);
    std::string again = "before";
    REQUIRE(append_base85(again, text));
    CHECK(again.size() == 6 + (bytes.size() + 3) / 4 * 4);
    CHECK(again.substr(6, bytes.size()) == bytes);
    bytes += static_cast<char>(length % 3 == 0 ? 0xff : random());
  }
  for (const char c : to_base85(std::string(400, '\xff'))) CHECK((c > ' ' && c < '\x7f'));
}

TEST_CASE("text that stands for no bytes is refused") {
  std::string bytes;
  CHECK_FALSE(append_base85(bytes, "1234"));
  CHECK_FALSE(append_base85(bytes, "1234\""));
  CHECK_FALSE(append_base85(bytes, "wwwww"));  // more than four bytes hold
  CHECK(append_base85(bytes, "#####"));
}

TEST_CASE("numbers are read in both byte orders") {
  const char bytes[] = {0x01, 0x02, 0x03, '\xFC', 0, 0, 0, 0};
  CHECK(load_number<std::uint16_t>(bytes, std::endian::little) == 0x0201);
  CHECK(load_number<std::uint16_t>(bytes, std::endian::big) == 0x0102);
  CHECK(load_number<std::uint32_t>(bytes, std::endian::big) == 0x010203FC);
}

TEST_CASE("what is appended is read back") {
  std::string to;
  append_little_endian(to, std::uint32_t{0x01020304});
  append_little_endian(to, 2.5);
  CHECK(to.size() == 12);
  CHECK(to.substr(0, 4) == std::string("\4\3\2\1"));
  CHECK(load_number<double>(to.data() + 4) == 2.5);
}
