// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The ROS 1 and ROS 2 messages of recordings. Both have the same fields, except for the sequence number in the header
/// of ROS 1.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>

#include "inputs/message_reader.hpp"

namespace app::ros_messages {

struct header {
  std::int64_t stamp = 0;  ///< nanoseconds
  std::string frame_id;    ///< without a leading slash
};

/// `sensor_msgs/Image`. `data` refers to the bytes of the message.
struct image {
  ros_messages::header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes per row
  std::string_view data;
};

/// `sensor_msgs/CompressedImage`. `data` refers to the bytes of the message.
struct compressed_image {
  ros_messages::header header;
  std::string format;
  std::string_view data;
};

/// `sensor_msgs/CameraInfo`, excluding binning and region of interest.
struct camera_info {
  ros_messages::header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> D;
  std::array<double, 9> K{}, R{};
  std::array<double, 12> P{};
};

/// A transform in `tf2_msgs/TFMessage`, `geometry_msgs/PoseStamped`, `geometry_msgs/PoseWithCovarianceStamped` or
/// `nav_msgs/Odometry`, excluding velocity and covariance. The frame in the header is the parent.
struct transform {
  ros_messages::header header;
  std::string child_frame_id;  ///< empty for poses
  orbis::se3 T_parent_child;
};

/// Reads a message. Check `in.ok()` afterwards; it is also false for rotations with norm zero and non-finite numbers.
[[nodiscard]] std::int64_t read_stamp(message_reader& in);  ///< nanoseconds, at the beginning of a header
void read(message_reader& in, header& m);
void read(message_reader& in, image& m);
void read(message_reader& in, compressed_image& m);
void read(message_reader& in, camera_info& m);
void read(message_reader& in, std::vector<transform>& m);
/// `has_child`: the message is `nav_msgs/Odometry`.
void read_pose(message_reader& in, transform& m, bool has_child);

/// Parses a message or the beginning of a message. Errors: malformed.
template <class Message>
[[nodiscard]] orbis::result<Message> parse(std::string_view bytes, message_encoding encoding,
                                           const std::string& where) {
  message_reader in{bytes, encoding};
  Message m;
  read(in, m);
  if (!in.ok()) return orbis::fail(orbis::errc::malformed, where, "a message is damaged or of another type");
  return m;
}

/// The camera described by a message. `is_rectified`: the images are rectified, so that the matrix P applies. Errors:
/// malformed (no size, no camera matrix), unsupported (distortion model).
[[nodiscard]] orbis::result<orbis::camera::any_camera> make_camera(const camera_info& info, bool is_rectified,
                                                                   const std::string& where);

}  // namespace app::ros_messages
