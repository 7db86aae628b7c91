// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The SLAM system that the tests run, compiled once for all of them (tested_system.cpp): its users see none of it.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::test {

/// `slam::rgbd_system<camera::any_camera>`, function by function.
class slam_system {
 public:
  explicit slam_system(const camera::any_camera& camera, const slam::options& settings = {});
  ~slam_system();

  void listen(slam::listeners all);
  slam::track_result track(const camera::rgbd_frame& f);
  void wait() const;
  [[nodiscard]] slam::track_state state() const;
  void set_localization_only(bool on);
  void set_initial_pose(const se3& T_world_camera);
  void set_initial_pose(std::function<se3()> find);
  [[nodiscard]] orbis::trajectory trajectory() const;
  [[nodiscard]] orbis::trajectory trajectory(slam::map_id map) const;
  [[nodiscard]] std::vector<slam::keyframe_pose> keyframes() const;
  [[nodiscard]] std::optional<std::vector<slam::keyframe_pose>> keyframes_since(slam::pose_revision& seen) const;
  [[nodiscard]] std::optional<slam::tracked_frame> last_frame() const;
  [[nodiscard]] orbis::trajectory keyframe_trajectory() const;
  [[nodiscard]] std::size_t landmark_count() const;
  [[nodiscard]] slam::track_counters counters() const;
  [[nodiscard]] std::optional<slam::shutter_estimate> estimated_shutter() const;
  [[nodiscard]] slam::map_id active_map() const;
  [[nodiscard]] slam::map_id largest_map() const;
  [[nodiscard]] const slam::map& map() const;
  template <class Read>
  auto inspect(Read&& read) const {
    decltype(read(std::declval<const slam::atlas&>())) answer{};
    look([&](const slam::atlas& a) { answer = read(a); });
    return answer;
  }

 private:
  void look(const std::function<void(const slam::atlas&)>& read) const;
  struct held;
  std::unique_ptr<held> held_;
};

}  // namespace orbis::test
