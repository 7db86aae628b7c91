// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: message_filters::Synchronizer, of a colour image, a depth image and a camera. Rows of the images
/// are padded, as drivers may do.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

#include <message_filters/subscriber.h>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/image.hpp>

namespace message_filters {
template <class Policy>
class Synchronizer {
 public:
  template <class... Filters>
  explicit Synchronizer(const Policy&, Filters&...) {}
  template <class Callback>
  void registerCallback(const Callback& callback) {
    stubs::middleware::instance().frame_callbacks.emplace_back([callback](std::size_t i) mutable {
      const auto frame = stubs::camera().frame(i).value();
      const auto& k = stubs::intrinsics();
      const sensor_msgs::msg::Image::ConstSharedPtr color = message(frame.color.view(), "bgr8", frame.timestamp);
      const sensor_msgs::msg::Image::ConstSharedPtr depth = message(frame.depth.view(), "16UC1", frame.timestamp);
      auto info = std::make_shared<sensor_msgs::msg::CameraInfo>();
      info->width = static_cast<std::uint32_t>(k.width), info->height = static_cast<std::uint32_t>(k.height);
      info->distortion_model = "plumb_bob";
      info->d.assign(5, 0.0);
      info->k = {k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0};
      callback(color, depth, sensor_msgs::msg::CameraInfo::ConstSharedPtr{info});
    });
  }

 private:
  template <class View>
  static sensor_msgs::msg::Image::ConstSharedPtr message(const View& pixels, const std::string& encoding, double time) {
    auto m = std::make_shared<sensor_msgs::msg::Image>();
    m->header.stamp.sec = static_cast<std::int32_t>(time);
    m->header.stamp.nanosec = static_cast<std::uint32_t>(1e9 * (time - m->header.stamp.sec));
    m->encoding = encoding;
    m->width = static_cast<std::uint32_t>(pixels.width()), m->height = static_cast<std::uint32_t>(pixels.height());
    const std::size_t row = pixels.row(0).size_bytes(), step = row + 64;
    m->step = static_cast<std::uint32_t>(step);
    m->data.resize(step * m->height);
    for (int y = 0; y != pixels.height(); ++y)
      std::memcpy(m->data.data() + static_cast<std::size_t>(y) * step, pixels.row(y).data(), row);
    return m;
  }
};
}  // namespace message_filters
