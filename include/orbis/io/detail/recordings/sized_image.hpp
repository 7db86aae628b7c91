// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Images that have to be of their camera's size.
#pragma once

#include <filesystem>
#include <string>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io::detail {

/// The image that was read from `path`, if it has the size of its camera. Errors: malformed, and those of `read`.
template <class T>
[[nodiscard]] result<image<T>> sized(result<image<T>> read, const std::filesystem::path& path, int width, int height) {
  if (!read || (read->width() == width && read->height() == height)) return read;
  return fail(errc::malformed, path.string(),
              "the image has " + std::to_string(read->width()) + "x" + std::to_string(read->height()) +
                  " pixels, the camera " + std::to_string(width) + "x" + std::to_string(height));
}

}  // namespace orbis::io::detail
