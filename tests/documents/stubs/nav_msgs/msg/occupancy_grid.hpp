// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: nav_msgs/msg/OccupancyGrid.
#pragma once

#include <cstdint>
#include <vector>

#include <geometry_msgs/msg/transform_stamped.hpp>
#include <std_msgs/msg/header.hpp>

namespace nav_msgs::msg {
struct MapMetaData {
  builtin_interfaces::msg::Time map_load_time;
  float resolution = 0.0F;
  std::uint32_t width = 0, height = 0;
  geometry_msgs::msg::Pose origin;
};
struct OccupancyGrid {
  std_msgs::msg::Header header;
  MapMetaData info;
  std::vector<std::int8_t> data;
};
}  // namespace nav_msgs::msg
