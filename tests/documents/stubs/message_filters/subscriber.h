// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: message_filters::Subscriber.
#pragma once

#include <string>

#include <rclcpp/rclcpp.hpp>

namespace message_filters {
template <class Message>
class Subscriber {
 public:
  void subscribe(rclcpp::Node*, const std::string&, rmw_qos_profile_t = rmw_qos_profile_default) {}
};
}  // namespace message_filters
