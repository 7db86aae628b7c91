// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stage.hpp"

#include <chrono>
#include <map>
#include <string>

#include <orbis/slam/rgbd_system.hpp>

#include "interrupts.hpp"

namespace app {
namespace {

using orbis::se3;
using orbis::slam::map_id;
using slam_system = orbis::slam::rgbd_system<decltype(orbis::camera::camera_settings::model)>;

orbis::slam::options options_for(const frame_source& source, const settings& s) {
  orbis::slam::options options;
  if (source.camera.baseline) options.bf = *source.camera.baseline * source.camera.model.k().fx;
  options.threads = {.enabled = !s.deterministic && s.threads != 1, .wait = true};
  options.localization_only = s.localize_only;
  return options;
}

/// The ground truth's poses of the frames, by time stamp, where they are known.
using known_poses = std::map<double, se3>;

/// Feeds the frames to SLAM, up to the first that cannot be read, or to Ctrl-C.
known_poses track_frames(slam_system& slam, const frame_source& source, const settings& s, tracked_frames& out,
                         console& console) {
  known_poses truth;
  read_ahead frames{source, s.threads != 1};
  for (std::size_t i = 0; frames.has_next() && !interrupts::requested(); ++i) {
    const auto frame = frames.next();
    if (!frame) {
      out.stopped = frame.error();
      break;
    }
    const auto start = console::clock::now();
    const orbis::slam::track_result found = slam.track(*frame);
    const std::chrono::duration<double, std::milli> took = console::clock::now() - start;
    out.slam.tracking_ms.push_back(took.count());
    if (found.state == orbis::slam::track_state::lost) {
      auto& lost = out.slam.lost_stretches;
      if (lost.empty() || lost.back().first + lost.back().count != i) lost.push_back({i, 0});
      ++lost.back().count;
    }
    if (frame->T_world_camera) truth.emplace(frame->timestamp, *frame->T_world_camera);
    if (found.keyframe) out.keyframes.add(i, {found.map, *found.keyframe}, *frame);
    console.advance(i + 1, source.frames,
                    std::string{to_string(found.state)} + ", " + std::to_string(out.keyframes.size()) + " keyframes");
  }
  return truth;
}

/// Takes over the active map and what was found out, in the world that `T_world_slam` makes of the map's.
void collect(const slam_system& slam, const se3& T_world_slam, tracked_frames& out) {
  out.slam.trajectory = slam.trajectory();
  out.slam.keyframes = slam.keyframe_trajectory();
  for (orbis::trajectory* poses : {&out.slam.trajectory, &out.slam.keyframes})
    for (orbis::stamped_pose& p : *poses) p.T_world_camera = T_world_slam * p.T_world_camera;
  // Keyframes have moved since they were made, and some are in maps that were never joined with this one. Those that
  // were culled were redundant to the landmarks, not to the dense cloud.
  slam.inspect([&](const orbis::slam::atlas& maps) {
    out.keyframes.place([&](const orbis::slam::map_keyframe& made) -> std::optional<se3> {
      const orbis::slam::map_keyframe now = maps.current(made);
      if (now.map != maps.active_id()) return std::nullopt;
      return T_world_slam * maps.active().pose_of(now.keyframe);
    });
  });
  const orbis::slam::track_counters counters = slam.counters();
  out.slam.frames = counters.frames;
  out.slam.tracked = counters.tracked;
  out.slam.lost = counters.lost;
  out.slam.relocalized = counters.relocalized;
  out.slam.loops_closed = counters.loops_closed;
  out.slam.maps_merged = counters.maps_merged;
  out.slam.keyframes_culled = counters.keyframes_culled;
  out.slam.landmarks = slam.landmark_count();
}

/// Saves the active map in the world of the trajectory that is written beside it.
orbis::result<void> save_map(const slam_system& slam, const se3& T_world_slam, const std::filesystem::path& path) {
  orbis::slam::map map = slam.inspect([](const orbis::slam::atlas& maps) { return maps.active(); });
  map.transform(T_world_slam);
  return orbis::slam::write_map(path, map);
}

bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

std::string in_words(const slam_results& slam) {
  const auto count = [](std::size_t n, const char* what) {
    return n == 0 ? std::string{} : ", " + std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  };
  return std::to_string(slam.tracked) + " of " + std::to_string(slam.frames) + " frames, " +
         std::to_string(slam.keyframes.size()) + " keyframes, " + std::to_string(slam.landmarks) + " landmarks" +
         count(slam.loops_closed, "loop") + count(slam.maps_merged, "merged map");
}

}  // namespace

orbis::result<tracked_frames> track(const frame_source& source, const settings& s,
                                    const std::filesystem::path& landmark_map, console& console) {
  console.stage("tracking");
  slam_system slam{source.camera.model, options_for(source, s)};
  if (!s.load_map.empty())
    if (auto loaded = slam.load_map(s.load_map); !loaded) return orbis::fail(loaded.error());
  const map_id first_map = slam.active_map();

  tracked_frames out{.slam = {}, .keyframes = posed_frames{source}, .stopped = {}, .unsaved = {}};
  interrupts::keep_results(s.quiet
                               ? ""
                               : "\nrgbd_slam: stopping; what was reached is mapped and written. Once more: stop at "
                                 "once, and leave the folder as it was\n");
  const known_poses truth = track_frames(slam, source, s, out, console);
  slam.wait();

  // The results are about the loaded map where the camera was found in it, else about the one with the most frames.
  const map_id begun = slam.inspect([&](const orbis::slam::atlas& maps) { return maps.current({first_map, 0}).map; });
  const bool goes_on = !s.load_map.empty() && !slam.trajectory(begun).empty();
  slam.activate(goes_on ? begun : slam.largest_map());
  out.missed_map = !s.load_map.empty() && !goes_on;

  // SLAM's world is that of its first camera, or of the map that was loaded; ours is the ground truth's where that is
  // known, and no map says otherwise. This is a choice of the world frame alone.
  se3 T_world_slam;
  if (const orbis::trajectory poses = slam.trajectory(); !poses.empty() && !goes_on)
    if (const auto at = truth.find(poses.front().timestamp); at != truth.end())
      T_world_slam = at->second * poses.front().T_world_camera.inverse();
  collect(slam, T_world_slam, out);
  out.slam.seconds = console.elapsed();
  console.finish(in_words(out.slam));

  // A map that was missed is not replaced by one without it.
  const bool spares_loaded = out.missed_map && is_same_file(s.load_map, s.save_map);
  if (!s.save_map.empty() && !out.slam.trajectory.empty() && !spares_loaded) {
    console.stage("saving");
    if (auto saved = save_map(slam, T_world_slam, landmark_map))
      console.finish(s.save_map.string());
    else
      out.unsaved = saved.error();
  }
  return out;
}

orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source) {
  orbis::error e = *tracked.stopped;
  e.message += "; stopped after " + std::to_string(tracked.slam.frames) + " of " + std::to_string(source.frames) +
               " frames, what they gave is kept";
  return e;
}

orbis::error explain_miss(const tracked_frames& tracked, const settings& s) {
  std::string message = "the camera was never found in this map: none of " + std::to_string(tracked.slam.frames) +
                        " frames shows a place that it knows";
  if (tracked.slam.tracked != 0) message += "; the results are those of a map of their own";
  if (tracked.slam.tracked != 0 && is_same_file(s.load_map, s.save_map)) message += ", which was not saved over it";
  return {orbis::errc::no_data, s.load_map.string(), std::move(message)};
}

std::vector<std::string> tracking_notes(const tracked_frames& tracked, const settings& s) {
  std::vector<std::string> notes;
  if (const std::size_t here = tracked.slam.trajectory.size(); here < tracked.slam.tracked)
    notes.push_back(std::to_string(tracked.slam.tracked - here) + " of " + std::to_string(tracked.slam.tracked) +
                    " tracked frames are left out: tracking was lost, and where it began anew was never joined with "
                    "the rest");
  if (!s.localize_only && tracked.slam.tracked != 0 && tracked.keyframes.size() == 0)
    notes.emplace_back("no cloud and no octree: the loaded map shows all that was seen, so no frame became a keyframe");
  return notes;
}

}  // namespace app
