// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// JPEG images, decoded and encoded with libjpeg(-turbo). A damaged or truncated file is an error; partially decoded
/// images are never returned.
#pragma once

#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io {

/// Returns true if `bytes` begin with the signature of a JPEG file.
[[nodiscard]] inline bool is_jpeg(std::string_view bytes) noexcept { return bytes.starts_with("\xFF\xD8\xFF"); }

/// Decodes a JPEG to 8-bit colour; grey is copied to all channels. `where` names the source in errors. Errors:
/// malformed (damaged or truncated; a colour space that cannot be converted to RGB; more scans than an image needs,
/// because each takes O(pixels)). O(pixels x scans).
[[nodiscard]] result<image<rgb8>> decode_jpeg(std::string_view bytes, const std::string& where = {});

/// Encodes an image as a baseline JPEG, with chroma at half the resolution. `quality`: 1 (smallest file) ... 100 (best
/// quality). Errors: invalid_argument (no pixels, or more than 65500 in a row or column), exception (out of memory).
/// O(pixels).
/// @pre 1 <= quality <= 100
[[nodiscard]] result<std::string> encode_jpeg(image_view<const rgb8> pixels, int quality = 85);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/jpeg-inl.hpp>
#endif
