// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Decodes images in ROS bags according to the encoding of a `sensor_msgs/Image` or the format of a
/// `sensor_msgs/CompressedImage`. Formats are "ENCODING; CODEC compressed ..." or, for depth, "ENCODING;
/// compressedDepth CODEC".
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

#include "inputs/ros_messages.hpp"

namespace app {

/// Stored units per metre for depth that a bag contains in metres: steps of 0.2 mm, up to 13 m.
inline constexpr double metres_scale = 5000.0;

/// Returns true if images with this encoding or format are depth images.
[[nodiscard]] bool is_depth_encoding(std::string_view encoding);
/// Returns true if depth images with this encoding or format are in metres, not in millimetres.
[[nodiscard]] bool is_in_metres(std::string_view encoding);
/// Returns true if images with this encoding (not format) are supported.
[[nodiscard]] bool is_known_encoding(std::string_view encoding);

/// Decodes a grey or colour image, YUV 4:2:2, or a Bayer mosaic, with demosaicing. `where` names the source in errors.
/// Errors: unsupported (encoding), malformed (too few pixels, damaged).
[[nodiscard]] orbis::result<orbis::image<orbis::rgb8>> decode_color(const ros_messages::image& m,
                                                                    const std::string& where);
[[nodiscard]] orbis::result<orbis::image<orbis::rgb8>> decode_color(const ros_messages::compressed_image& m,
                                                                    const std::string& where);

/// Decodes a depth image; depth in metres is converted with `metres_scale`, integers are unchanged. Errors: those of
/// `decode_color`.
[[nodiscard]] orbis::result<orbis::image<std::uint16_t>> decode_depth(const ros_messages::image& m,
                                                                      const std::string& where);
/// Decodes a depth image from a PNG. "compressedDepth" has a header of 12 bytes with the two quantisation parameters
/// for depth in metres.
[[nodiscard]] orbis::result<orbis::image<std::uint16_t>> decode_depth(const ros_messages::compressed_image& m,
                                                                      const std::string& where);

}  // namespace app
