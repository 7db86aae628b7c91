// SPDX-License-Identifier: BSD-3-Clause
#include "live_stage.hpp"

#include <algorithm>
#include <utility>

namespace app {
namespace {

orbis::mapping::live_map_thread_options thread_options(const settings& s) {
  orbis::mapping::live_map_thread_options options;
  options.map.resolution = s.resolution;
  return options;
}

}  // namespace

live_mapping::live_mapping(const frame_source& source, const settings& s, std::filesystem::path spill_file,
                           find_poses where)
    : where_{std::move(where)},
      depth_scale_{source.camera.depth_scale},
      rays_{source.camera.model},
      live_{
          source.camera.model,
          thread_options(s),
          {.poll_poses = [this](std::vector<pose>& poses, bool always) { return poll(poses, always); },
           .inserted =
               [this](const orbis::mapping::insertion_event& e) {
                 results_.insert_ms.push_back(e.milliseconds);
                 const std::size_t newest = newest_;
                 if (newest > e.frame)
                   results_.behind_frames_max = std::max(results_.behind_frames_max, newest - e.frame);
               },
           .overflowed = {},
           .corrected =
               [this](const orbis::mapping::live_correction_event& e) {
                 results_.correction_ms.push_back(e.milliseconds);
               },
           .published = {},
           .failed = [this](const orbis::error& e) { results_.trouble = e; }},
          orbis::mapping::depth_store{{.memory_budget = std::size_t{32} << 20U, .spill_file = std::move(spill_file)}}} {
  points_ = point_options(dense_options(s));
}

bool live_mapping::poll(std::vector<pose>& poses, bool always) {
  std::vector<made> known;
  {
    const std::lock_guard lock{mutex_};
    known = made_;
  }
  return where_(known, poses, always);
}

void live_mapping::add(std::size_t frame, orbis::slam::map_keyframe keyframe, const orbis::se3& T_world_camera,
                       const orbis::camera::rgbd_frame& image) {
  {
    const std::lock_guard lock{mutex_};
    made_.push_back({frame, keyframe});
  }
  const orbis::camera::depth_view<std::uint16_t> depth{image.depth, depth_scale_};
  const auto masked = reader_.masked(orbis::seq, depth, rays_, points_);
  live_.add_keyframe(frame, orbis::mapping::view_like(depth, masked.view()), T_world_camera);
}

void live_mapping::stop() {
  live_.wait();
  live_.stop();
  results_.dropped = live_.counters().dropped_keyframes;
}

}  // namespace app
