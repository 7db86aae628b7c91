// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// JPEG images, decoded and encoded with libjpeg(-turbo). A damaged or truncated file is an error, never a half
/// grey image.
#pragma once

#include <cassert>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/files/jpeg_codec.hpp>

namespace orbis::io {

/// Whether `bytes` begin as a JPEG file does.
[[nodiscard]] inline bool is_jpeg(std::string_view bytes) noexcept { return bytes.starts_with("\xFF\xD8\xFF"); }

/// A JPEG as 8-bit colour; grey is spread over the channels. `where` names the source in errors.
/// Errors: malformed (damaged or truncated; a colour space without a way to RGB; more scans than such an image needs, for
/// each costs O(pixels)). O(pixels x scans).
[[nodiscard]] inline result<image<rgb8>> decode_jpeg(std::string_view bytes, const std::string& where = {}) {
  detail::jpeg_decoder decoder{bytes};
  if (!decoder.read_header()) return fail(errc::malformed, where, "damaged JPEG: " + decoder.message());
  image<rgb8> pixels(decoder.width(), decoder.height());
  if (!decoder.read_pixels(pixels.data())) return fail(errc::malformed, where, "damaged JPEG: " + decoder.message());
  return pixels;
}

/// A baseline JPEG of an image, with half the resolution for colour. `quality`: 1 (small) ... 100 (like the image).
/// Errors: invalid_argument (no pixels, or more than 65500 in a row or column), exception (no memory). O(pixels).
/// @pre 1 <= quality <= 100
[[nodiscard]] inline result<std::string> encode_jpeg(image_view<const rgb8> pixels, int quality = 85) {
  assert(1 <= quality && quality <= 100);
  if (pixels.empty()) return fail(errc::invalid_argument, {}, "a JPEG without pixels");
  detail::jpeg_encoder encoder;
  if (encoder.write(pixels, quality)) return encoder.take();
  if (encoder.out_of_memory()) return fail(errc::exception, {}, "no memory");
  return fail(errc::invalid_argument, {}, "no JPEG: " + encoder.message());
}

}  // namespace orbis::io
