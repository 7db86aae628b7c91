// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A decoder for the PNG files of depth cameras, based on libdeflate: it takes a third of the time of libpng and gives
/// the same pixels. All other files, including damaged ones, are left to libpng. This header is empty unless
/// ORBIS_LIBDEFLATE is defined, which orbis::compiled does for itself if CMake finds libdeflate.
///
/// "Portable Network Graphics (PNG) Specification", second edition, W3C 2003: chunks (5), filters (9).
#pragma once

#ifdef ORBIS_LIBDEFLATE

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <libdeflate.h>

#include <orbis/core/bytes.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/io/detail/files/image_limits.hpp>

namespace orbis::io::detail {

/// Size of a non-interlaced 16-bit grey image, and its compressed pixels, in one or more parts of the file.
struct packed_depth {
  std::uint32_t width = 0, height = 0;
  std::vector<std::string_view> parts;
  std::size_t size = 0;  ///< total size of the parts
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
    } else if (type == "IDAT" && (was_pixels || out.parts.empty())) {
      out.parts.push_back(data);
      out.size += data.size();
    } else if (type == "IEND") {
      return out;
    } else if ((type[0] & 0x20) == 0) {  // an unexpected critical chunk
      return std::nullopt;
    }
    was_pixels = type == "IDAT";
  }
}

/// Reverses filters. A filter predicts a byte from bytes to the left and above, so the pixels of a row depend on each
/// other: eight rows are decoded at the same time, each two pixels behind the row above it.
class depth_unfilter {
 public:
  static constexpr int rows = 8;  ///< number of rows that are decoded at the same time

  depth_unfilter(const unsigned char* raw, image<std::uint16_t>& out) : raw_{raw}, out_{out} {}

  /// Decodes the rows from `y` on, at most `rows`. @pre the rows above are decoded
  void decode(int y) {
    const int width = out_.width(), last = std::min(rows, out_.height() - y) - 1;
    std::array<const unsigned char*, rows> from;
    std::array<std::uint16_t*, rows> to;
    std::array<std::array<std::int16_t, rows>, 2> filters;
    for (int i = 0; i != rows; ++i) {
      const int row = y + std::min(i, last);
      const auto k = static_cast<std::size_t>(i);
      from[k] = raw_ + static_cast<std::size_t>(row) * (2 * static_cast<std::size_t>(width) + 1) + 1;
      to[k] = out_.row(row).data();
      filters[k / 4][2 * (k % 4)] = filters[k / 4][2 * (k % 4) + 1] = from[k][-1];
    }
    const auto group_of = [](const std::array<std::int16_t, rows>& of_rows) {
      const bytes filter = bytes::load(of_rows.data());
      const auto mask = [&](std::int16_t value) { return select(filter == bytes(value), bytes(-1), bytes(0)); };
      return group{.is_left = mask(1), .is_above = mask(2), .is_mean = mask(3), .is_paeth = mask(4)};
    };
    group upper = group_of(filters[0]), lower = group_of(filters[1]);
    const std::uint16_t* const above = y == 0 ? nullptr : out_.row(y - 1).data();
    // Row i is at x = t - 2 i. `get` returns the two bytes of a pixel there, zero to the left of the image.
    const auto step = [&](int t, const auto& get, const auto& put) ORBIS_INLINE_LAMBDA {
      const auto four = [&](std::size_t i) ORBIS_INLINE_LAMBDA {
        return get(i, t) | get(i + 1, t) << 16U | get(i + 2, t) << 32U | get(i + 3, t) << 48U;
      };
      const auto put_four = [&](std::size_t i, const pixels& four_pixels) ORBIS_INLINE_LAMBDA {
        std::array<std::uint32_t, 4> v;
        four_pixels.store(v.data());
        put(i, t, v[0]), put(i + 1, t, v[1]), put(i + 2, t, v[2]), put(i + 3, t, v[3]);
      };
      const std::uint32_t pixel = above != nullptr && t < width ? above[t] : 0U;
      const pixels row_above = simd::bits_as<std::uint32_t>(upper.before);
      put_four(0, upper.step(four(0), pixels(pixel >> 8U | (pixel & 255U) << 16U)));
      put_four(4, lower.step(four(4), row_above));
    };
    const auto get = [&](std::size_t i, int t) ORBIS_INLINE_LAMBDA {
      std::uint16_t two;
      std::memcpy(&two, from[i] + 2 * (t - 2 * static_cast<int>(i)), 2);
      return std::uint64_t{two};
    };
    const auto put = [&](std::size_t i, int t, std::uint32_t pixel) ORBIS_INLINE_LAMBDA {
      to[i][t - 2 * static_cast<int>(i)] = static_cast<std::uint16_t>(pixel);
    };
    const auto is_inside = [&](std::size_t i, int t) {
      const int x = t - 2 * static_cast<int>(i);
      return x >= 0 && x < width && static_cast<int>(i) <= last;
    };
    const auto get_inside = [&](std::size_t i, int t) { return is_inside(i, t) ? get(i, t) : 0; };
    const auto put_inside = [&](std::size_t i, int t, std::uint32_t pixel) {
      if (is_inside(i, t)) put(i, t, pixel);
    };
    const bool is_whole = last == rows - 1 && width > lag;
    for (int t = 0; t < width + lag; ++t)
      if (is_whole && t >= lag && t < width)
        step(t, get, put);
      else
        step(t, get_inside, put_inside);
  }

 private:
  static constexpr int lag = 2 * (rows - 1);
  using bytes = simd::vec<std::int16_t, 8, simd::portable>;    // of one pixel in each of four rows
  using pixels = simd::vec<std::uint32_t, 4, simd::portable>;  // the same: first byte + 2^16 * second byte

  /// Four rows. The pixel above the next one of a row is `before` of the row above, two steps ago.
  struct group {
    bytes is_left, is_above, is_mean, is_paeth;  // masks of rows by their filter
    bytes left{0}, corner{0}, before{0};

    [[nodiscard]] ORBIS_ALWAYS_INLINE pixels step(std::uint64_t filtered, const pixels& row_above) noexcept {
      simd::vec<std::uint8_t, 8, simd::portable> packed;
      std::memcpy(&packed, &filtered, sizeof packed);
      const bytes above =
          simd::bits_as<std::int16_t>(simd::shuffle<7, 0, 1, 2>(simd::bits_as<std::uint32_t>(before), row_above));
      const bytes to_left = above - corner, to_above = left - corner, to_corner = to_left + to_above;
      const bytes of_left = max(to_left, 0 - to_left), of_above = max(to_above, 0 - to_above);
      const bytes nearest = min(max(to_corner, 0 - to_corner), min(of_above, of_left));
      const bytes paeth = select(of_left == nearest, left, select(of_above == nearest, above, corner));
      const bytes predicted =
          (paeth & is_paeth) | ((left & is_left) | (above & is_above) | (((left + above) >> 1) & is_mean));
      before = left;
      corner = above;
      left = simd::bits_as<std::int16_t>(simd::bits_as<std::uint8_t>(simd::convert<std::int16_t>(packed)) +
                                         simd::bits_as<std::uint8_t>(predicted));
      const pixels both = simd::bits_as<std::uint32_t>(left);
      return (both << 8) | (both >> 16);  // the pixel is in the lower 16 bits
    }
  };

  const unsigned char* raw_;
  image<std::uint16_t>& out_;
};

/// Reverses the filters of 16-bit grey pixels. `raw`: for each row of `out`, a filter from 0 to 4 and the filtered
/// bytes.
/// @pre the processor is little-endian
template <class = void>
void unfilter_depth(const unsigned char* raw, image<std::uint16_t>& out) {
  depth_unfilter rows{raw, out};
  for (int y = 0; y < out.height(); y += depth_unfilter::rows) rows.decode(y);
}

/// Decodes a non-interlaced 16-bit grey PNG file in a third of the time of libpng. Empty for all other files and
/// damaged files, which libpng decodes or reports. Allocates a copy of the compressed pixels, the decompressed bytes
/// (at most 1032 times the compressed size), and the image, which is smaller than the decompressed bytes.
template <class = void>
[[nodiscard]] std::optional<image<std::uint16_t>> decode_plain_depth(std::string_view bytes) {
  if constexpr (std::endian::native != std::endian::little) return std::nullopt;  // as unfilter_depth requires
  const auto packed = read_depth_chunks(bytes);
  if (!packed) return std::nullopt;
  const std::uint64_t row_bytes = 2 * std::uint64_t{packed->width} + 1, raw_bytes = row_bytes * packed->height;
  if (packed->width > max_png_side || packed->height > max_png_side ||
      std::uint64_t{packed->width} * packed->height > max_image_pixels ||
      raw_bytes > 1032 * std::uint64_t{packed->size})
    return std::nullopt;
  const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflate{
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor};
  // One block for both: glibc returns several large blocks to the system when they are freed, and clearing new pages
  // for each image takes longer than decoding it.
  const auto raw = std::make_unique_for_overwrite<unsigned char[]>(raw_bytes + packed->size);
  unsigned char* end = raw.get() + raw_bytes;
  for (const std::string_view part : packed->parts) end = std::copy(part.begin(), part.end(), end);
  if (!inflate || libdeflate_zlib_decompress(inflate.get(), raw.get() + raw_bytes, packed->size, raw.get(), raw_bytes,
                                             nullptr) != LIBDEFLATE_SUCCESS)
    return std::nullopt;
  for (std::uint64_t at = 0; at != raw_bytes; at += row_bytes)
    if (raw[at] > 4) return std::nullopt;
  image<std::uint16_t> out(static_cast<int>(packed->width), static_cast<int>(packed->height));
  unfilter_depth(raw.get(), out);
  return out;
}

}  // namespace orbis::io::detail

#endif
