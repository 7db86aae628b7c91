// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <jpeglib.h>

#include <orbis/io/detail/files/jpeg_codec.hpp>
#include <orbis/io/jpeg.hpp>

#include "io/quiet.hpp"
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;

namespace {

/// A smooth picture as JPEG by libjpeg itself; `components` 1 (grey), 3 or 4 (CMYK).
std::string encode(int width, int height, int components, bool progressive = false,
                   std::span<const jpeg_scan_info> scans = {}) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &data, &size);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = components;
  info.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 3 ? JCS_RGB : JCS_CMYK;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 98, TRUE);
  if (progressive) jpeg_simple_progression(&info);
  if (!scans.empty()) {
    info.scan_info = scans.data();
    info.num_scans = static_cast<int>(scans.size());
  }
  jpeg_start_compress(&info, TRUE);
  std::vector<unsigned char> row(static_cast<std::size_t>(width * components));
  for (int y = 0; y != height; ++y) {
    for (int x = 0; x != width; ++x)
      for (int c = 0; c != components; ++c)
        row[static_cast<std::size_t>(x * components + c)] =
            static_cast<unsigned char>(2 * x + (c == 1 ? 3 * y : 40 * c));
    JSAMPROW p = row.data();
    jpeg_write_scanlines(&info, &p, 1);
  }
  jpeg_finish_compress(&info);
  std::string bytes(reinterpret_cast<char*>(data), size);
  jpeg_destroy_compress(&info);
  std::free(data);
  return bytes;
}

/// A marker segment of a JPEG file.
std::string segment(char marker, const std::string& content) {
  const std::size_t length = content.size() + 2;
  return std::string{'\xff', marker, static_cast<char>(length >> 8U), static_cast<char>(length & 0xffU)} + content;
}

/// What stands before the first scan of a progressive grey image.
std::string progressive_header(int width, int height) {
  const auto low = [](int v) { return static_cast<char>(v & 0xff); };
  const auto high = [](int v) { return static_cast<char>(v >> 8); };
  return "\xff\xd8" + segment('\xdb', '\0' + std::string(64, '\1')) +
         segment('\xc2', {'\x08', high(height), low(height), high(width), low(width), 1, 1, '\x11', 0}) +
         // DC: one bit that says "as before". AC: one bit for a run of 2^14 and more blocks without anything, two bits
         // for one of two or three.
         segment('\xc4', '\0' + std::string{'\1'} + std::string(15, '\0') + '\0') +
         segment('\xc4', '\x10' + std::string{'\1', '\1'} + std::string(14, '\0') + "\xe0\x10");
}

/// A grey image of 2048x2048 pixels whose coefficients come bit by bit, each in a scan of its own, and are all zero.
std::string many_empty_scans(int count) {
  constexpr int blocks = 256 * 256;
  std::string bytes =
      progressive_header(2048, 2048) + segment('\xda', {1, 1, 0, 0, 0, 0}) + std::string(blocks / 8, '\0');
  // 0 and 14 bits, twice: 2 * 32767 blocks; 10 and one bit: two blocks. After a byte 0xff stands 0.
  static_assert(2 * 32767 + 2 == blocks);
  const std::string nothing{'\x7f', '\xfe', '\xff', '\0', '\xfe', '\x7f'};
  for (int scan = 0; scan != count - 1; ++scan) {
    const auto frequency = static_cast<char>(1 + scan / 11);
    const int bit = 10 - scan % 11;
    const auto bits = static_cast<char>((bit == 10 ? 0 : bit + 1) << 4 | bit);
    bytes += segment('\xda', {1, 1, 0, frequency, frequency, bits}) + nothing;
  }
  return bytes + "\xff\xd9";
}

}  // namespace

TEST_CASE("a JPEG has its colours in place") {
  for (const bool progressive : {false, true}) {
    const auto read = io::decode_jpeg(encode(40, 24, 3, progressive)).value();
    REQUIRE(read.width() == 40);
    REQUIRE(read.height() == 24);
    for (const auto& [x, y] : {std::pair{5, 5}, std::pair{30, 8}, std::pair{20, 20}}) {
      CHECK(read(x, y).r == Approx(2 * x).margin(6));
      CHECK(read(x, y).g == Approx(2 * x + 3 * y).margin(6));
      CHECK(read(x, y).b == Approx(2 * x + 80).margin(6));
    }
  }
}

TEST_CASE("a grey JPEG is spread over the channels") {
  const auto read = io::decode_jpeg(encode(16, 16, 1)).value();
  CHECK(read(9, 3).r == Approx(18).margin(3));
  CHECK(read(9, 3).r == read(9, 3).g);
  CHECK(read(9, 3).r == read(9, 3).b);
}

TEST_CASE("a JPEG without a way to RGB is refused") { CHECK_FALSE(io::decode_jpeg(encode(16, 16, 4))); }

TEST_CASE("every truncation of a JPEG is an error and silent") {
  const orbis::test::temporary_folder folder;
  for (const bool progressive : {false, true}) {
    const std::string good = encode(40, 24, 3, progressive);
    std::size_t wrong = 0;
    const std::size_t printed = orbis::test::bytes_on_stderr(folder / "stderr", [&] {
      for (std::size_t n = 0; n < good.size(); ++n) {
        const auto read = io::decode_jpeg(good.substr(0, n));
        wrong += read || read.error().code != orbis::errc::malformed || read.error().message.size() < 16 ? 1 : 0;
      }
    });
    CHECK(wrong == 0);
    CHECK(printed == 0);
  }
}

TEST_CASE("a changed byte never crashes the JPEG reader") {
  const orbis::test::temporary_folder folder;
  for (const bool progressive : {false, true}) {
    const std::string good = encode(40, 24, 3, progressive);
    std::size_t refused = 0;
    const std::size_t printed = orbis::test::bytes_on_stderr(folder / "stderr", [&] {
      for (std::size_t i = 0; i != good.size(); ++i)
        for (const int flip : {0x01, 0x80, 0xFF}) {
          std::string bad = good;
          bad[i] = static_cast<char>(bad[i] ^ flip);
          refused += io::decode_jpeg(bad) ? 0 : 1;
        }
    });
    CHECK(refused > 0);
    CHECK(printed == 0);
  }
}

TEST_CASE("a JPEG header that claims too many pixels allocates nothing") {
  std::string bytes = encode(40, 24, 3);
  const std::size_t frame = bytes.find("\xFF\xC0");
  REQUIRE(frame != std::string::npos);
  for (const std::size_t k : {5U, 6U, 7U, 8U}) bytes[frame + k] = '\xF0';
  const auto read = io::decode_jpeg(bytes);
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "damaged JPEG: specifies more pixels than the file can hold");
}

TEST_CASE("what is written as JPEG is read back") {
  orbis::image<orbis::rgb8> picture(70, 40);
  for (int y = 0; y != picture.height(); ++y)
    for (int x = 0; x != picture.width(); ++x)
      picture(x, y) = {static_cast<std::uint8_t>(3 * x), static_cast<std::uint8_t>(5 * y), 90};
  const auto read = io::decode_jpeg(io::encode_jpeg(picture, 95).value()).value();
  REQUIRE(read.width() == 70);
  REQUIRE(read.height() == 40);
  for (const auto& [x, y] : {std::pair{5, 5}, std::pair{30, 8}, std::pair{66, 37}}) {
    CHECK(read(x, y).r == Approx(picture(x, y).r).margin(8));
    CHECK(read(x, y).g == Approx(picture(x, y).g).margin(8));
    CHECK(read(x, y).b == Approx(90).margin(8));
  }
  // A part of an image: rows with pixels between them.
  const orbis::image_view<const orbis::rgb8> corner{picture.data() + 30, 16, 8, 70};
  CHECK(io::decode_jpeg(io::encode_jpeg(corner, 95).value()).value()(0, 0).r == Approx(90).margin(8));
  CHECK(io::encode_jpeg(picture, 30).value().size() < io::encode_jpeg(picture, 95).value().size());

  CHECK(io::encode_jpeg({}).error().code == orbis::errc::invalid_argument);
  CHECK(io::encode_jpeg(orbis::image<orbis::rgb8>(70000, 1)).error().code == orbis::errc::invalid_argument);
}

TEST_CASE("a progressive JPEG of more scans than anybody needs is refused before they are decoded") {
  // Every bit of every coefficient in a scan of its own: each is in order, and many of them are too many.
  std::vector<jpeg_scan_info> scans;
  const auto add = [&](int frequency, int components, int first) {
    for (int bit = 10; bit >= 0; --bit) {
      jpeg_scan_info scan{};
      scan.comps_in_scan = components;
      for (int c = 0; c != components; ++c) scan.component_index[c] = first + c;
      scan.Ss = scan.Se = frequency;
      scan.Ah = bit == 10 ? 0 : bit + 1;
      scan.Al = bit;
      scans.push_back(scan);
    }
  };
  add(0, 3, 0);
  for (int c = 0; c != 3; ++c)
    for (int frequency = 1; frequency != 16; ++frequency) add(frequency, 1, c);
  REQUIRE(scans.size() > 500);
  CHECK(io::decode_jpeg(encode(64, 48, 3, true, std::span{scans}.first(400))));
  const auto read = io::decode_jpeg(encode(64, 48, 3, true, scans), "many.jpg");
  REQUIRE_FALSE(read);
  CHECK(read.error().code == orbis::errc::malformed);
  CHECK(read.error().to_string().find("too many scans") != std::string::npos);
}

TEST_CASE("the larger a JPEG is the fewer scans it may have") {
  // 2^30 pixels in all scans together; 2^22 pixels here.
  CHECK(io::decode_jpeg(many_empty_scans(255)));
  const auto read = io::decode_jpeg(many_empty_scans(256), "many.jpg");
  REQUIRE_FALSE(read);
  CHECK(read.error().code == orbis::errc::malformed);
  CHECK(read.error().to_string().find("has too many scans") != std::string::npos);
}

TEST_CASE("a JPEG of several scans may not have as many pixels as one of one scan") {
  const auto header = [](int width, int height) {  // and bytes enough for the pixels
    return progressive_header(width, height) + segment('\xda', {1, 1, 0, 0, 0, 0}) + std::string(1 << 18, '\0');
  };
  const std::string largest = header(8192, 8192);
  CHECK(io::detail::jpeg_decoder{largest}.read_header());
  const auto read = io::decode_jpeg(header(8193, 8192), "large.jpg");
  REQUIRE_FALSE(read);
  CHECK(read.error().code == orbis::errc::malformed);
  CHECK(read.error().to_string().find("has too many pixels for an image with several scans") != std::string::npos);
}

TEST_CASE("a damaged JPEG is given up at the first thing that is wrong") {
  // A scan that comes again and again contradicts the one before.
  const std::string good = encode(64, 48, 3, true);
  const std::size_t last = good.rfind("\xff\xda");
  REQUIRE(last != std::string::npos);
  const std::string scan = good.substr(last, good.size() - 2 - last);
  std::string many = good.substr(0, good.size() - 2);
  for (int i = 0; i != 600; ++i) many += scan;
  const auto read = io::decode_jpeg(many + "\xff\xd9", "many.jpg");
  REQUIRE_FALSE(read);
  CHECK(read.error().code == orbis::errc::malformed);
  CHECK(read.error().to_string().find("nconsistent progression") != std::string::npos);
}

TEST_CASE("a JPEG of plain pixels is read however small its file") {
  const orbis::image<orbis::rgb8> plain(2400, 1800, {120, 120, 120});
  const auto bytes = io::encode_jpeg(plain).value();
  CHECK(io::decode_jpeg(bytes).value().width() == 2400);
}
