// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Images as messages in a ROS 1 bag, written with the library itself.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

#include <rosbag/bag.h>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/image.hpp>

#include "inputs/ros_messages.hpp"

namespace orbis::test {

class ros_bag_writer {
 public:
  explicit ros_bag_writer(const std::filesystem::path& path,
                          rosbag::CompressionType compression = rosbag::compression::Uncompressed)
      : bag_{path.string(), rosbag::bagmode::Write} {
    bag_.setCompression(compression);
  }

  template <class T>
  void image(const std::string& topic, double time, const std::string& encoding, image_view<const T> pixels) {
    app::ros_messages::image m;
    set_time(m.header, time);
    m.width = static_cast<std::uint32_t>(pixels.width());
    m.height = static_cast<std::uint32_t>(pixels.height());
    m.encoding = encoding;
    m.step = static_cast<std::uint32_t>(m.width * sizeof(T)) + 4;  // rows may be longer than their pixels
    m.data.resize(std::size_t{m.step} * m.height);
    for (std::uint32_t y = 0; y != m.height; ++y)
      std::memcpy(&m.data[std::size_t{y} * m.step], &pixels(0, static_cast<int>(y)), m.width * sizeof(T));
    write(topic, time, m);
  }
  /// `bx`: the right camera's focal length times the baseline.
  void info(const std::string& topic, double time, const camera::intrinsics& k, double bx = 0.0,
            const std::vector<double>& distortion = {0, 0, 0, 0, 0}) {
    app::ros_messages::camera_info m;
    set_time(m.header, time);
    m.width = static_cast<std::uint32_t>(k.width);
    m.height = static_cast<std::uint32_t>(k.height);
    m.distortion_model = "plumb_bob";
    m.D = distortion;
    m.K = {k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1};
    m.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    m.P = {k.fx, 0, k.cx, -bx, 0, k.fy, k.cy, 0, 0, 0, 1, 0};
    write(topic, time, m);
  }
  template <class Message>
  void write(const std::string& topic, double time, const Message& m) {
    bag_.write(topic, ros::Time(time + 100.0), m);  // recorded later than it was taken
  }
  static void set_time(app::ros_messages::header& h, double time) {
    const ros::Time t(time);
    h.sec = t.sec;
    h.nsec = t.nsec;
  }
  void close() { bag_.close(); }

 private:
  rosbag::Bag bag_;
};

}  // namespace orbis::test
