// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2's client library: just the names that the tutorial uses, with the signatures of Humble and Jazzy.
/// `spin` plays a few frames; `shutdown` ends the program with an error if what was published is not sound.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nav_msgs/msg/occupancy_grid.hpp>
#include <octomap_msgs/msg/octomap.hpp>
#include <std_msgs/msg/header.hpp>

#include "../synthetic_camera.hpp"

struct rmw_qos_profile_t {};
inline constexpr rmw_qos_profile_t rmw_qos_profile_default{}, rmw_qos_profile_sensor_data{};

namespace stubs {

/// What happens while a node spins, and what it has published.
struct middleware {
  std::vector<std::function<void(std::size_t)>> frame_callbacks;
  std::vector<std::function<void()>> timers;
  std::size_t transforms = 0, grids = 0, octrees = 0;
  bool failed = false;
  static middleware& instance() {
    static middleware m;
    return m;
  }
  void expect(bool sound, const char* what) {
    if (sound) return;
    std::fprintf(stderr, "stub: unsound %s\n", what);
    failed = true;
  }
  void take(const nav_msgs::msg::OccupancyGrid& m) {
    ++grids;
    expect(!m.data.empty() && m.data.size() == std::size_t{m.info.width} * m.info.height, "occupancy grid");
  }
  void take(const octomap_msgs::msg::Octomap& m) {
    octrees += m.data.empty() ? 0 : 1;  // the map is empty at first
    expect(m.binary && m.id == "OcTree" && m.resolution > 0.0 && m.data.size() % 2 == 0, "octree");
  }
};

}  // namespace stubs

namespace rclcpp {

class Time {
 public:
  Time(const builtin_interfaces::msg::Time& t) : t_{t} {}  // NOLINT(google-explicit-constructor)
  [[nodiscard]] double seconds() const { return t_.sec + 1e-9 * t_.nanosec; }
  operator builtin_interfaces::msg::Time() const { return t_; }  // NOLINT(google-explicit-constructor)

 private:
  builtin_interfaces::msg::Time t_;
};

class QoS {
 public:
  explicit QoS(std::size_t) {}
  QoS& transient_local() { return *this; }
};

class Logger {};
class TimerBase {
 public:
  using SharedPtr = std::shared_ptr<TimerBase>;
};

template <class Message>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const Message& message) { stubs::middleware::instance().take(message); }
};

class Node {
 public:
  explicit Node(const std::string&) {}
  [[nodiscard]] Time now() const { return {builtin_interfaces::msg::Time{}}; }
  [[nodiscard]] Logger get_logger() const { return {}; }
  template <class Message>
  typename Publisher<Message>::SharedPtr create_publisher(const std::string&, const QoS&) {
    return std::make_shared<Publisher<Message>>();
  }
  template <class Rep, class Period, class Callback>
  TimerBase::SharedPtr create_wall_timer(std::chrono::duration<Rep, Period>, Callback callback) {
    stubs::middleware::instance().timers.emplace_back(std::move(callback));
    return std::make_shared<TimerBase>();
  }
};

inline void init(int, const char* const*) {}
template <class T>
void spin(const std::shared_ptr<T>&) {
  auto& m = stubs::middleware::instance();
  const auto tick = [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    for (const auto& t : m.timers) t();
  };
  for (std::size_t i = 0; i != stubs::camera().size(); ++i) {
    for (const auto& f : m.frame_callbacks) f(i);
    tick();
  }
  for (int i = 0; i != 500 && (m.grids == 0 || m.octrees == 0); ++i) tick();
}
inline bool shutdown() {
  auto& m = stubs::middleware::instance();
  m.expect(m.transforms == stubs::camera().size(), "number of transforms");
  m.expect(m.grids != 0 && m.octrees != 0, "number of maps");
  if (m.failed) std::exit(1);
  return true;
}

}  // namespace rclcpp

#define RCLCPP_WARN_ONCE(logger, ...) ((void)(logger), std::fprintf(stderr, __VA_ARGS__), std::fputc('\n', stderr))
