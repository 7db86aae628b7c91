// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of jpeg.hpp.
#pragma once

#include <cassert>

#include <orbis/core/inline.hpp>
#include <orbis/io/detail/files/jpeg_codec.hpp>
#include <orbis/io/jpeg.hpp>

namespace orbis::io {

ORBIS_INLINE result<image<rgb8>> decode_jpeg(std::string_view bytes, const std::string& where) {
  detail::jpeg_decoder decoder{bytes};
  if (!decoder.read_header()) return fail(errc::malformed, where, "damaged JPEG: " + decoder.message());
  image<rgb8> pixels(decoder.width(), decoder.height());
  if (!decoder.read_pixels(pixels.data())) return fail(errc::malformed, where, "damaged JPEG: " + decoder.message());
  return pixels;
}

ORBIS_INLINE result<std::string> encode_jpeg(image_view<const rgb8> pixels, int quality) {
  assert(1 <= quality && quality <= 100);
  if (pixels.empty()) return fail(errc::invalid_argument, {}, "an image without pixels cannot be encoded as JPEG");
  detail::jpeg_encoder encoder;
  if (encoder.write(pixels, quality)) return encoder.take();
  if (encoder.out_of_memory()) return fail(errc::exception, {}, "out of memory");
  return fail(errc::invalid_argument, {}, "cannot be encoded as JPEG: " + encoder.message());
}

}  // namespace orbis::io
