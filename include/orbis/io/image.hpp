// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Colour and depth images from files; the format is detected from the content, not the name.
#pragma once

#include <cstdint>
#include <filesystem>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io {

/// Reads a PNG (colour, grey or palette; 8 or 16 bits; with or without alpha) or a JPEG as 8-bit colour. Errors:
/// not_found, unreadable, malformed (damaged, truncated, more than 1 GiB), unsupported (another format).
[[nodiscard]] result<image<rgb8>> read_color(const std::filesystem::path& path);

/// Reads a 16-bit grey PNG, as stored (no scale applied).
/// Errors: not_found, unreadable, malformed (damaged, truncated, more than 1 GiB), unsupported (anything else).
[[nodiscard]] result<image<std::uint16_t>> read_depth(const std::filesystem::path& path);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/image-inl.hpp>
#endif
