// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A decoder for the PNG files of depth cameras, based on libdeflate: it takes half the time of libpng and gives the
/// same pixels. All other files, including damaged ones, are left to libpng. This header is empty unless
/// ORBIS_LIBDEFLATE is defined, which orbis::compiled does for itself if CMake finds libdeflate.
///
/// "Portable Network Graphics (PNG) Specification", second edition, W3C 2003: chunks (5), filters (9).
#pragma once

#ifdef ORBIS_LIBDEFLATE

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <libdeflate.h>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/io/detail/files/image_limits.hpp>

namespace orbis::io::detail {

/// Size of a non-interlaced 16-bit grey image, and its compressed pixels.
struct packed_depth {
  std::uint32_t width = 0, height = 0;
  std::vector<char> pixels;
};

/// Reads the chunks of such a PNG file; empty for any other file and for a damaged one. O(bytes).
template <class = void>
[[nodiscard]] std::optional<packed_depth> read_depth_chunks(std::string_view bytes) {
  using namespace std::string_view_literals;
  const auto number = [](std::string_view at) { return load_number<std::uint32_t>(at.data(), std::endian::big); };
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR"sv)) return std::nullopt;
  packed_depth out;
  bytes.remove_prefix(8);
  for (bool was_pixels = false;;) {
    if (bytes.size() < 12 || number(bytes) > bytes.size() - 12) return std::nullopt;
    const std::string_view type = bytes.substr(4, 4), data = bytes.substr(8, number(bytes));
    if (libdeflate_crc32(0, type.data(), 4 + data.size()) != number(bytes.substr(8 + data.size()))) return std::nullopt;
    bytes.remove_prefix(12 + data.size());
    if (type == "IHDR" && out.width == 0) {
      out.width = number(data);
      out.height = number(data.substr(4));
      // 16 bits, grey, deflate, adaptive filtering, not interlaced
      if (data.substr(8) != "\x10\0\0\0\0"sv || out.width == 0 || out.height == 0) return std::nullopt;
    } else if (type == "IDAT" && (was_pixels || out.pixels.empty())) {
      out.pixels.insert(out.pixels.end(), data.begin(), data.end());
    } else if (type == "IEND") {
      return out;
    } else if ((type[0] & 0x20) == 0) {  // an unexpected critical chunk
      return std::nullopt;
    }
    was_pixels = type == "IDAT";
  }
}

/// Reverses the filter of a row of 16-bit pixels, given the row above.
template <class = void>
[[nodiscard]] bool unfilter_depth_row(unsigned filter, unsigned char* row, const unsigned char* above,
                                      std::size_t width) {
  const auto each = [&](const auto& predict) {  // predicts from the bytes to the left, above, and above left
    for (std::size_t byte = 0; byte != 2; ++byte)
      for (std::size_t i = byte, before = 0, corner = 0; i < 2 * width; i += 2) {
        row[i] = static_cast<unsigned char>(row[i] +
                                            predict(static_cast<int>(before), int{above[i]}, static_cast<int>(corner)));
        before = row[i];
        corner = above[i];
      }
    return true;
  };
  switch (filter) {
    case 0: return true;
    case 1: return each([](int a, int, int) { return a; });
    case 2:
      for (std::size_t i = 0; i != 2 * width; ++i) row[i] = static_cast<unsigned char>(row[i] + above[i]);
      return true;
    case 3: return each([](int a, int b, int) { return (a + b) / 2; });
    case 4:
      return each([](int a, int b, int c) {
        const int of_a = std::abs(b - c), of_b = std::abs(a - c), of_c = std::abs(a + b - 2 * c);
        const int vertical = of_b <= of_c ? b : c;
        return of_a <= of_b && of_a <= of_c ? a : vertical;
      });
    default: return false;
  }
}

/// Decodes a non-interlaced 16-bit grey PNG file in half the time of libpng. Empty for all other files and damaged
/// files, which libpng decodes or reports. Allocates a copy of the compressed pixels, the decompressed bytes (at most
/// 1032 times the compressed size), and the image, which is smaller than the decompressed bytes.
template <class = void>
[[nodiscard]] std::optional<image<std::uint16_t>> decode_plain_depth(std::string_view bytes) {
  const auto packed = read_depth_chunks(bytes);
  if (!packed) return std::nullopt;
  const std::uint64_t row_bytes = 2 * std::uint64_t{packed->width} + 1, raw_bytes = row_bytes * packed->height;
  if (packed->width > max_png_side || packed->height > max_png_side ||
      std::uint64_t{packed->width} * packed->height > max_image_pixels ||
      raw_bytes > 1032 * std::uint64_t{packed->pixels.size()})
    return std::nullopt;
  const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflate{
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor};
  const auto raw = std::make_unique_for_overwrite<unsigned char[]>(raw_bytes);
  if (!inflate || libdeflate_zlib_decompress(inflate.get(), packed->pixels.data(), packed->pixels.size(), raw.get(),
                                             raw_bytes, nullptr) != LIBDEFLATE_SUCCESS)
    return std::nullopt;
  const std::vector<unsigned char> zeros(2 * std::size_t{packed->width});
  const unsigned char* above = zeros.data();
  image<std::uint16_t> out(static_cast<int>(packed->width), static_cast<int>(packed->height));
  for (int y = 0; y != out.height(); ++y) {
    unsigned char* const row = raw.get() + static_cast<std::size_t>(y) * row_bytes + 1;
    if (!unfilter_depth_row(row[-1], row, above, packed->width)) return std::nullopt;
    above = row;
    std::uint16_t* const to = out.row(y).data();
    for (std::size_t x = 0; x != packed->width; ++x)
      to[x] = static_cast<std::uint16_t>(row[2 * x] << 8U | row[2 * x + 1]);
  }
  return out;
}

}  // namespace orbis::io::detail

#endif
