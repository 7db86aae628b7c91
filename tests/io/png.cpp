// SPDX-License-Identifier: BSD-3-Clause
#include <csetjmp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <png.h>
#include <sys/resource.h>
#include <zlib.h>

#include <orbis/core/random.hpp>
#include <orbis/io/png.hpp>

#include "io/libpng_file.hpp"
#include "io/quiet.hpp"
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using orbis::image;
using orbis::rgb8;
using orbis::test::big_endian;
using orbis::test::libpng_file;
using orbis::test::png_chunk;

namespace {

/// A pattern without symmetry, so that swapped axes, channels or bytes show.
template <class T>
image<T> pattern(int width, int height) {
  image<T> pixels(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      if constexpr (std::is_same_v<T, rgb8>)
        pixels(x, y) = {static_cast<std::uint8_t>(7 * x), static_cast<std::uint8_t>(11 * y + 1),
                        static_cast<std::uint8_t>(x * y + 5)};
      else
        pixels(x, y) = static_cast<T>(x * 259 + y * 7919 + 1);
    }
  return pixels;
}

}  // namespace

TEST_CASE("pixels survive writing and reading a PNG") {
  const auto color = pattern<rgb8>(37, 23);
  CHECK(io::decode_png_color(io::encode_png(color)).value() == color);
  const auto depth = pattern<std::uint16_t>(37, 23);
  CHECK(io::decode_png_depth(io::encode_png(depth)).value() == depth);
  const auto grey = pattern<std::uint8_t>(5, 4);
  const auto read = io::decode_png_color(io::encode_png(grey)).value();
  for (int y = 0; y != 4; ++y)
    for (int x = 0; x != 5; ++x) CHECK(read(x, y) == rgb8{grey(x, y), grey(x, y), grey(x, y)});
}

TEST_CASE("a part of an image is written without its surroundings") {
  const auto whole = pattern<rgb8>(20, 10);
  const orbis::image_view<const rgb8> part(whole.data() + 3 * 20 + 4, 6, 5, 20);
  const auto read = io::decode_png_color(io::encode_png(part)).value();
  CHECK(read.width() == 6);
  CHECK(read(0, 0) == whole(4, 3));
  CHECK(read(5, 4) == whole(9, 7));
}

TEST_CASE("PNGs of other kinds become 8-bit colour") {
  const auto gray_alpha = libpng_file(2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_INTERLACE_NONE, {{10, 0, 200, 255}});
  CHECK(io::decode_png_color(gray_alpha).value()(0, 0) == rgb8{10, 10, 10});
  CHECK(io::decode_png_color(gray_alpha).value()(1, 0) == rgb8{200, 200, 200});
  const auto rgba = libpng_file(1, 2, 8, PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE, {{1, 2, 3, 4}, {5, 6, 7, 8}});
  CHECK(io::decode_png_color(rgba).value()(0, 1) == rgb8{5, 6, 7});
  const auto rgb16 = libpng_file(1, 1, 16, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, {{0x80, 0x80, 0xFF, 0xFF, 0, 0}});
  CHECK(io::decode_png_color(rgb16).value()(0, 0) == rgb8{0x80, 0xFF, 0});
  const auto palette = libpng_file(4, 1, 2, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE, {{0b00011011}});
  CHECK(io::decode_png_color(palette).value()(0, 0) == rgb8{1, 2, 3});
  CHECK(io::decode_png_color(palette).value()(2, 0) == rgb8{255, 128, 0});
  CHECK(io::decode_png_color(palette).value()(3, 0) == rgb8{9, 8, 7});
  const auto bits = libpng_file(3, 1, 1, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, {{0b10100000}});
  CHECK(io::decode_png_color(bits).value()(0, 0) == rgb8{255, 255, 255});
  CHECK(io::decode_png_color(bits).value()(1, 0) == rgb8{0, 0, 0});
}

TEST_CASE("an interlaced PNG has its pixels in place") {
  std::vector<std::vector<png_byte>> rows(9, std::vector<png_byte>(11));
  for (std::size_t y = 0; y != 9; ++y)
    for (std::size_t x = 0; x != 11; ++x) rows[y][x] = static_cast<png_byte>(13 * y + 3 * x);
  const auto read = io::decode_png_color(libpng_file(11, 9, 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7, rows)).value();
  for (int y = 0; y != 9; ++y)
    for (int x = 0; x != 11; ++x) CHECK(read(x, y).g == 13 * y + 3 * x);
}

TEST_CASE("depth images of every filter, split or interlaced, have their pixels in place") {
  image<std::uint16_t> depth(33, 21);
  orbis::random_bits random{5};
  for (auto& d : depth.pixels()) d = static_cast<std::uint16_t>(random.below(3) == 0 ? 0 : 1000 + random.below(40000));
  std::vector<std::vector<png_byte>> rows(21);
  for (int y = 0; y != 21; ++y)
    for (const std::uint16_t d : depth.view().row(y)) {
      rows[static_cast<std::size_t>(y)].push_back(static_cast<png_byte>(d >> 8U));
      rows[static_cast<std::size_t>(y)].push_back(static_cast<png_byte>(d));
    }
  const auto check = [&](int interlace, void (*change)(png_structp)) {
    CHECK(io::decode_png_depth(libpng_file(33, 21, 16, PNG_COLOR_TYPE_GRAY, interlace, rows, change)).value() == depth);
  };
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_FILTER_NONE); });
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_FILTER_SUB); });
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_FILTER_UP); });
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_FILTER_AVG); });
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_filter(png, 0, PNG_FILTER_PAETH); });
  check(PNG_INTERLACE_NONE, [](png_structp png) { png_set_compression_buffer_size(png, 100); });
  check(PNG_INTERLACE_ADAM7, [](png_structp) {});
}

TEST_CASE("a depth image that is not 16-bit grey is refused in words") {
  const auto eight = io::decode_png_depth(io::encode_png(pattern<std::uint8_t>(4, 4)), "d.png");
  REQUIRE_FALSE(eight);
  CHECK(eight.error().code == orbis::errc::unsupported);
  CHECK(eight.error().to_string() == "d.png: a depth image must be a 16-bit grey PNG; this one is 8-bit grey");
  const auto color = io::decode_png_depth(io::encode_png(pattern<rgb8>(4, 4)));
  REQUIRE_FALSE(color);
  CHECK(color.error().message.find("colour") != std::string::npos);
}

TEST_CASE("every truncation of a PNG is an error and silent") {
  const orbis::test::temporary_folder folder;
  const std::string color = io::encode_png(pattern<rgb8>(16, 12));
  const std::string depth = io::encode_png(pattern<std::uint16_t>(16, 12));
  std::size_t accepted = 0;
  const std::size_t printed = orbis::test::bytes_on_stderr(folder / "stderr", [&] {
    for (std::size_t n = 0; n < color.size(); ++n) accepted += io::decode_png_color(color.substr(0, n)) ? 1 : 0;
    for (std::size_t n = 0; n < depth.size(); ++n) {
      const auto read = io::decode_png_depth(depth.substr(0, n));
      accepted += read || read.error().code != orbis::errc::malformed ? 1 : 0;
    }
  });
  CHECK(accepted == 0);
  CHECK(printed == 0);
}

TEST_CASE("a changed byte never crashes the PNG reader and pixels never change silently") {
  const orbis::test::temporary_folder folder;
  const auto original = pattern<std::uint16_t>(16, 12);
  const std::string good = io::encode_png(original);
  std::size_t changed = 0;
  const std::size_t printed = orbis::test::bytes_on_stderr(folder / "stderr", [&] {
    for (std::size_t i = 0; i != good.size(); ++i)
      for (const int flip : {0x01, 0x80, 0xFF}) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ flip);
        const auto read = io::decode_png_depth(bad);
        changed += read && *read != original ? 1 : 0;
        const auto as_color = io::decode_png_color(bad);
        changed += as_color && as_color->width() != 16 ? 1 : 0;
      }
  });
  CHECK(changed == 0);
  CHECK(printed == 0);
}

TEST_CASE("a header that claims too many pixels allocates nothing") {
  // 100000 x 100000 pixels, by a header whose checksum is right.
  const std::string size = big_endian(100'000) + big_endian(100'000);
  const std::string bytes =
      "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", size + std::string("\x10\0\0\0\0", 5)) + png_chunk("IDAT", "");
  const auto read = io::decode_png_depth(bytes);
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "damaged PNG: specifies more pixels than the file can hold");
}

TEST_CASE("compressed texts in a PNG take no memory") {
  // 60 chunks zTXt, each of which stands for 4 MB.
  const std::string text(4U << 20U, 'a');
  std::vector<png_byte> packed(8192);
  uLongf size = packed.size();
  REQUIRE(compress2(packed.data(), &size, reinterpret_cast<const Bytef*>(text.data()), text.size(), 9) == Z_OK);
  std::string note("note\0\0", 6);
  note.append(reinterpret_cast<const char*>(packed.data()), size);
  const std::string whole = png_chunk("zTXt", note);
  const auto original = pattern<std::uint16_t>(16, 12);
  std::string bytes = io::encode_png(original);
  for (const char* before : {"IDAT", "IEND"}) {
    std::string notes;
    for (int i = 0; i != 30; ++i) notes += whole;
    bytes.insert(bytes.find(before) - 4, notes);
  }
  const auto peak_kilobytes = [] {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before = peak_kilobytes();
  CHECK(io::decode_png_depth(bytes).value() == original);
  CHECK(peak_kilobytes() - before < 40'000);
}

TEST_CASE("an image file is written whole or the error says why not") {
  const orbis::test::temporary_folder folder;
  const auto depth = pattern<std::uint16_t>(8, 8);
  const auto files = [&] {  // hidden and temporary ones, too
    return std::distance(std::filesystem::directory_iterator{folder.path()}, std::filesystem::directory_iterator{});
  };
  REQUIRE(io::write_png(folder / "d.png", depth));
  CHECK(files() == 1);
  const auto nowhere = io::write_png(folder / "missing" / "d.png", depth);
  REQUIRE_FALSE(nowhere);
  CHECK(nowhere.error().code == orbis::errc::write_failed);
  const auto empty = io::write_png(folder / "e.png", image<rgb8>{});
  REQUIRE_FALSE(empty);
  CHECK(empty.error().code == orbis::errc::invalid_argument);
  CHECK(files() == 1);
  std::filesystem::create_directories(folder / "f.png" / "full");
  CHECK(io::write_png(folder / "f.png", depth).error().code == orbis::errc::write_failed);
  CHECK(files() == 2);
}
