// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: geometry_msgs/msg/TransformStamped, Pose and what they hold.
#pragma once

#include <string>

#include <std_msgs/msg/header.hpp>

namespace geometry_msgs::msg {
struct Vector3 {
  double x = 0.0, y = 0.0, z = 0.0;
};
struct Point {
  double x = 0.0, y = 0.0, z = 0.0;
};
struct Quaternion {
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
};
struct Transform {
  Vector3 translation;
  Quaternion rotation;
};
struct Pose {
  Point position;
  Quaternion orientation;
};
struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
};
}  // namespace geometry_msgs::msg
