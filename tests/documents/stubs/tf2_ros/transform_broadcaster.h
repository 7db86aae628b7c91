// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: tf2_ros::TransformBroadcaster.
#pragma once

#include <geometry_msgs/msg/transform_stamped.hpp>
#include <rclcpp/rclcpp.hpp>

namespace tf2_ros {
class TransformBroadcaster {
 public:
  explicit TransformBroadcaster(rclcpp::Node&) {}
  void sendTransform(const geometry_msgs::msg::TransformStamped& t) {
    auto& m = stubs::middleware::instance();
    ++m.transforms;
    m.expect(!t.header.frame_id.empty() && !t.child_frame_id.empty(), "transform");
  }
};
}  // namespace tf2_ros
