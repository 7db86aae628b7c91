// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The messages of ROS 1 bags for images, as `sensor_msgs` defines them: fields, and the traits that rosbag_storage
/// needs to read and write them. (The headers that ROS generates for them are not valid C++20.)
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include <boost/array.hpp>
#include <ros/message_traits.h>
#include <ros/serialization.h>

namespace app::ros_messages {

struct header {
  std::uint32_t seq = 0, sec = 0, nsec = 0;
  std::string frame_id;
};

/// The time of any message that begins with a header; the rest is skipped.
struct stamp {
  std::uint32_t seq = 0, sec = 0, nsec = 0;
};

struct image {
  ros_messages::header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes in a row
  std::vector<std::uint8_t> data;
};

struct compressed_image {
  ros_messages::header header;
  std::string format;
  std::vector<std::uint8_t> data;
};

struct camera_info {
  ros_messages::header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> D;
  boost::array<double, 9> K{}, R{};
  boost::array<double, 12> P{};
  std::uint32_t binning_x = 0, binning_y = 0;
  std::uint32_t roi_x_offset = 0, roi_y_offset = 0, roi_height = 0, roi_width = 0;
  std::uint8_t roi_do_rectify = 0;
};

/// The name of a message type and the checksum of its definition.
template <class Message>
struct identity;
template <>
struct identity<stamp> {
  static constexpr const char *type = "*", *md5 = "*";
};
template <>
struct identity<image> {
  static constexpr const char *type = "sensor_msgs/Image", *md5 = "060021388200f6f0f447d0fcd9c64743";
};
template <>
struct identity<compressed_image> {
  static constexpr const char *type = "sensor_msgs/CompressedImage", *md5 = "8f7a12909da2c9d3332d540a0977563f";
};
template <>
struct identity<camera_info> {
  static constexpr const char *type = "sensor_msgs/CameraInfo", *md5 = "c9a58c1b0b154e0e6da7578cb991d214";
};

template <class Message>
concept known = requires {
  identity<Message>::md5;
};

/// A list of numbers, after their count. (The library's serialiser of vectors is not valid C++20.)
template <class T>
void list_of(ros::serialization::IStream& s, std::vector<T>& values) {
  std::uint32_t count = 0;
  s.next(count);
  if (count > s.getLength() / sizeof(T)) ros::serialization::throwStreamOverrun();
  const auto bytes = static_cast<std::uint32_t>(count * sizeof(T));
  const std::uint8_t* from = s.advance(bytes);
  values.resize(count);
  if (count != 0) std::memcpy(values.data(), from, bytes);
}
template <class Stream, class T>
void list_of(Stream& s, const std::vector<T>& values) {
  const auto count = static_cast<std::uint32_t>(values.size());
  const auto bytes = static_cast<std::uint32_t>(count * sizeof(T));
  s.next(count);
  [[maybe_unused]] auto to = s.advance(bytes);
  if constexpr (std::is_same_v<Stream, ros::serialization::OStream>)
    if (count != 0) std::memcpy(to, values.data(), bytes);
}

/// All fields of a message, in order.
template <class Stream, class Header>
void fields_of_header(Stream& s, Header& h) {
  s.next(h.seq), s.next(h.sec), s.next(h.nsec), s.next(h.frame_id);
}
template <class Stream, class Message>
void fields(Stream& s, Message& m) requires requires {
  m.encoding;
}
{
  fields_of_header(s, m.header);
  s.next(m.height), s.next(m.width), s.next(m.encoding), s.next(m.is_bigendian), s.next(m.step), list_of(s, m.data);
}
template <class Stream, class Message>
void fields(Stream& s, Message& m) requires requires {
  m.format;
}
{
  fields_of_header(s, m.header);
  s.next(m.format), list_of(s, m.data);
}
template <class Stream, class Message>
void fields(Stream& s, Message& m) requires requires {
  m.distortion_model;
}
{
  fields_of_header(s, m.header);
  s.next(m.height), s.next(m.width), s.next(m.distortion_model), list_of(s, m.D), s.next(m.K), s.next(m.R), s.next(m.P);
  s.next(m.binning_x), s.next(m.binning_y), s.next(m.roi_x_offset), s.next(m.roi_y_offset), s.next(m.roi_height);
  s.next(m.roi_width), s.next(m.roi_do_rectify);
}
template <class Stream>
void fields(Stream& s, stamp& m) {
  s.next(m.seq), s.next(m.sec), s.next(m.nsec);
}

}  // namespace app::ros_messages

namespace ros {

template <app::ros_messages::known Message>
struct message_traits::MD5Sum<Message> {
  static const char* value() { return app::ros_messages::identity<Message>::md5; }
  static const char* value(const Message&) { return value(); }
};
template <app::ros_messages::known Message>
struct message_traits::DataType<Message> {
  static const char* value() { return app::ros_messages::identity<Message>::type; }
  static const char* value(const Message&) { return value(); }
};
template <app::ros_messages::known Message>
struct message_traits::Definition<Message> {
  static const char* value() { return app::ros_messages::identity<Message>::type; }
  static const char* value(const Message&) { return value(); }
};
template <app::ros_messages::known Message>
struct serialization::Serializer<Message> {
  template <class Stream>
  static void read(Stream& stream, Message& m) {
    app::ros_messages::fields(stream, m);
  }
  template <class Stream>
  static void write(Stream& stream, const Message& m) {
    app::ros_messages::fields(stream, m);
  }
  static std::uint32_t serializedLength(const Message& m) {
    LStream stream;
    app::ros_messages::fields(stream, m);
    return stream.getLength();
  }
};

}  // namespace ros
