// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <string>

#include <orbis/core/bytes.hpp>
#include <orbis/io/detail/scalar_type.hpp>

#include "support/catch.hpp"

namespace io = orbis::io;

TEST_CASE("numbers are read in both byte orders") {
  const char bytes[] = {0x01, 0x02, 0x03, '\xFC', 0, 0, 0, 0};
  CHECK(orbis::load_number<std::uint16_t>(bytes, std::endian::little) == 0x0201);
  CHECK(orbis::load_number<std::uint16_t>(bytes, std::endian::big) == 0x0102);
  CHECK(orbis::load_number<std::uint32_t>(bytes, std::endian::big) == 0x010203FC);
  CHECK(io::load_as_double(bytes + 3, io::scalar_type::int8, std::endian::little) == -4.0);
  CHECK(io::load_as_double(bytes + 3, io::scalar_type::uint8, std::endian::little) == 252.0);
  const char one[] = {0x3F, '\x80', 0, 0};
  CHECK(io::load_as_double(one, io::scalar_type::float32, std::endian::big) == 1.0);
}

TEST_CASE("what is appended is read back") {
  std::string to;
  orbis::append_little_endian(to, std::uint32_t{0x01020304});
  orbis::append_little_endian(to, 2.5);
  CHECK(to.size() == 12);
  CHECK(to.substr(0, 4) == std::string("\4\3\2\1"));
  CHECK(orbis::load_number<double>(to.data() + 4) == 2.5);
}
