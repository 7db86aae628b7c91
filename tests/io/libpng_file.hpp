// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// PNG files of any kind, by libpng itself, and chunks to add to them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <png.h>
#include <zlib.h>

namespace orbis::test {

/// A PNG of any kind by libpng itself; rows are bytes as PNG stores them. `change` prepares the encoder.
inline std::string libpng_file(
    int width, int height, int bits, int type, int interlace, const std::vector<std::vector<png_byte>>& rows,
    void (*change)(png_structp) = [](png_structp) {}) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, std::size_t n) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(data), n);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, type, interlace,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  change(png);
  const png_color palette[] = {{1, 2, 3}, {40, 50, 60}, {255, 128, 0}, {9, 8, 7}};
  const png_byte alpha[] = {0, 128};
  if (type == PNG_COLOR_TYPE_PALETTE) {
    png_set_PLTE(png, info, palette, 4);
    png_set_tRNS(png, info, alpha, 2, nullptr);
  }
  png_write_info(png, info);
  const int passes = png_set_interlace_handling(png);
  for (int pass = 0; pass != passes; ++pass)
    for (const auto& row : rows) png_write_row(png, row.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

inline std::string big_endian(std::uint32_t number) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(number >> shift);
  return bytes;
}

/// A chunk of a PNG with its length and checksum.
inline std::string png_chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + checked + big_endian(static_cast<std::uint32_t>(crc));
}

}  // namespace orbis::test
