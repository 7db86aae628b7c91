// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// PNG images, decoded and encoded with libpng (W3C PNG specification, 2nd edition).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io {

/// Returns true if `bytes` begin with the signature of a PNG file.
[[nodiscard]] inline bool is_png(std::string_view bytes) noexcept { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

/// Decodes any PNG to 8-bit colour: grey is copied to all channels, 16 bits are scaled to 8, a palette is resolved, an
/// alpha channel is dropped. `where` names the source in errors. Errors: malformed (damaged or truncated).
[[nodiscard]] result<image<rgb8>> decode_png_color(std::string_view bytes, const std::string& where = {});

/// Decodes a 16-bit grey PNG. Errors: malformed; unsupported (not 16-bit grey).
[[nodiscard]] result<image<std::uint16_t>> decode_png_depth(std::string_view bytes, const std::string& where = {});

/// Encodes a PNG file: 8-bit colour, 8-bit grey or 16-bit grey, according to the pixel type. With the same version of
/// zlib, equal pixels give equal bytes. @pre !view.empty()
[[nodiscard]] std::string encode_png(image_view<const rgb8> view);
[[nodiscard]] std::string encode_png(image_view<const std::uint8_t> view);
[[nodiscard]] std::string encode_png(image_view<const std::uint16_t> view);

/// Writes a PNG file atomically. Errors: write_failed, invalid_argument (empty image).
result<void> write_png(const std::filesystem::path& path, image_view<const rgb8> view);
result<void> write_png(const std::filesystem::path& path, image_view<const std::uint8_t> view);
result<void> write_png(const std::filesystem::path& path, image_view<const std::uint16_t> view);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/png-inl.hpp>
#endif
