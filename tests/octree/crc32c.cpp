// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include <orbis/octree/crc32c.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;

TEST_CASE("Checksums are those of the standard") {
  // RFC 3720, appendix B.4, and the common check value.
  CHECK(crc32c("123456789") == 0xe3069283U);
  CHECK(crc32c(std::string(32, '\0')) == 0x8a9136aaU);
  CHECK(crc32c(std::string(32, '\xff')) == 0x62a8ab43U);
  CHECK(crc32c("56789", crc32c("1234")) == crc32c("123456789"));
}
