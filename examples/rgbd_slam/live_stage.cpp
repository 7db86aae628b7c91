// SPDX-License-Identifier: BSD-3-Clause
#include "live_stage.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "interrupts.hpp"
#include "priority.hpp"

namespace app {
namespace {

using orbis::mapping::depth_use;
using pixels_view = orbis::camera::depth_view<std::uint16_t>;

orbis::mapping::live_map_thread_options thread_options(const settings& s) {
  orbis::mapping::live_map_thread_options options;
  options.map.resolution = s.resolution;
  options.correction_slice = std::chrono::milliseconds{2};  // maximum time for which a keyframe waits
  if (s.map_every_frame) options.map.max_frames = 90;
  if (s.threads == 1) options.poll_interval = std::chrono::hours{24};  // waiting callers trigger the poll
  options.moving.emplace();
  return options;
}

}  // namespace

live_mapping::live_mapping(const frame_source& source, const settings& s, keyframe_depths& depths, find_poses where)
    : where_{std::move(where)},
      depth_scale_{source.camera.depth_scale},
      waits_{s.threads == 1},
      rays_{source.camera.model},
      points_{point_options(dense_options(source, s))},
      live_{source.camera.model,
            thread_options(s),
            {.started = [] { lower_priority(live_map_niceness); },
             .poll_poses = [this](poses& now, bool always) { return poll(now, always); },
             .prepare =
                 [this](std::uint64_t, depth_use, orbis::image_view<std::uint16_t> pixels) {
                   reader_.mask(orbis::seq, pixels_view{pixels, depth_scale_}, rays_, points_, pixels);
                 },
             .inserted = [this](const orbis::mapping::insertion_event& e) { note(e); },
             .overflowed = {},
             .refused = {},
             .corrected =
                 [this](const orbis::mapping::live_correction_event& e) {
                   const std::lock_guard lock{results_mutex_};
                   results_.correction_ms.push_back(e.milliseconds);
                 },
             .published = {},
             .failed =
                 [this](const orbis::error& e) {
                   const std::lock_guard lock{results_mutex_};
                   results_.depth_error = e;
                 }},
            live_depths{depths}} {}

std::vector<live_mapping::made> live_mapping::inserted() const {
  const std::lock_guard lock{mutex_};
  return made_;
}

bool live_mapping::poll(poses& now, bool always) {
  {
    const std::lock_guard lock{where_mutex_};
    if (!where_ || !where_(inserted(), now, always)) return false;
  }
  if (!now.removed.empty()) {
    const std::lock_guard lock{mutex_};
    std::erase_if(made_, [&](const made& k) {
      return std::find(now.removed.begin(), now.removed.end(), k.frame) != now.removed.end();
    });
  }
  return true;
}

void live_mapping::note(const orbis::mapping::insertion_event& e) {
  const std::lock_guard lock{results_mutex_};
  if (!e.is_keyframe) {
    results_.frame_delay_ms.push_back(e.delay_milliseconds);
    return;
  }
  results_.insert_ms.push_back(e.milliseconds);
  results_.delay_ms.push_back(e.delay_milliseconds);
  const std::size_t newest = newest_;
  if (newest > e.frame) results_.behind_frames_max = std::max(results_.behind_frames_max, newest - e.frame);
}

void live_mapping::add(std::size_t frame, orbis::slam::map_keyframe keyframe, const orbis::se3& T_world_camera,
                       const orbis::image<std::uint16_t>& depth) {
  {
    const std::lock_guard lock{mutex_};
    made_.push_back({frame, keyframe});
  }
  live_.add_keyframe(frame, pixels_view{depth, depth_scale_}, T_world_camera);
  // The map's thread may have removed the keyframe from made_ before the keyframe was in the map.
  if (!find([&](const made& k) { return k.frame == frame; })) live_.remove(frame);
  if (waits_) live_.wait();
}

void live_mapping::add_frame(std::size_t frame, std::uint64_t reference, const orbis::se3& T_reference_camera,
                             const orbis::image<std::uint16_t>& depth) {
  live_.add_frame(frame, pixels_view{depth, depth_scale_}, reference, T_reference_camera);
  if (waits_) live_.wait();
}

live_results live_mapping::so_far() const {
  const orbis::mapping::live_map_counters counters = live_.counters();
  live_results results;
  {
    const std::lock_guard lock{results_mutex_};
    results = results_;
  }
  results.dropped = counters.dropped_keyframes;
  results.frames = counters.frames;
  results.dropped_frames = counters.dropped_frames;
  results.refused_frames = counters.refused_frames;
  results.stopped = live_.failure();
  return results;
}

bool live_mapping::occupied_since(std::optional<std::uint64_t>& seen, std::vector<voxel>& cubes) const {
  const auto newest = live_.latest();
  if (seen == newest->revision || interrupts::stop_requested()) return false;
  std::vector<voxel> occupied;
  newest->map.for_each_leaf([&](const live_octree::octree_type::leaf& leaf) {
    if (leaf.occupied && !interrupts::stop_requested())
      occupied.push_back({leaf.center.cast<float>(), static_cast<float>(leaf.size)});
  });
  if (interrupts::stop_requested()) return false;
  seen = newest->revision;
  cubes = std::move(occupied);
  return true;
}

void live_mapping::leave() {
  {
    const std::lock_guard lock{where_mutex_};
    where_ = {};
  }
  live_.request_stop();
}

live_octree* live_mapping::stop() {
  leave();
  live_octree& map = live_.stop();
  return live_.failure() ? nullptr : &map;
}

std::vector<std::string> live_notes(const live_results& live) {
  std::vector<std::string> notes;
  const auto count = [](std::size_t n, const char* what) {
    return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  };
  if (live.dropped != 0)
    notes.push_back(count(live.dropped, "keyframe") +
                    " arrived faster than the live map could insert them; the final map contains them");
  if (live.dropped_frames != 0)
    notes.push_back(count(live.dropped_frames, "frame") +
                    " between keyframes arrived faster than the live map could insert them, and were omitted");
  if (live.stopped)
    notes.push_back("the live map stopped: " + live.stopped->message + "; the octree is built at the end instead");
  else if (live.depth_error)
    notes.push_back(live.depth_error->to_string());
  return notes;
}

}  // namespace app
