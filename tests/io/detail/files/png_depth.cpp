// SPDX-License-Identifier: BSD-3-Clause
// Empty unless orbis::compiled uses libdeflate.
#ifdef ORBIS_LIBDEFLATE

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <png.h>
#include <zlib.h>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/detail/files/png_depth.hpp>
#include <orbis/io/png.hpp>

#include "io/libpng_file.hpp"
#include "support/catch.hpp"

namespace {

using orbis::io::detail::decode_plain_depth;
using orbis::test::big_endian;
using orbis::test::libpng_file;
using orbis::test::png_chunk;

orbis::image<std::uint16_t> some_depth(int width = 33, int height = 21) {
  orbis::image<std::uint16_t> depth(width, height);
  orbis::random_bits random{5};
  for (auto& d : depth.pixels()) d = static_cast<std::uint16_t>(random.below(3) == 0 ? 0 : 1000 + random.below(40000));
  return depth;
}

std::string file_of(
    const orbis::image<std::uint16_t>& depth, int interlace = PNG_INTERLACE_NONE,
    void (*change)(png_structp) = [](png_structp) {}) {
  std::vector<std::vector<png_byte>> rows(static_cast<std::size_t>(depth.height()));
  for (int y = 0; y != depth.height(); ++y)
    for (const std::uint16_t d : depth.view().row(y)) {
      rows[static_cast<std::size_t>(y)].push_back(static_cast<png_byte>(d >> 8U));
      rows[static_cast<std::size_t>(y)].push_back(static_cast<png_byte>(d));
    }
  return libpng_file(depth.width(), depth.height(), 16, PNG_COLOR_TYPE_GRAY, interlace, rows, change);
}

TEST_CASE("plain depth images of every filter are decoded, whole or split") {
  const auto depth = some_depth();
  const auto check = [&](void (*change)(png_structp)) {
    const auto read = decode_plain_depth(file_of(depth, PNG_INTERLACE_NONE, change));
    REQUIRE(read.has_value());
    CHECK(*read == depth);
  };
  check([](png_structp png) { png_set_filter(png, 0, PNG_FILTER_NONE); });
  check([](png_structp png) { png_set_filter(png, 0, PNG_FILTER_SUB); });
  check([](png_structp png) { png_set_filter(png, 0, PNG_FILTER_UP); });
  check([](png_structp png) { png_set_filter(png, 0, PNG_FILTER_AVG); });
  check([](png_structp png) { png_set_filter(png, 0, PNG_FILTER_PAETH); });
  check([](png_structp png) { png_set_compression_buffer_size(png, 100); });
}

TEST_CASE("depth images of any size are decoded, with a filter of its own for each row") {
  for (const int width : {1, 2, 14, 15, 40})
    for (const int height : {1, 7, 8, 9, 24}) {
      CAPTURE(width, height);
      auto depth = some_depth(width, height);
      for (int y = 0; y != height; ++y)  // rows for which libpng chooses different filters
        for (int x = 0; x != width; ++x)
          if (y % 4 != 0) depth(x, y) = static_cast<std::uint16_t>(y % 4 == 1 ? 257 * x : y % 4 == 2 ? 1000 : x * y);
      const auto read = decode_plain_depth(
          file_of(depth, PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_ALL_FILTERS); }));
      REQUIRE(read.has_value());
      CHECK(*read == depth);
    }
}

TEST_CASE("what is not a plain depth image is left to libpng") {
  const auto depth = some_depth();
  const std::string good = file_of(depth);
  REQUIRE(decode_plain_depth(good).has_value());
  const std::size_t pixels = good.find("IDAT");
  const auto with = [&](const std::string& chunk) {
    return decode_plain_depth(std::string{good}.insert(pixels - 4, chunk)).has_value();
  };
  CHECK(with(png_chunk("tEXt", std::string("a\0b", 3))));
  CHECK_FALSE(with(png_chunk("PLTE", "abc")));
  for (const std::size_t at : {good.find("IHDR") + 15, pixels + 20, good.size() - 1}) {  // the last: a checksum
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 1);
    CHECK_FALSE(decode_plain_depth(bad).has_value());
  }
  CHECK_FALSE(decode_plain_depth(good.substr(0, good.size() - 12)).has_value());
  CHECK_FALSE(decode_plain_depth(file_of(depth, PNG_INTERLACE_ADAM7)).has_value());
  const auto eight = libpng_file(2, 1, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, {{1, 2}});
  CHECK_FALSE(decode_plain_depth(eight).has_value());
  const auto color = libpng_file(1, 1, 16, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, {{1, 2, 3, 4, 5, 6}});
  CHECK_FALSE(decode_plain_depth(color).has_value());
}

TEST_CASE("a depth image of zeros that is larger than the limit is an error") {
  // Deflate needs 0.5 MB for 2^28 + 2^14 pixels: a block of 64 rows of zeros, repeated.
  constexpr std::uint32_t width = (1U << 14U) + 1, height = 1U << 14U, repeats = height / 64;
  std::vector<Bytef> rows(64 * std::size_t{2 * width + 1}), block(rows.size() / 500);
  z_stream stream{};
  REQUIRE(deflateInit2(&stream, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  stream.next_in = rows.data();
  stream.avail_in = static_cast<uInt>(rows.size());
  stream.next_out = block.data();
  stream.avail_out = static_cast<uInt>(block.size());
  REQUIRE(deflate(&stream, Z_FULL_FLUSH) == Z_OK);
  REQUIRE(stream.avail_in == 0);
  REQUIRE(stream.avail_out != 0);
  std::string packed("\x78\x9c");
  for (std::uint32_t i = 0; i != repeats; ++i) packed.append(block.begin(), block.begin() + stream.total_out);
  deflateEnd(&stream);
  packed += std::string("\1\0\0\xff\xff", 5);                                                   // the last block
  packed += big_endian(static_cast<std::uint32_t>(rows.size() * repeats % 65521 << 16U | 1U));  // Adler-32 of zeros
  const std::string bytes = "\x89PNG\r\n\x1a\n" +
                            png_chunk("IHDR", big_endian(width) + big_endian(height) + std::string("\x10\0\0\0\0", 5)) +
                            png_chunk("IDAT", packed) + png_chunk("IEND", "");
  CHECK_FALSE(decode_plain_depth(bytes).has_value());
  const auto read = orbis::io::decode_png_depth(bytes);
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "damaged PNG: specifies more pixels than the file can hold");
}

}  // namespace

#endif
