// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Limits on the image sizes that the headers of image files may specify.
#pragma once

#include <cstdint>

namespace orbis::io::detail {

/// Maximum number of pixels, more than any camera has: limits the memory that a header can cause to be allocated.
inline constexpr std::uint64_t max_image_pixels = std::uint64_t{1} << 28;
/// Maximum width and height of a PNG.
inline constexpr std::uint32_t max_png_side = std::uint32_t{1} << 20;

}  // namespace orbis::io::detail
