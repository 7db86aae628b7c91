// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of png.hpp.
#pragma once

#include <bit>
#include <cstddef>
#include <utility>

#include <png.h>

#include <orbis/core/inline.hpp>
#include <orbis/io/detail/files/png_codec.hpp>
#include <orbis/io/detail/files/png_depth.hpp>
#include <orbis/io/png.hpp>

namespace orbis::io {

ORBIS_INLINE result<image<rgb8>> decode_png_color(std::string_view bytes, const std::string& where) {
  detail::png_decoder decoder{bytes};
  if (!decoder.read_header()) return detail::damaged_png(where, decoder);
  image<rgb8> pixels(decoder.width(), decoder.height());
  const bool ok = decoder.read_pixels(reinterpret_cast<unsigned char*>(pixels.data()),
                                      3 * static_cast<std::size_t>(decoder.width()), [](png_structp png) {
                                        png_set_expand(png);
                                        png_set_scale_16(png);
                                        png_set_gray_to_rgb(png);
                                        png_set_strip_alpha(png);
                                      });
  if (!ok) return detail::damaged_png(where, decoder);
  return pixels;
}

ORBIS_INLINE result<image<std::uint16_t>> decode_png_depth(std::string_view bytes, const std::string& where) {
#ifdef ORBIS_LIBDEFLATE
  if (auto plain = detail::decode_plain_depth(bytes)) return *std::move(plain);
#endif
  detail::png_decoder decoder{bytes};
  if (!decoder.read_header()) return detail::damaged_png(where, decoder);
  if (!decoder.grey() || decoder.bits() != 16)
    return fail(errc::unsupported, where,
                "a depth image must be a 16-bit grey PNG; this one is " + std::to_string(decoder.bits()) + "-bit " +
                    (decoder.grey() ? "grey" : "colour, palette or alpha"));
  image<std::uint16_t> pixels(decoder.width(), decoder.height());
  const bool ok = decoder.read_pixels(reinterpret_cast<unsigned char*>(pixels.data()),
                                      2 * static_cast<std::size_t>(decoder.width()), [](png_structp png) {
                                        if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
                                      });
  if (!ok) return detail::damaged_png(where, decoder);
  return pixels;
}

ORBIS_INLINE std::string encode_png(image_view<const rgb8> view) { return detail::encode_png(view); }

ORBIS_INLINE std::string encode_png(image_view<const std::uint8_t> view) { return detail::encode_png(view); }

ORBIS_INLINE std::string encode_png(image_view<const std::uint16_t> view) { return detail::encode_png(view); }

ORBIS_INLINE result<void> write_png(const std::filesystem::path& path, image_view<const rgb8> view) {
  return detail::write_png(path, view);
}

ORBIS_INLINE result<void> write_png(const std::filesystem::path& path, image_view<const std::uint8_t> view) {
  return detail::write_png(path, view);
}

ORBIS_INLINE result<void> write_png(const std::filesystem::path& path, image_view<const std::uint16_t> view) {
  return detail::write_png(path, view);
}

}  // namespace orbis::io
