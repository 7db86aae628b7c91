// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/extract/byte_pairs.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features::detail;

using bytes = simd::vec<std::uint8_t, 16, simd::portable>;
using words = simd::vec<std::uint16_t, 8, simd::portable>;

TEST_CASE("bytes are taken apart into words and put together again") {
  random_bits random{1};
  std::array<std::uint8_t, 16> from{}, to{};
  for (auto& byte : from) byte = static_cast<std::uint8_t>(random());
  const auto even = even_bytes(bytes::load(from.data())), odd = odd_bytes(bytes::load(from.data()));
  for (std::size_t i = 0; i != 8; ++i) CHECK((even[i] == from[2 * i] && odd[i] == from[2 * i + 1]));
  interleaved(even, odd).store(to.data());
  CHECK(to == from);
}

TEST_CASE("a sum of words in two bytes is rounded as a whole") {
  for (std::uint32_t sum = 0; sum < 65407U << 8U; sum += 977) {
    const words high(static_cast<std::uint16_t>(sum >> 8U)), low(static_cast<std::uint16_t>(sum & 255U));
    CHECK(rounded_high_byte(high, low)[3] == (sum + (1U << 15U)) >> 16U);
  }
}
