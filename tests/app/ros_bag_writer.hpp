// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Writes ROS 1 bags of one uncompressed chunk, with index. Shares no code with the reader.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/image.hpp>

namespace orbis::test {

class ros_bag_writer {
 public:
  explicit ros_bag_writer(std::filesystem::path path) : path_{std::move(path)} {}

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
    write(topic, "sensor_msgs/Image", time,
          header(time) + number(height) + number(width) + text(encoding) + '\0' + number(step) + text(data));
  }
  void compressed(const std::string& topic, double time, const std::string& format, const std::string& data) {
    write(topic, "sensor_msgs/CompressedImage", time, header(time) + text(format) + text(data));
  }
  /// `bx`: the right camera's focal length times the baseline.
  void info(const std::string& topic, double time, const camera::intrinsics& k, double bx = 0.0,
            const std::vector<double>& distortion = {0, 0, 0, 0, 0}) {
    std::string m = header(time) + number(k.height) + number(k.width) + text("plumb_bob") + number(distortion.size());
    for (const double v : distortion) append(m, v);
    for (const double v : {k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0}) append(m, v);
    for (const double v : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) append(m, v);
    for (const double v : {k.fx, 0.0, k.cx, -bx, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0}) append(m, v);
    write(topic, "sensor_msgs/CameraInfo", time, m + std::string(25, '\0'));  // no binning, no region
  }

  void close() {
    std::string all = "#ROSBAG V2.0\n", indices, definitions;
    for (const auto& [name, t] : topics_) {
      std::string entries;
      for (const auto& [when, at] : t.messages) entries += when + number(at);
      indices += record(
          {{"op", "\x04"}, {"ver", number(1)}, {"conn", number(t.id)}, {"count", number(t.messages.size())}}, entries);
      definitions += record({{"op", "\x07"}, {"conn", number(t.id)}, {"topic", name}},
                            fields({{"topic", name}, {"type", t.type}, {"md5sum", "*"}, {"message_definition", ""}}));
    }
    const std::string chunk =
        record({{"op", "\x05"}, {"compression", "none"}, {"size", number(chunk_.size())}}, chunk_);
    std::string position;
    append(position, static_cast<std::uint64_t>(all.size() + 4096 + chunk.size() + indices.size()));
    const std::string head = fields(
        {{"op", "\x03"}, {"index_pos", position}, {"conn_count", number(topics_.size())}, {"chunk_count", number(1)}});
    all += text(head) + text(std::string(4096 - 8 - head.size(), ' ')) + chunk + indices + definitions;
    std::ofstream{path_, std::ios::binary}.write(all.data(), static_cast<std::streamsize>(all.size()));
  }

 private:
  struct topic_messages {
    std::size_t id;
    std::string type;
    std::vector<std::pair<std::string, std::size_t>> messages;  // time and position
  };

  template <class T>
  static void append(std::string& to, T value) {  // the tests run on little-endian machines
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  static std::string number(T value) {
    std::string bytes;
    append(bytes, static_cast<std::uint32_t>(value));
    return bytes;
  }
  static std::string text(const std::string& t) { return number(t.size()) + t; }
  static std::string stamp(double time) {
    const double whole = std::floor(time);
    return number(whole) + number(std::lround((time - whole) * 1e9));
  }
  static std::string header(double time) { return number(7) + stamp(time) + text("camera"); }
  static std::string fields(const std::vector<std::pair<std::string, std::string>>& all) {
    std::string bytes;
    for (const auto& [name, value] : all) bytes += text(name + "=" + value);
    return bytes;
  }
  static std::string record(const std::vector<std::pair<std::string, std::string>>& head, const std::string& data) {
    return text(fields(head)) + text(data);
  }
  void write(const std::string& topic, const std::string& type, double time, const std::string& message) {
    topic_messages& t = topics_.try_emplace(topic, topic_messages{topics_.size(), type, {}}).first->second;
    const std::string recorded = stamp(time + 100.0);  // later than it was taken
    t.messages.emplace_back(recorded, chunk_.size());
    chunk_ += record({{"op", "\x02"}, {"conn", number(t.id)}, {"time", recorded}}, message);
  }

  std::filesystem::path path_;
  std::string chunk_;
  std::map<std::string, topic_messages> topics_;
};

}  // namespace orbis::test
