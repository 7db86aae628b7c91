// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/bits.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

static_assert(orbis::count_ones(0) == 0 && orbis::count_ones(~std::uint64_t{0}) == 64);

TEST_CASE("Ones are counted as the standard library counts them") {
  orbis::random_bits random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t x = random() & random();
    CHECK(orbis::count_ones(x) == static_cast<std::uint32_t>(std::popcount(x)));
  }
}

namespace {

struct four_words {
  std::uint64_t a, b, c, d;
};
struct padded {
  std::uint64_t a;
  std::uint8_t b;
};

}  // namespace

static_assert(bit_string<four_words> && bits_of<four_words> == 256);
static_assert(bit_string<std::array<unsigned char, 32>> && bit_string<std::array<std::uint64_t, 8>>);
static_assert(!bit_string<padded> && !bit_string<std::array<float, 8>> && !bit_string<std::array<char, 12>> &&
              !bit_string<std::string>);
static_assert(bit_string_range<std::vector<four_words>> && bit_string_range_of<std::span<const four_words>, 256>);
static_assert(!bit_string_range_of<std::vector<four_words>, 512> && !bit_string_range<std::vector<float>>);

TEST_CASE("the words of a bit string are its bytes, and its distance is the number of different bits") {
  const four_words x{1, 2, 3, ~std::uint64_t{0}}, y{1, 0, 0, 0};
  CHECK(as_words(x) == bit_words<256>{1, 2, 3, ~std::uint64_t{0}});
  CHECK(hamming_distance(as_words(x), as_words(x)) == 0);
  CHECK(hamming_distance(as_words(x), as_words(y)) == 1 + 2 + 64);
}
