// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// PNG images, decoded and encoded with libpng (W3C PNG specification, 2nd edition).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <png.h>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/files/png_codec.hpp>

namespace orbis::io {

/// How hard to compress: 0 (stored) to 9 (smallest, slow).
struct png_options {
  int compression = 6;
};

/// Whether `bytes` begin as a PNG file does.
[[nodiscard]] inline bool is_png(std::string_view bytes) noexcept { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

/// Any PNG as 8-bit colour: grey is spread over the channels, 16 bits are scaled to 8, a palette is
/// looked up, an alpha channel is dropped. `where` names the source in errors.
/// Errors: malformed (damaged or truncated).
[[nodiscard]] inline result<image<rgb8>> decode_png_color(std::string_view bytes, const std::string& where = {}) {
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

/// A 16-bit grey PNG. Errors: malformed; unsupported (not 16-bit grey).
[[nodiscard]] inline result<image<std::uint16_t>> decode_png_depth(std::string_view bytes,
                                                                   const std::string& where = {}) {
  detail::png_decoder decoder{bytes};
  if (!decoder.read_header()) return detail::damaged_png(where, decoder);
  if (!decoder.grey() || decoder.bits() != 16)
    return fail(errc::unsupported, where,
                "a depth image must be a 16-bit grey PNG, this one is " + std::to_string(decoder.bits()) + "-bit " +
                    (decoder.grey() ? "grey" : "colour, palette or alpha"));
  image<std::uint16_t> pixels(decoder.width(), decoder.height());
  const bool ok = decoder.read_pixels(reinterpret_cast<unsigned char*>(pixels.data()),
                                      2 * static_cast<std::size_t>(decoder.width()), [](png_structp png) {
                                        if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
                                      });
  if (!ok) return detail::damaged_png(where, decoder);
  return pixels;
}

/// The bytes of a PNG file: 8-bit colour, 8-bit grey or 16-bit grey, as the pixel type says.
/// For one version of zlib, equal pixels give equal bytes. @pre !view.empty()
[[nodiscard]] inline std::string encode_png(image_view<const rgb8> view, const png_options& options = {}) {
  return detail::encode_png(view, options.compression);
}
[[nodiscard]] inline std::string encode_png(image_view<const std::uint8_t> view, const png_options& options = {}) {
  return detail::encode_png(view, options.compression);
}
[[nodiscard]] inline std::string encode_png(image_view<const std::uint16_t> view, const png_options& options = {}) {
  return detail::encode_png(view, options.compression);
}

/// Writes a PNG file, whole or not at all. Errors: write_failed, invalid_argument (empty image).
inline result<void> write_png(const std::filesystem::path& path, image_view<const rgb8> view,
                              const png_options& options = {}) {
  return detail::write_png(path, view, options.compression);
}
inline result<void> write_png(const std::filesystem::path& path, image_view<const std::uint8_t> view,
                              const png_options& options = {}) {
  return detail::write_png(path, view, options.compression);
}
inline result<void> write_png(const std::filesystem::path& path, image_view<const std::uint16_t> view,
                              const png_options& options = {}) {
  return detail::write_png(path, view, options.compression);
}

}  // namespace orbis::io
