// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Writes bags: of ROS 1 with one uncompressed chunk and an index, or of ROS 2 as MCAP without chunks. Shares no code
/// with the reader.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::test {

/// Fields of a message: packed (ROS 1), or aligned after four bytes for the byte order (ROS 2).
class ros_message {
 public:
  explicit ros_message(int version) : version_{version}, bytes_(version == 2 ? std::string{"\0\1\0\0", 4} : "") {}
  template <class T>
  ros_message& number(T value) {  // the tests run on little-endian machines
    while (version_ == 2 && bytes_.size() % sizeof(T) != 4 % sizeof(T)) bytes_ += '\0';
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  ros_message& numbers(const std::vector<double>& values) {
    for (const double v : values) number(v);
    return *this;
  }
  ros_message& data(const std::string& bytes) {
    number(static_cast<std::uint32_t>(bytes.size()));
    bytes_ += bytes;
    return *this;
  }
  ros_message& text(const std::string& t) { return data(version_ == 2 ? t + '\0' : t); }
  ros_message& header(double time, const std::string& frame) {
    if (version_ == 1) number(std::uint32_t{7});
    const double whole = std::floor(time);
    number(static_cast<std::uint32_t>(whole)).number(static_cast<std::uint32_t>(std::lround((time - whole) * 1e9)));
    return text(frame);
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  int version_;
  std::string bytes_;
};

class ros_bag_writer {
 public:
  explicit ros_bag_writer(std::filesystem::path path, int version = 1) : path_{std::move(path)}, version_{version} {}

  std::string frame = "camera";  ///< of the following images and cameras

  template <class T>
  void image(const std::string& topic, double time, const std::string& encoding, image_view<const T> pixels) {
    const std::size_t row = static_cast<std::size_t>(pixels.width()) * sizeof(T);
    std::string data;
    for (int y = 0; y != pixels.height(); ++y)  // rows may be longer than their pixels
      data.append(reinterpret_cast<const char*>(&pixels(0, y)), row).append(4, '\0');
    image(topic, time, encoding, pixels.width(), pixels.height(), row + 4, data);
  }
  void image(const std::string& topic, double time, const std::string& encoding, int width, int height,
             std::size_t step, const std::string& data) {
    ros_message m = begin(time);
    m.number(height).number(width).text(encoding).number('\0').number(static_cast<std::uint32_t>(step)).data(data);
    write(topic, "sensor_msgs/Image", time, m);
  }
  void compressed(const std::string& topic, double time, const std::string& format, const std::string& data) {
    write(topic, "sensor_msgs/CompressedImage", time, begin(time).text(format).data(data));
  }
  void number(const std::string& topic, double time, float value) {
    write(topic, "std_msgs/Float32", time, ros_message{version_}.number(value));
  }
  std::string distortion_model = "plumb_bob";  ///< of the following cameras
  /// `bx`: the right camera's focal length times the baseline.
  void info(const std::string& topic, double time, const camera::intrinsics& k, double bx = 0.0,
            const std::vector<double>& distortion = {0, 0, 0, 0, 0}) {
    ros_message m = begin(time);
    m.number(k.height).number(k.width).text(distortion_model);
    m.number(static_cast<std::uint32_t>(distortion.size())).numbers(distortion);
    m.numbers({k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0}).numbers({1, 0, 0, 0, 1, 0, 0, 0, 1});
    m.numbers({k.fx, 0.0, k.cx, -bx, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
    for (int i = 0; i != 6; ++i) m.number(0);  // no binning, no region
    write(topic, "sensor_msgs/CameraInfo", time, m.number('\0'));
  }
  void transform(const std::string& topic, double time, const std::string& child, const se3& T_frame_child) {
    ros_message m{version_};
    m.number(std::uint32_t{1}).header(time, frame).text(child);
    write(topic, "tf2_msgs/TFMessage", time, m.numbers(numbers_of(T_frame_child)));
  }
  /// The pose of the frame "camera" in "world".
  void odometry(const std::string& topic, double time, const se3& T_world_camera) {
    ros_message m{version_};
    m.header(time, "world").text("camera").numbers(numbers_of(T_world_camera));
    write(topic, "nav_msgs/Odometry", time, m.numbers(std::vector<double>(36 + 6 + 36)));
  }

  void close() {
    const std::string all = version_ == 2 ? mcap() : rosbag1();
    std::ofstream{path_, std::ios::binary}.write(all.data(), static_cast<std::streamsize>(all.size()));
  }

 private:
  struct topic_messages {
    std::size_t id;
    std::string type;
    std::vector<std::pair<double, std::string>> messages;  // time of the recording
  };

  [[nodiscard]] ros_message begin(double time) const {
    ros_message m{version_};
    return m.header(time, frame);
  }
  static std::vector<double> numbers_of(const se3& pose) {
    const vec3& t = pose.translation();
    const auto& q = pose.rotation().unit_quaternion();
    return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
  }
  void write(const std::string& topic, const std::string& type, double time, const ros_message& m) {
    topic_messages& t = topics_.try_emplace(topic, topic_messages{topics_.size(), type, {}}).first->second;
    t.messages.emplace_back(time + 100.0, m.bytes());  // later than it was taken
  }

  template <class T>
  static std::string bytes_of(T value) {
    return ros_message{1}.number(value).bytes();
  }
  static std::string number(std::size_t value) { return bytes_of(static_cast<std::uint32_t>(value)); }
  static std::string text(const std::string& t) { return number(t.size()) + t; }

  [[nodiscard]] std::string mcap() const {
    const std::string magic = "\x89MCAP0\r\n";
    const auto record = [](char code, const std::string& fields) {
      return code + bytes_of(std::uint64_t{fields.size()}) + fields;
    };
    const auto id_of = [](const topic_messages& t) { return bytes_of(static_cast<std::uint16_t>(t.id + 1)); };
    std::string all = magic + record(1, text("ros2") + text(""));
    for (const auto& [name, t] : topics_) {
      std::string type = t.type;
      type.replace(type.find('/'), 1, "/msg/");
      all += record(3, id_of(t) + text(type) + text("ros2msg") + text(""));
      all += record(4, id_of(t) + id_of(t) + text(name) + text("cdr") + text(""));
      for (const auto& [time, message] : t.messages) {
        const std::string when = bytes_of(static_cast<std::uint64_t>(time * 1e9));
        all += record(5, id_of(t) + number(0) + when + when + message);
      }
    }
    return all + record(15, number(0)) + record(2, std::string(20, '\0')) + magic;
  }

  [[nodiscard]] std::string rosbag1() const {
    using pairs = std::vector<std::pair<std::string, std::string>>;
    const auto fields = [](const pairs& all) {
      std::string bytes;
      for (const auto& [name, value] : all) bytes += text(name + "=" + value);
      return bytes;
    };
    const auto record = [&](const pairs& head, const std::string& data) { return text(fields(head)) + text(data); };
    const auto stamp = [](double time) {
      const double whole = std::floor(time);
      return number(static_cast<std::size_t>(whole)) + number(static_cast<std::size_t>((time - whole) * 1e9));
    };
    std::string messages, indices, definitions;
    for (const auto& [name, t] : topics_) {
      const std::string id = number(t.id);
      std::string entries;
      for (const auto& [time, message] : t.messages) {
        entries += stamp(time) + number(messages.size());
        messages += record({{"op", "\x02"}, {"conn", id}, {"time", stamp(time)}}, message);
      }
      indices +=
          record({{"op", "\x04"}, {"ver", number(1)}, {"conn", id}, {"count", number(t.messages.size())}}, entries);
      definitions += record({{"op", "\x07"}, {"conn", id}, {"topic", name}},
                            fields({{"topic", name}, {"type", t.type}, {"md5sum", "*"}, {"message_definition", ""}}));
    }
    const std::string chunk =
        record({{"op", "\x05"}, {"compression", "none"}, {"size", number(messages.size())}}, messages) + indices;
    const std::string magic = "#ROSBAG V2.0\n";
    const std::string of_chunk = record({{"op", "\x06"},
                                         {"ver", number(1)},
                                         {"chunk_pos", bytes_of(std::uint64_t{magic.size() + 4096})},
                                         {"start_time", stamp(0.0)},
                                         {"end_time", stamp(0.0)},
                                         {"count", number(0)}},
                                        "");
    const std::string head = fields({{"op", "\x03"},
                                     {"index_pos", bytes_of(std::uint64_t{magic.size() + 4096 + chunk.size()})},
                                     {"conn_count", number(topics_.size())},
                                     {"chunk_count", number(1)}});
    return magic + text(head) + text(std::string(4096 - 8 - head.size(), ' ')) + chunk + definitions + of_chunk;
  }

  std::filesystem::path path_;
  int version_;
  std::map<std::string, topic_messages> topics_;
};

}  // namespace orbis::test
