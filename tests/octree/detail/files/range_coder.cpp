// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/files/range_coder.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

[[nodiscard]] std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span{text}); }

}  // namespace

TEST_CASE("Bits come back from the range coder whatever was expected") {
  random_bits random{71};
  for (const std::uint32_t chance : {1U, 32U, 3000U, 32768U, 65000U, 65504U, 65535U}) {
    std::vector<bool> bits;
    range_encoder encoder;
    for (int i = 0; i != 5000; ++i) {
      bits.push_back(random.below(65536) < chance || (i > 2000 && i < 2500));  // a stretch of surprises
      encoder.code(bits.back(), chance);
    }
    const std::string coded = encoder.finish();
    range_decoder decoder{bytes_of(coded)};
    bool same = true;
    for (const bool bit : bits) same &= decoder.code(false, chance) == bit;
    CHECK(same);
  }
  // What is expected takes no room.
  range_encoder encoder;
  bit_expectation expectation;
  for (int i = 0; i != 100000; ++i) {
    encoder.code(true, expectation.set());
    expectation.learn(true);
  }
  CHECK(encoder.finish().size() < 40);
}

TEST_CASE("Unequal bits take little more than their entropy") {
  random_bits random{82};
  for (const double chance : {0.5, 0.2, 0.03}) {
    range_encoder encoder;
    bit_expectation expectation;
    constexpr int count = 50000;
    for (int i = 0; i != count; ++i) {
      const bool bit = random.uniform(0.0, 1.0) < chance;
      encoder.code(bit, expectation.set());
      expectation.learn(bit);
    }
    const double entropy = -chance * std::log2(chance) - (1.0 - chance) * std::log2(1.0 - chance);
    const auto bits = static_cast<double>(8 * encoder.finish().size());
    CHECK(bits > 0.97 * entropy * count);
    CHECK(bits < 1.03 * entropy * count + 100);
  }
}

TEST_CASE("A decoder reads zeros behind the end") {
  range_decoder decoder{{}};
  for (int i = 0; i != 100; ++i) (void)decoder.code(false, 40000);
  CHECK(decoder.code(false, 1));  // zeros are always in the lower part
}
