// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a PNG file, of colour and of depth. Checksums are put right as well, as no fuzzer finds them. What can
// be read is written and read again to the same pixels.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <zlib.h>

#include <orbis/io/png.hpp>

#include "fuzz/target.hpp"

namespace {

using namespace orbis;

[[nodiscard]] std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i != 4; ++i) value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

[[nodiscard]] std::string with_checksums(std::string file) {
  for (std::size_t at = 8; at + 12 <= file.size();) {
    const std::size_t length = big_endian(file, at);
    if (length > file.size() - at - 12) break;
    const auto crc = crc32(0, reinterpret_cast<const Bytef*>(file.data()) + at + 4, static_cast<uInt>(length + 4));
    for (std::size_t i = 0; i != 4; ++i) file[at + 8 + length + i] = static_cast<char>(crc >> (24 - 8 * i));
    at += length + 12;
  }
  return file;
}

template <class Pixel, class Decode>
void check(std::string_view bytes, Decode&& decode) {
  std::optional<result<image<Pixel>>> got;
  const std::size_t peak = fuzz::peak_bytes_of([&] { got.emplace(decode(bytes)); });
  // Deflate makes 1032 bytes of one, and a bit may stand for a pixel.
  fuzz::require(peak <= 8192 + 8 * sizeof(Pixel) * (1032 * bytes.size() + 1024), "memory in proportion to the file");
  if (!*got) {
    const error& e = got->error();
    fuzz::require(e.code == errc::malformed || e.code == errc::unsupported,
                  "a damaged image is malformed or unsupported");
    fuzz::require(!e.message.empty() && e.to_string().size() < 300, "the reason is given, and short");
    return;
  }
  fuzz::accept();
  const image<Pixel>& pixels = **got;
  fuzz::require(!pixels.empty(), "an image has pixels");
  if (pixels.pixels().size() > 8192) return;  // it takes long
  const auto again = decode(io::encode_png(pixels));
  fuzz::require(again && *again == pixels, "what was read is written and read to the same pixels");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string file{reinterpret_cast<const char*>(data), size};
  const auto check_both = [](const std::string& bytes) {
    check<rgb8>(bytes, [](std::string_view b) { return io::decode_png_color(b); });
    check<std::uint16_t>(bytes, [](std::string_view b) { return io::decode_png_depth(b); });
  };
  check_both(file);
  // As a view, because GCC 12 warns of an overrun in the comparison of the strings.
  if (const std::string right = with_checksums(file); std::string_view{right} != file) check_both(right);
  return 0;
}
