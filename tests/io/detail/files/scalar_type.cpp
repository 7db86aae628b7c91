// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include <orbis/io/detail/files/scalar_type.hpp>

#include "support/catch.hpp"

using namespace orbis::io::detail;
using orbis::io::scalar_type;

TEST_CASE("numbers of the types that files name are read in both byte orders") {
  const char bytes[] = {'\xFC', 0, 0, 0};
  CHECK(load_as_double(bytes, scalar_type::int8, std::endian::little) == -4.0);
  CHECK(load_as_double(bytes, scalar_type::uint8, std::endian::little) == 252.0);
  const char one[] = {0x3F, '\x80', 0, 0};
  CHECK(load_as_double(one, scalar_type::float32, std::endian::big) == 1.0);
}
