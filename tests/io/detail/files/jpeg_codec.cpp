// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <string>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/jpeg.hpp>

#include "io/no_memory.hpp"
#include "support/catch.hpp"

TEST_CASE("a lack of memory ends the encoding of a JPEG, anywhere, with that as its error and nothing left behind") {
  if (!orbis::test::no_memory_after::works()) {
    WARN("skipped: this build's operator new cannot be replaced");
    return;
  }
  orbis::random_bits random{3};
  orbis::image<orbis::rgb8> noise(300, 200);
  for (auto& p : noise.pixels())
    p = {static_cast<std::uint8_t>(random.below(256)), static_cast<std::uint8_t>(random.below(256)), 0};
  const std::string whole = orbis::io::encode_jpeg(noise, 95).value();
  REQUIRE(whole.size() > 65536);  // room for it is made several times
  const auto encode = [&](std::size_t allocations) {
    const orbis::test::no_memory_after limit{allocations};
    return orbis::io::encode_jpeg(noise, 95);
  };
  std::size_t refused = 0;
  for (;; ++refused) {
    REQUIRE(refused < 100);
    const auto bytes = encode(refused);
    if (bytes) {
      CHECK(*bytes == whole);
      break;
    }
    REQUIRE(bytes.error().code == orbis::errc::exception);
    REQUIRE(bytes.error().message == "out of memory");
  }
  CHECK(refused > 2);
}
