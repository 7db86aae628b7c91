// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/bit_string.hpp>

#include "support/catch.hpp"

using namespace orbis;

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
  CHECK(words_of(x) == bit_words<256>{1, 2, 3, ~std::uint64_t{0}});
  CHECK(hamming_distance(words_of(x), words_of(x)) == 0);
  CHECK(hamming_distance(words_of(x), words_of(y)) == 1 + 2 + 64);
}
