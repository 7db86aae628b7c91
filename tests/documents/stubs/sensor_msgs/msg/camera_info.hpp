// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: sensor_msgs/msg/CameraInfo.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <std_msgs/msg/header.hpp>

namespace sensor_msgs::msg {
struct CameraInfo {
  using ConstSharedPtr = std::shared_ptr<const CameraInfo>;
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
};
}  // namespace sensor_msgs::msg
