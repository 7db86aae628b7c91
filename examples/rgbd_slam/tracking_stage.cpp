// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stage.hpp"

#include <chrono>
#include <string>
#include <utility>

#include <orbis/slam/rgbd_system.hpp>

#include "interrupts.hpp"
#include "upright_world.hpp"

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

/// Feeds the frames to SLAM, up to the first that cannot be read, or to Ctrl-C. Every map begins in a world of its own.
upright_worlds track_frames(slam_system& slam, const frame_source& source, const settings& s, tracked_frames& out,
                            console& console) {
  using orbis::slam::track_state;
  upright_worlds worlds{source, s};
  read_ahead frames{source, s.threads != 1};
  for (std::size_t i = 0; frames.has_next() && !interrupts::requested(); ++i) {
    const auto frame = frames.next();
    if (!frame) {
      out.stopped = frame.error();
      break;
    }
    if (const track_state state = slam.state(); state == track_state::not_started || state == track_state::lost)
      slam.set_initial_pose(worlds.begin_with(*frame, state == track_state::not_started));
    const auto start = console::clock::now();
    const orbis::slam::track_result found = slam.track(*frame);
    const std::chrono::duration<double, std::milli> took = console::clock::now() - start;
    out.slam.tracking_ms.push_back(took.count());
    if (found.state == track_state::lost) {
      auto& lost = out.slam.lost_stretches;
      if (lost.empty() || lost.back().first + lost.back().count != i) lost.push_back({i, 0});
      ++lost.back().count;
    }
    if (found.keyframe) out.keyframes.add(i, {found.map, *found.keyframe}, *frame);
    if (out.live) out.live->tracked(i);
    if (out.live && found.keyframe && found.T_world_camera)
      out.live->add(i, {found.map, *found.keyframe}, *found.T_world_camera, *frame);
    console.advance(i + 1, source.frames,
                    std::string{to_string(found.state)} + ", " + std::to_string(out.keyframes.size()) + " keyframes");
  }
  return worlds;
}

/// The pose of a keyframe that was made in the active map or in one that was merged with it. Keyframes have moved since
/// they were made; those that were culled were redundant to the landmarks, not to the dense cloud and the octree.
std::optional<se3> present_pose(const orbis::slam::atlas& maps, const orbis::slam::map_keyframe& made) {
  const orbis::slam::map_keyframe now = maps.current(made);
  if (now.map != maps.active_id()) return std::nullopt;
  return maps.active().pose_of(now.keyframe);
}

/// How the live map asks for the poses of its keyframes.
live_mapping::find_poses poses_of(const slam_system& slam) {
  return [&slam, seen = orbis::slam::pose_revision{.map = orbis::slam::no_id}](
             const std::vector<live_mapping::made>& keyframes, std::vector<live_mapping::pose>& poses,
             bool always) mutable {
    return slam.inspect([&](const orbis::slam::atlas& maps) {
      const orbis::slam::pose_revision now{maps.active_id(), maps.active().pose_changes()};
      if (std::exchange(seen, now) == now && !always) return false;
      for (const auto& k : keyframes)
        if (const auto pose = present_pose(maps, k.keyframe)) poses.push_back({k.frame, *pose});
      return true;
    });
  };
}

/// Takes over the active map and what was found out.
void collect(const slam_system& slam, tracked_frames& out) {
  out.slam.trajectory = slam.trajectory();
  out.slam.keyframes = slam.keyframe_trajectory();
  slam.inspect([&](const orbis::slam::atlas& maps) {
    out.keyframes.place([&](const orbis::slam::map_keyframe& made) { return present_pose(maps, made); });
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
                                    const std::filesystem::path& landmark_map, const std::filesystem::path& spill_file,
                                    console& console) {
  console.stage("tracking");
  slam_system slam{source.camera.model, options_for(source, s)};
  if (!s.load_map.empty())
    if (auto loaded = slam.load_map(s.load_map); !loaded) return orbis::fail(loaded.error());
  const map_id first_map = slam.active_map();

  tracked_frames out{
      .slam = {}, .world = {}, .keyframes = posed_frames{source, spill_file}, .live = {}, .stopped = {}, .unsaved = {}};
  if (s.live_map && !s.localize_only)
    out.live = std::make_unique<live_mapping>(source, s, spill_file.string() + ".live", poses_of(slam));
  interrupts::keep_results(s.quiet
                               ? ""
                               : "\nrgbd_slam: stopping; what was reached is mapped and written. Once more: stop at "
                                 "once, and leave the folder as it was\n");
  const upright_worlds worlds = track_frames(slam, source, s, out, console);
  slam.wait();
  if (out.live) out.live->stop();

  // The results are about the loaded map where the camera was found in it, else about the one with the most frames.
  const map_id begun = slam.inspect([&](const orbis::slam::atlas& maps) { return maps.current({first_map, 0}).map; });
  const bool goes_on = !s.load_map.empty() && !slam.trajectory(begun).empty();
  slam.activate(goes_on ? begun : slam.largest_map());
  out.missed_map = !s.load_map.empty() && !goes_on;

  collect(slam, out);
  if (goes_on)
    out.world = {"loaded map", {}};
  else if (!out.slam.trajectory.empty())
    out.world = worlds.begun_at(out.slam.trajectory.front().timestamp);
  out.slam.seconds = console.elapsed();
  console.finish(in_words(out.slam));

  // A map that was missed is not replaced by one without it.
  const bool spares_loaded = out.missed_map && is_same_file(s.load_map, s.save_map);
  if (!s.save_map.empty() && !out.slam.trajectory.empty() && !spares_loaded) {
    console.stage("saving");
    if (auto saved = slam.save_map(landmark_map))
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

std::vector<std::string> mapping_notes(const posed_frames& frames, const std::optional<world_results>& world) {
  std::vector<std::string> notes;
  if (world && world->up_from == "assumed")
    notes.emplace_back(
        "which way is up is not known: the first frame shows no floor and no two walls, so the camera is "
        "taken to be level there (--gravity tells)");
  if (const auto& e = frames.unspilled()) notes.push_back(e->to_string() + "; depth images are kept in memory instead");
  return notes;
}

std::vector<std::string> tracking_notes(const tracked_frames& tracked, const settings& s) {
  std::vector<std::string> notes;
  if (const std::size_t here = tracked.slam.trajectory.size(); here < tracked.slam.tracked)
    notes.push_back(std::to_string(tracked.slam.tracked - here) + " of " + std::to_string(tracked.slam.tracked) +
                    " tracked frames are left out: tracking was lost, and where it began anew was never joined with "
                    "the rest");
  if (!s.localize_only && tracked.slam.tracked != 0 && tracked.keyframes.size() == 0)
    notes.emplace_back("no cloud and no octree: the loaded map shows all that was seen, so no frame became a keyframe");
  for (std::string& note : mapping_notes(tracked.keyframes, tracked.world)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace app
