// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of image.hpp.
#pragma once

#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/image.hpp>
#include <orbis/io/jpeg.hpp>
#include <orbis/io/png.hpp>

namespace orbis::io {

namespace detail {
/// Maximum size of an image file: larger than any image of `max_image_pixels`, compressed or not.
inline constexpr std::uintmax_t max_image_bytes = std::uintmax_t{1} << 30;
}  // namespace detail

ORBIS_INLINE result<image<rgb8>> read_color(const std::filesystem::path& path) {
  const auto bytes = read_file(path, detail::max_image_bytes);
  if (!bytes) return fail(bytes.error());
  if (bytes->empty()) return fail(errc::malformed, path.string(), "the file is empty");
  if (is_png(*bytes)) return decode_png_color(*bytes, path.string());
  if (is_jpeg(*bytes)) return decode_jpeg(*bytes, path.string());
  return fail(errc::unsupported, path.string(), "is neither a PNG nor a JPEG image");
}

ORBIS_INLINE result<image<std::uint16_t>> read_depth(const std::filesystem::path& path) {
  const auto bytes = read_file(path, detail::max_image_bytes);
  if (!bytes) return fail(bytes.error());
  if (bytes->empty()) return fail(errc::malformed, path.string(), "the file is empty");
  if (!is_png(*bytes)) return fail(errc::unsupported, path.string(), "a depth image must be a 16-bit grey PNG");
  return decode_png_depth(*bytes, path.string());
}

}  // namespace orbis::io
