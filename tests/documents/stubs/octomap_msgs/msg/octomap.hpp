// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: octomap_msgs/msg/Octomap.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <std_msgs/msg/header.hpp>

namespace octomap_msgs::msg {
struct Octomap {
  std_msgs::msg::Header header;
  bool binary = false;
  std::string id;
  double resolution = 0.0;
  std::vector<std::int8_t> data;
};
}  // namespace octomap_msgs::msg
