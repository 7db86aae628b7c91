// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small recordings made by hand.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <orbis/io/png.hpp>

#include "support/temporary_folder.hpp"

namespace orbis::test {

/// A camera for the images below.
inline const char* const tiny_camera =
    "model = 'pinhole'\nwidth = 8\nheight = 6\nfx = 7\nfy = 7\ncx = 3.5\ncy = 2.5\ndepth_scale = 5000\n";

/// An 8x6 image that is `value` all over.
inline std::string tiny_color(std::uint8_t value) { return io::encode_png(image<rgb8>(8, 6, {value, value, value})); }
inline std::string tiny_depth(std::uint16_t value) { return io::encode_png(image<std::uint16_t>(8, 6, value)); }

/// The message of a failed result; empty for a good one.
template <class R>
std::string message_of(const R& r) {
  return r ? std::string{} : r.error().to_string();
}

}  // namespace orbis::test
