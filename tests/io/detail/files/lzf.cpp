// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/files/lzf.hpp>

#include "support/catch.hpp"

namespace io = orbis::io;

namespace {

/// Text of `size` bytes out of `letters`; few letters compress well.
std::string babble(std::size_t size, unsigned letters, unsigned seed) {
  std::string text;
  unsigned state = seed * 2654435761U + 1U;
  while (text.size() != size) {
    state = state * 1664525U + 1013904223U;
    text.push_back(static_cast<char>((state >> 24) % letters));
  }
  return text;
}

}  // namespace

TEST_CASE("a hand-made LZF stream is decompressed") {
  // Three literals; a copy of 4 bytes from 3 back, overlapping; a long copy of 9 + 3 from 1 back.
  const std::string stream(
      "\x02"
      "abc"
      "\x40\x02"
      "\xE0\x03\x00",
      9);
  CHECK(io::detail::lzf_decompress(stream, 3 + 4 + 12) == "abcabca" + std::string(12, 'a'));
}

TEST_CASE("everything survives compression") {
  for (const std::size_t size : {0U, 1U, 2U, 3U, 4U, 31U, 32U, 33U, 64U, 263U, 264U, 265U, 1000U, 20000U, 100001U})
    for (const unsigned letters : {1U, 2U, 5U, 256U}) {
      const std::string data = babble(size, letters, static_cast<unsigned>(size));
      const std::string compressed = io::detail::lzf_compress(data);
      INFO(size << " bytes of " << letters << " letters");
      CHECK(io::detail::lzf_decompress(compressed, size) == data);
      CHECK(compressed.size() <= size + size / 32 + 1);
      CHECK(size <= io::detail::lzf_max_output(compressed.size()));
    }
}

TEST_CASE("repetition is compressed") {
  CHECK(io::detail::lzf_compress(std::string(100000, 'x')).size() < 1300);
  std::string far = babble(8192, 256, 1);
  far += far;  // at the greatest distance that can be coded
  CHECK(io::detail::lzf_compress(far).size() < 9000);
  CHECK(io::detail::lzf_decompress(io::detail::lzf_compress(far), far.size()) == far);
}

TEST_CASE("damaged LZF streams are refused") {
  const std::string data = babble(2000, 3, 7);
  const std::string good = io::detail::lzf_compress(data);
  for (std::size_t n = 0; n < good.size(); ++n) CHECK_FALSE(io::detail::lzf_decompress(good.substr(0, n), data.size()));
  CHECK_FALSE(io::detail::lzf_decompress(good, data.size() + 1));
  CHECK_FALSE(io::detail::lzf_decompress(good, data.size() - 1));
  CHECK_FALSE(io::detail::lzf_decompress(good, std::size_t{1} << 40));
  CHECK_FALSE(io::detail::lzf_decompress(std::string("\x40\x00", 2), 4));  // a copy from before the start
  for (std::size_t i = 0; i != good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0xFF);
    const auto out = io::detail::lzf_decompress(bad, data.size());
    if (out) CHECK(out->size() == data.size());
  }
}
