// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: std_msgs/msg/Header, builtin_interfaces/msg/Time.
#pragma once

#include <cstdint>
#include <string>

namespace builtin_interfaces::msg {
struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
}  // namespace builtin_interfaces::msg

namespace std_msgs::msg {
struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
};
}  // namespace std_msgs::msg
