// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cstdint>
#include <string>

#include <orbis/core/bits.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/detail/scalar_type.hpp>

#include "support/catch.hpp"

static_assert(orbis::count_ones(0) == 0 && orbis::count_ones(~std::uint64_t{0}) == 64);

TEST_CASE("Ones are counted as the standard library counts them") {
  orbis::random_bits random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t x = random() & random();
    CHECK(orbis::count_ones(x) == static_cast<std::uint32_t>(std::popcount(x)));
  }
}

namespace io = orbis::io;

TEST_CASE("numbers are read in both byte orders") {
  const char bytes[] = {0x01, 0x02, 0x03, '\xFC', 0, 0, 0, 0};
  CHECK(orbis::load_number<std::uint16_t>(bytes, std::endian::little) == 0x0201);
  CHECK(orbis::load_number<std::uint16_t>(bytes, std::endian::big) == 0x0102);
  CHECK(orbis::load_number<std::uint32_t>(bytes, std::endian::big) == 0x010203FC);
  CHECK(io::detail::load_as_double(bytes + 3, io::detail::scalar_type::int8, std::endian::little) == -4.0);
  CHECK(io::detail::load_as_double(bytes + 3, io::detail::scalar_type::uint8, std::endian::little) == 252.0);
  const char one[] = {0x3F, '\x80', 0, 0};
  CHECK(io::detail::load_as_double(one, io::detail::scalar_type::float32, std::endian::big) == 1.0);
}

TEST_CASE("what is appended is read back") {
  std::string to;
  orbis::append_little_endian(to, std::uint32_t{0x01020304});
  orbis::append_little_endian(to, 2.5);
  CHECK(to.size() == 12);
  CHECK(to.substr(0, 4) == std::string("\4\3\2\1"));
  CHECK(orbis::load_number<double>(to.data() + 4) == 2.5);
}
