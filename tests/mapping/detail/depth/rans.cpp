// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/mapping/detail/depth/rans.hpp>

#include "support/catch.hpp"

namespace {

using namespace orbis::mapping::detail;

TEST_CASE("counts are scaled to the same sum, and none that was there is lost") {
  orbis::random_bits random{3};
  for (int trial = 0; trial != 300; ++trial) {
    std::vector<std::uint32_t> counts(1 + random.below(60));
    for (auto& c : counts) c = random.below(3) == 0 ? 0 : 1 + random.below(1U << random.below(30));
    const std::vector<std::uint32_t> before = counts;
    normalize_counts(counts);
    const bool any = std::accumulate(before.begin(), before.end(), std::uint64_t{0}) != 0;
    REQUIRE(std::accumulate(counts.begin(), counts.end(), 0U) == (any ? rans_scale : 0U));
    for (std::size_t i = 0; i != counts.size(); ++i) REQUIRE((counts[i] == 0) == (before[i] == 0));
  }
}

TEST_CASE("rANS gives back symbols and bits, in as many bits as their entropy is") {
  constexpr std::size_t symbols = 9;
  std::vector<std::uint32_t> counts{4000, 50, 20, 10, 0, 8, 4, 3, 1};
  normalize_counts(counts);
  rans_decoder_table table;
  std::vector<std::uint32_t> symbol_of;
  std::vector<rans_encoder_symbol> coded(symbols);
  std::uint32_t start = 0;
  for (std::size_t s = 0; s != symbols; ++s) {
    const rans_symbol range{static_cast<std::uint16_t>(counts[s]), static_cast<std::uint16_t>(start)};
    if (counts[s] != 0) coded[s] = rans_encoder_symbol{range};
    table.set(static_cast<std::uint32_t>(s), start, counts[s]);
    symbol_of.insert(symbol_of.end(), counts[s], static_cast<std::uint32_t>(s));
    start += counts[s];
  }
  REQUIRE(start == rans_scale);

  orbis::random_bits random{5};
  std::vector<std::uint32_t> message(20000), rest(message.size());
  double bits = 0;
  for (std::size_t i = 0; i != message.size(); ++i) {
    message[i] = symbol_of[random.below(rans_scale)];
    rest[i] = message[i] == 3 ? random.below(1U << 15U) : 0;
    bits += -std::log2(counts[message[i]] / static_cast<double>(rans_scale)) + (message[i] == 3 ? 15 : 0);
  }
  std::vector<std::uint16_t> words(2 * message.size());
  rans_sink sink{words.data() + words.size()};
  std::array<rans_encoder, 3> encoders;  // in turns
  for (std::size_t i = message.size(); i-- != 0;) {
    if (message[i] == 3) encoders[i % 3].put_bits(rest[i], 15, sink);
    encoders[i % 3].put(coded[message[i]], sink);
  }
  std::vector<std::byte> bytes;
  for (const std::uint16_t* w = sink.words(); w != words.data() + words.size(); ++w) {
    bytes.push_back(static_cast<std::byte>(*w & 0xffU));
    bytes.push_back(static_cast<std::byte>(*w >> 8U));
  }
  CHECK(static_cast<double>(8 * bytes.size()) < 1.001 * bits + 3 * 32);

  rans_source source{bytes};
  std::array<std::uint32_t, 3> states{encoders[0].state(), encoders[1].state(), encoders[2].state()};
  for (std::size_t i = 0; i != message.size(); ++i) {
    REQUIRE(rans_symbol_of(states[i % 3], table, source) == message[i]);
    if (message[i] == 3) REQUIRE(rans_bits_of(states[i % 3], 15, source) == rest[i]);
  }
  CHECK(source.at_end());
  for (const std::uint32_t state : states) CHECK(state == rans_lowest);
}

TEST_CASE("a symbol that is certain takes no bits") {
  const rans_encoder_symbol certain{rans_symbol{static_cast<std::uint16_t>(rans_scale), 0}};
  std::vector<std::uint16_t> words(4);
  rans_sink sink{words.data() + words.size()};
  rans_encoder encoder;
  for (int i = 0; i != 100000; ++i) encoder.put(certain, sink);
  CHECK(sink.words() == words.data() + words.size());
  CHECK(encoder.state() == rans_lowest);
}

}  // namespace
