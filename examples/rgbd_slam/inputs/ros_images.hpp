// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pixels of images in ROS 1 bags, by the encoding of a `sensor_msgs/Image` or the format of a
/// `sensor_msgs/CompressedImage`. Formats are "ENCODING; CODEC compressed ..." or, of depth, "ENCODING; compressedDepth
/// CODEC".
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

#include "inputs/ros_messages.hpp"

namespace app {

/// Of depth in metres: a fifth of a millimetre, up to 13 m.
inline constexpr double metres_scale = 5000.0;

/// Whether images of this encoding, or format, are depth; and whether they are in metres, not in millimetres.
[[nodiscard]] bool is_depth_encoding(std::string_view encoding);
[[nodiscard]] bool is_in_metres(std::string_view encoding);
/// Whether images of this encoding are read (not: formats).
[[nodiscard]] bool is_known_encoding(std::string_view encoding);

/// A name out of a message, as errors have it: no longer than a line.
[[nodiscard]] inline std::string in_short(std::string_view name) {
  constexpr std::size_t most = 60;
  return name.size() <= most ? std::string{name} : std::string{name.substr(0, most)} + "...";
}

/// A grey or colour image, or the mosaic of a colour filter (Bayer) with the colours between its pixels filled in.
/// `where` names the source in errors. Errors: unsupported (another encoding, which is named), malformed (fewer pixels
/// than it says; damaged).
[[nodiscard]] orbis::result<orbis::image<orbis::rgb8>> color_of(const ros_messages::image& m, const std::string& where);
[[nodiscard]] orbis::result<orbis::image<orbis::rgb8>> color_of(const ros_messages::compressed_image& m,
                                                                const std::string& where);

/// A depth image; metres become stored values of `metres_scale`, whole numbers stay. Errors as above.
[[nodiscard]] orbis::result<orbis::image<std::uint16_t>> depth_of(const ros_messages::image& m,
                                                                  const std::string& where);
/// As above, from a PNG: of "compressedDepth" behind a header of 12 bytes, with the two numbers by which depth in
/// metres became whole numbers.
[[nodiscard]] orbis::result<orbis::image<std::uint16_t>> depth_of(const ros_messages::compressed_image& m,
                                                                  const std::string& where);

}  // namespace app
