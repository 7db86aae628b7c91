// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/features/detail/extract/lanes16.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features::detail;

TEST_CASE("sixteen bytes at a time are what each of them is") {
  random_bits random{1};
  for (int round = 0; round != 200; ++round) {
    std::array<std::uint8_t, 16> a{}, b{}, result{};
    for (std::uint8_t& byte : a) byte = static_cast<std::uint8_t>(random());
    for (std::uint8_t& byte : b) byte = static_cast<std::uint8_t>(random());
    const bytes16 va = load16(a.data()), vb = load16(b.data());
    const std::uint32_t bits = bits16(va);
    for (std::size_t i = 0; i != 16; ++i) CHECK(((bits >> i) & 1U) == (a[i] & 1U));
    CHECK(bits >> 16U == 0);
    store16(result.data(), min16(va, vb));
    for (std::size_t i = 0; i != 16; ++i) CHECK(result[i] == std::min(a[i], b[i]));
    store16(result.data(), max16(va, vb));
    for (std::size_t i = 0; i != 16; ++i) CHECK(result[i] == std::max(a[i], b[i]));
    store16(result.data(), joined(low_bytes(va), high_bytes(va)));
    CHECK(result == a);
    CHECK(any16(va));
  }
  CHECK_FALSE(any16(bytes16{}));
}

TEST_CASE("a sum of words in two bytes is rounded as a whole") {
  for (std::uint32_t sum = 0; sum < 65407U << 8U; sum += 977) {
    words8 high{}, low{};
    high += static_cast<std::uint16_t>(sum >> 8U), low += static_cast<std::uint16_t>(sum & 255U);
    CHECK(rounded_high(high, low)[3] == (sum + (1U << 15U)) >> 16U);
  }
}

TEST_CASE("four products are rounded like one, before they are added") {
  random_bits random{2};
  for (int round = 0; round != 1000; ++round) {
    std::array<float, 4> a{}, b{}, c{}, sum{};
    for (std::size_t i = 0; i != 4; ++i) {
      a[i] = static_cast<float>(random.uniform(-20.0, 20.0));
      b[i] = static_cast<float>(random.uniform(-1.0, 1.0));
      c[i] = static_cast<float>(random.uniform(-20.0, 20.0));
    }
    const auto va = loaded<floats4>(a.data()), vb = loaded<floats4>(b.data()), vc = loaded<floats4>(c.data());
    store(sum.data(), rounded_products(va, vb) + vc);
    for (std::size_t i = 0; i != 4; ++i) CHECK(sum[i] == rounded_product(a[i], b[i]) + c[i]);
  }
}
