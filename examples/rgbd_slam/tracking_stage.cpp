// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stage.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <orbis/slam/system.hpp>

#include "../common/same_file.hpp"
#include "camera_stage.hpp"
#include "corrected_frame.hpp"
#include "interrupts.hpp"
#include "profiles.hpp"
#include "result_files.hpp"
#include "slam_options.hpp"
#include "smooth_frame.hpp"
#include "static_frame.hpp"
#include "upright_world.hpp"

namespace app {
namespace {

using orbis::se3;
using orbis::slam::map_id;
using slam_system = orbis::slam::system<orbis::camera::any_camera>;

orbis::slam::options options_for(const frame_source& source, const settings& s) {
  orbis::slam::options options = slam_options(source.camera.model, source.camera.baseline);
  set_profile(s.profile, options);
  options.threads = {.enabled = !s.deterministic && s.threads != 1, .wait = true};
  options.localization_only = s.localize_only;
  options.moving.enabled = s.moving;
  options.depth_term.enabled = options.depth_term.recovers = s.depth_term;
  if (source.is_monocular()) return orbis::slam::monocular_options(std::move(options));
  if (source.is_stereo())
    return orbis::slam::stereo_options(source.camera.model.k().fx, source.camera.baseline.value(), std::move(options));
  return options;
}

/// Moves a frame's images into a frame for the viewer. `took_ms`: tracking time so far.
viewer_frame make_viewer_frame(const slam_system& slam, std::size_t i, const orbis::slam::track_result& found,
                               double took_ms, orbis::camera::rgbd_frame frame) {
  viewer_frame shown{.number = i, .state = std::string{to_string(found.state)}, .tracking_ms = took_ms};
  shown.T_world_camera = found.T_world_camera;
  shown.tracked = slam.last_frame();
  if (found.keyframe) shown.keyframe = {found.map, *found.keyframe};
  shown.color = std::move(frame.color);
  shown.depth = std::move(frame.depth);
  shown.depth_scale = frame.depth_scale;
  return shown;
}

class camera_pace {
 public:
  /// Delays all further frames.
  void pause(console::clock::duration time) { begin_ += time; }
  /// Waits until a camera would deliver the frame with this timestamp, or until the run is interrupted.
  void wait_for(double timestamp) {
    if (!std::exchange(has_begun_, true)) first_ = timestamp;
    constexpr double longest = 1e6;  // seconds; the clock cannot represent arbitrary durations
    const std::chrono::duration<double> since_first{std::min(timestamp - first_, longest)};
    const auto due = begin_ + std::chrono::duration_cast<console::clock::duration>(since_first);
    constexpr std::chrono::milliseconds poll_interval{50};
    while (!interrupts::stop_requested() && console::clock::now() < due)
      std::this_thread::sleep_until(std::min(due, console::clock::now() + poll_interval));
  }

 private:
  console::clock::time_point begin_ = console::clock::now();
  bool has_begun_ = false;
  double first_ = 0.0;  // time stamp of the first frame
};

/// Forwards a tracked frame to the live map.
void forward_to_live_map(const slam_system& slam, const orbis::slam::track_result& found, std::size_t i,
                         const orbis::image<std::uint16_t>& depth, const settings& s, live_mapping& live) {
  live.tracked(i);
  if (!found.T_world_camera) return;
  if (found.keyframe) return live.add(i, {found.map, *found.keyframe}, *found.T_world_camera, depth);
  if (!s.map_every_frame) return;
  const auto tracked = slam.last_frame();
  const auto reference = slam.inspect([&](const orbis::slam::atlas& maps) {
    const auto now = maps.current(tracked->reference);
    return live.find([&](const live_mapping::made& k) { return maps.current(k.keyframe) == now; });
  });
  if (reference) live.add_frame(i, *reference, tracked->T_reference_camera, depth);
}

orbis::slam::track_result track_frame(slam_system& slam, const frame_source& source, const source_frame& f) {
  if (source.is_monocular()) return slam.track(f.timestamp, f.color.view());
  if (source.is_stereo()) return slam.track(f.timestamp, f.color.view(), f.right.view());
  return slam.track(f);
}

/// Returns true if a camera's frames ended normally: the played recording ended, or the user interrupted the run.
bool is_planned_end(const orbis::error& e) {
  return e.code == orbis::errc::no_data || e.code == orbis::errc::cancelled;
}

/// Checks the focal length of the camera with the largest map, and calibrates the camera if `may_calibrate` is true and
/// the map clearly contradicts the focal length; `may_calibrate` is then false. Sets `camera_doubt` and
/// `better_camera`.
void check_camera(slam_system& slam, const frame_source& source, const orbis::slam::options& options,
                  bool& may_calibrate, const settings& s, tracked_frames& out, console& console) {
  slam.wait();
  const map_id most = slam.largest_map();
  const auto go_on = [](std::size_t, std::size_t) { return !interrupts::stop_requested(); };
  out.camera_doubt = slam.inspect(
      [&](const orbis::slam::atlas& maps) { return find_doubt(maps.at(most), source.camera.model, options, go_on); });
  if (!may_calibrate || !out.camera_doubt || !out.camera_doubt->is_sure) return;
  may_calibrate = false;
  const auto estimate = slam.estimated_shutter();
  out.better_camera =
      refine_camera(source, estimate ? estimate->shutter : options.shutter, *out.camera_doubt, s, console);
}

/// Tracks frames until a frame is unreadable, Ctrl-C is pressed, or `is_enough` returns true for the time since the
/// first frame (seconds). Each map starts in a separate world frame.
void track_frames(slam_system& slam, const frame_source& source, const settings& s, upright_worlds& worlds,
                  tracked_frames& out, const std::function<bool(double)>& is_enough, viewer& viewer, console& console) {
  using orbis::slam::track_state;
  read_ahead frames{source, s.threads != 1 && !source.is_live};
  frame_correction correct{source.camera.model};
  static_frames remove_moving{source.camera.model};
  frame_smoother smooth{source};
  camera_pace pace;
  std::optional<double> begin;
  for (std::size_t i = 0; frames.has_next() && !interrupts::stop_requested(); ++i) {
    auto frame = frames.next();
    if (!frame) {
      if (!source.is_live || !is_planned_end(frame.error())) out.stopped = frame.error();
      break;
    }
    const double timestamp = frame->timestamp;
    if (!begin) begin = timestamp;
    if (s.realtime) pace.wait_for(timestamp);
    const auto start = console::clock::now();
    const auto took = [&] { return std::chrono::duration<double, std::milli>(console::clock::now() - start).count(); };
    slam.set_initial_pose([&, is_first = slam.state() == track_state::not_started] {
      source.complete(*frame);
      return worlds.start_world(*frame, is_first);
    });
    const orbis::slam::track_result found = track_frame(slam, source, *frame);
    out.slam.slam_ms.push_back(took());
    const bool has_keyframe = found.keyframe && !source.is_monocular();
    const bool is_mapped = has_keyframe || (out.live && s.map_every_frame && found.T_world_camera);
    if (is_mapped) source.complete(*frame);
    const orbis::slam::frame_motion motion{found.shutter, found.twist};
    const orbis::camera::rgbd_frame& at_once = is_mapped ? correct(*frame, motion) : *frame;
    const orbis::image<std::uint16_t>& depth =
        is_mapped ? smooth(remove_moving(at_once, slam.last_frame()), motion) : at_once.depth;
    if (has_keyframe)
      out.keyframes.add(i, {found.map, *found.keyframe}, &at_once == &*frame ? orbis::slam::frame_motion{} : motion,
                        depth, at_once.color);
    if (out.live) forward_to_live_map(slam, found, i, depth, s, *out.live);
    viewer.show([&] { return make_viewer_frame(slam, i, found, took(), *std::move(frame)); });
    out.slam.tracking_ms.push_back(took());
    viewer.report_error(console);
    if (found.state == track_state::lost) out.slam.lost_frames.add(i);
    console.advance(i + 1, source.frames,
                    std::string{to_string(found.state)} + ", " + std::to_string(out.slam.keyframes_made) +
                        " keyframes" + (source.dropped ? ", " + std::to_string(source.dropped()) + " dropped" : ""));
    const auto end = console::clock::now();
    if (is_enough(timestamp - *begin)) break;
    pace.pause(console::clock::now() - end);
  }
  slam.set_initial_pose(se3{});
  if (source.dropped) out.slam.dropped = source.dropped();
}

/// The current pose of a keyframe that was created in the active map or in a map merged with it. Culled keyframes are
/// included, because they are redundant for the landmarks, but not for the dense cloud and the octree.
std::optional<se3> present_pose(const orbis::slam::atlas& maps, const orbis::slam::map_keyframe& made) {
  const orbis::slam::map_keyframe now = maps.current(made);
  if (now.map != maps.active_id() || !maps.active().remembers(now.keyframe)) return std::nullopt;
  return maps.active().pose(now.keyframe);
}

/// Returns the function with which the live map reads the poses of its keyframes.
live_mapping::find_poses make_pose_reader(const slam_system& slam) {
  return [&slam, seen = orbis::slam::pose_revision{.map = orbis::slam::no_id}](
             const std::vector<live_mapping::made>& keyframes, live_mapping::poses& poses, bool always) mutable {
    return slam.inspect([&](const orbis::slam::atlas& maps) {
      const orbis::slam::pose_revision now{maps.active_id(), maps.active().pose_changes()};
      if (std::exchange(seen, now) == now && !always) return false;
      for (const auto& k : keyframes) {
        if (const auto pose = present_pose(maps, k.keyframe))
          poses.poses.push_back({k.frame, *pose});
        else if (!maps.contains(maps.current(k.keyframe).map))
          poses.removed.push_back(k.frame);
      }
      return true;
    });
  };
}

/// Returns the function with which the viewer reads the keyframes and their graph: edges of the spanning tree, loop
/// edges, and edges between keyframes that share many landmarks. If all covisibility edges were drawn, they would hide
/// each other.
auto make_graph_reader(const slam_system& slam) {
  return [&slam, seen = orbis::slam::pose_revision{.map = orbis::slam::no_id}](slam_graph& graph, bool always) mutable {
    constexpr std::uint32_t many_shared = 100;
    return slam.inspect([&](const orbis::slam::atlas& maps) {
      const auto& map = maps.active();
      const orbis::slam::pose_revision now{maps.active_id(), map.pose_changes()};
      if (std::exchange(seen, now) == now && !always) return false;
      graph.poses.clear();
      for (const auto& asked : graph.asked) {
        const auto pose = present_pose(maps, asked);
        graph.poses.push_back(pose ? std::optional<orbis::sim3>{{pose->rotation(), pose->translation(),
                                                                 map.scale(maps.current(asked).keyframe)}}
                                   : std::nullopt);
      }
      graph.keyframes.clear();
      graph.edges.clear();
      std::unordered_map<std::uint32_t, std::uint32_t> place;  // keyframe id -> index in graph.keyframes
      for (const auto& k : map.keyframes()) {
        place[k.id.value()] = static_cast<std::uint32_t>(graph.keyframes.size());
        graph.keyframes.push_back(k.T_world_camera);
      }
      for (const auto& k : map.keyframes()) {
        const auto add = [&](orbis::slam::keyframe_id other, edge_kind kind) {
          if (map.has_keyframe(other)) graph.edges.push_back({place[k.id.value()], place[other.value()], kind});
        };
        for (const auto& both : map.covisibility().sharing(k.id))
          if (both.keyframe < k.id && both.shared >= many_shared) add(both.keyframe, edge_kind::covisible);
        if (const auto parent = map.tree().parent(k.id); parent != orbis::slam::no_id) add(parent, edge_kind::tree);
        for (const auto other : map.tree().loop_edges(k.id))
          if (other < k.id) add(other, edge_kind::loop);
      }
      return true;
    });
  };
}

/// The viewer's data sources during tracking. `live` may be null.
scene_sources make_sources(const slam_system& slam, const live_mapping* live) {
  scene_sources sources{.graph = make_graph_reader(slam)};
  if (live == nullptr) return sources;
  sources.voxels = [live, seen = std::optional<std::uint64_t>{}](std::vector<voxel>& cubes) mutable {
    return live->occupied_since(seen, cubes);
  };
  sources.numbers = [live] { return live->so_far(); };
  return sources;
}

/// Returns `make()`, which starts threads of the run. If the system cannot start enough threads, closes the viewer and
/// tries again.
template <class Make>
std::invoke_result_t<const Make&> with_threads(viewer& viewer, console& console, const Make& make) {
  try {
    return make();
  } catch (const std::system_error&) {
    if (!viewer.give_way(console)) throw;
  }
  for (int attempt = 0; attempt != 50; ++attempt) try {  // threads still count for a short time after they end
      return make();
    } catch (const std::system_error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds{2});
    }
  return make();
}

/// Copies trajectories, keyframe poses and counters to `out`.
void collect(const slam_system& slam, tracked_frames& out) {
  out.slam.trajectory = slam.trajectory();
  out.slam.keyframes = slam.keyframe_trajectory();
  slam.inspect([&](const orbis::slam::atlas& maps) {
    out.keyframes.place([&](const orbis::slam::map_keyframe& made) { return present_pose(maps, made); });
  });
  std::vector<map_id> others;
  slam.inspect([&](const orbis::slam::atlas& maps) {
    for (const auto& [id, map] : maps.maps())
      if (id != maps.active_id()) others.push_back(id);
  });
  for (const map_id id : others)
    if (auto poses = slam.trajectory(id); !poses.empty()) out.slam.other_maps.push_back(std::move(poses));
  std::stable_sort(out.slam.other_maps.begin(), out.slam.other_maps.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
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

std::string describe(const slam_results& slam) {
  const auto count = [](std::size_t n, const char* what) {
    return n == 0 ? std::string{} : ", " + std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  };
  return std::to_string(slam.tracked) + " of " + std::to_string(slam.frames) + " frames, " +
         std::to_string(slam.keyframes.size()) + " keyframes, " + std::to_string(slam.landmarks) + " landmarks" +
         count(slam.loops_closed, "loop") + count(slam.maps_merged, "merged map") +
         count(slam.dropped.value_or(0), "dropped frame");
}

}  // namespace

orbis::result<tracked_frames> track(const frame_source& source, const shutter_results& shutter, const settings& s,
                                    const result_files& files, viewer& viewer, console& console) {
  const auto start = console::clock::now();
  console.stage("tracking");
  orbis::slam::options options = options_for(source, s);
  options.shutter = shutter.shutter;
  options.estimates_shutter = shutter.can_be_revised();
  options.earlier_estimate = shutter.estimate;
  slam_system slam = with_threads(viewer, console, [&] { return slam_system{source.camera.model, options}; });
  if (!s.load_map.empty())
    if (auto loaded = slam.load_map(s.load_map); !loaded) return orbis::fail(loaded.error());
  const map_id first_map = slam.active_map();

  tracked_frames out{.slam = {},
                     .world = {},
                     .keyframes = posed_frames{source, s, files.folder() / spill_name},
                     .live = {},
                     .stopped = {},
                     .unsaved = {},
                     .camera_doubt = {},
                     .better_camera = {}};
  out.slam.sensor = source.sensor;
  if (s.live_map && !s.localize_only && !source.is_monocular())
    out.live = with_threads(viewer, console, [&] {
      return std::make_unique<live_mapping>(source, s, out.keyframes.depths(), make_pose_reader(slam));
    });
  std::optional<viewer::connection> connection{std::in_place, viewer, make_sources(slam, out.live.get())};
  interrupts::keep_results(
      s.quiet ? ""
              : "\nrgbd_slam: stopping; the results so far will be mapped and written. Interrupt again to "
                "stop immediately and leave the folder unchanged\n",
      [&slam, live = out.live.get()] {
        slam.stop();
        if (live != nullptr) live->leave();
      });
  struct forget_stop {
    ~forget_stop() { interrupts::forget_stop(); }
  };
  std::optional<forget_stop> stops_slam{std::in_place};  // destroyed before the objects that it stops
  upright_worlds worlds{source, s};
  slam.listen({.keyframe_made = [&out](const orbis::slam::keyframe_event& made) {
    ++out.slam.keyframes_made;
    out.slam.lost_frames.remove(made.frame);  // the first of the two frames that initialise a map without depth
  }});
  bool may_calibrate = may_refine(source, s);
  console::clock::duration checking{};
  double next_check = 10.0;  // seconds
  const auto check = [&] {
    const auto begin = console::clock::now();
    check_camera(slam, source, options, may_calibrate, s, out, console);
    checking += console::clock::now() - begin;
    console.stage("tracking", start + checking);
  };
  const auto is_contradicted = [&](double seconds) {
    if (!may_calibrate || seconds <= next_check) return false;
    next_check *= 2.0;
    check();
    return out.better_camera.has_value();
  };
  try {
    track_frames(slam, source, s, worlds, out, is_contradicted, viewer, console);
    if (!out.better_camera) slam.wait();
    const bool has_map = source.sensor == orbis::slam::sensor_kind::rgbd && s.load_map.empty();
    if (has_map && !out.better_camera && !interrupts::stop_requested()) check();
    if (out.live && !out.better_camera) out.live->wait();
  } catch (const std::bad_alloc&) {
    out.stopped = {orbis::errc::exception, s.out.string(), "out of memory"};
  }
  stops_slam.reset();
  if (out.live) out.live->leave();
  connection.reset();
  if (interrupts::stop_requested()) out.better_camera.reset();
  if (out.better_camera) {
    out.live.reset();
    return out;
  }
  out.slam.shutter = shutter;
  if (const auto estimate = slam.estimated_shutter()) {
    const bool is_kept = estimate->read_out == shutter.estimate.read_out;
    out.slam.shutter = {is_kept ? shutter.from : "estimated", estimate->shutter, *estimate};
  }
  if (out.stopped && out.stopped->code == orbis::errc::exception) out.live.reset();  // frees most of the memory

  // The results describe the loaded map if the camera was relocalised in it, otherwise the map with the most frames.
  const map_id begun = slam.inspect([&](const orbis::slam::atlas& maps) { return maps.current({first_map, 0}).map; });
  const bool goes_on = !s.load_map.empty() && !slam.trajectory(begun).empty();
  slam.activate(goes_on ? begun : slam.largest_map());
  out.missed_map = !s.load_map.empty() && !goes_on;

  collect(slam, out);
  out.slam.exposure = slam.exposure();
  const auto& k = source.camera.model.k();
  out.slam.intrinsics = {source.camera_is_refined ? "refined" : "given", k.fx, k.fy, k.cx, k.cy};
  if (goes_on)
    out.world = {"loaded map", {}};
  else if (!out.slam.trajectory.empty())
    out.world = worlds.world_starting_at(out.slam.trajectory.front().timestamp);
  out.slam.seconds = console.elapsed();
  console.finish(describe(out.slam));

  // If the camera was not relocalised in the loaded map, that map is not overwritten.
  const bool spares_loaded = out.missed_map && examples::is_same_file(s.load_map, s.save_map);
  if (!s.save_map.empty() && !out.slam.trajectory.empty() && !spares_loaded) {
    console.stage("saving");
    if (auto saved = slam.save_map(files.landmark_map()))
      console.finish(s.save_map.string());
    else
      out.unsaved = files.with_final_path(saved.error());
  }
  return out;
}

orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source) {
  orbis::error e = *tracked.stopped;
  e.message += "; stopped after " + std::to_string(tracked.slam.frames) +
               (source.is_live ? "" : " of " + std::to_string(source.frames)) + " frames, " +
               (tracked.slam.tracked == 0 ? "none of which could be tracked" : "whose results are kept");
  return e;
}

orbis::error explain_miss(const tracked_frames& tracked, const settings& s) {
  std::string message = "the camera was never found in this map: none of " + std::to_string(tracked.slam.frames) +
                        " frames shows a place in it";
  if (tracked.slam.tracked != 0) message += "; the results are those of a new map";
  if (tracked.slam.tracked != 0 && examples::is_same_file(s.load_map, s.save_map))
    message += "; it was not saved over the loaded map";
  return {orbis::errc::no_data, s.load_map.string(), std::move(message)};
}

std::vector<std::string> mapping_notes(const posed_frames& frames, const std::optional<world_results>& world) {
  std::vector<std::string> notes;
  if (world && world->up_from == "assumed")
    notes.emplace_back(
        "the vertical direction is unknown: the first frame shows neither a floor nor two walls, and the camera is "
        "assumed to be level in it (specify the direction with --gravity)");
  if (const auto e = frames.unspilled())
    notes.push_back("the temporary file for depth images " + e->message + "; depth images are kept in memory instead");
  return notes;
}

std::vector<std::string> tracking_notes(const tracked_frames& tracked, const settings& s) {
  std::vector<std::string> notes;
  std::size_t elsewhere = 0;
  for (const auto& poses : tracked.slam.other_maps) elsewhere += poses.size();
  const std::string of_all = " of " + std::to_string(tracked.slam.tracked) + " tracked frames ";
  if (elsewhere != 0) {
    const std::size_t last = std::min(tracked.slam.other_maps.size() + 1, most_maps);
    notes.push_back(std::to_string(elsewhere) + of_all +
                    "are not in the cloud and octree: tracking was lost, and their maps were never merged with the "
                    "main map; their poses, in separate world frames, are in " +
                    trajectory_name(2) + (last > 2 ? " ... " + trajectory_name(last) : ""));
  }
  if (const std::size_t dropped = tracked.slam.dropped.value_or(0); dropped > (dropped + tracked.slam.frames) / 10)
    notes.push_back(std::to_string(dropped) + " of " + std::to_string(dropped + tracked.slam.frames) +
                    " frames of the camera were dropped because tracking was too slow");
  if (const std::size_t kept = tracked.slam.trajectory.size() + elsewhere; kept < tracked.slam.tracked)
    notes.push_back(std::to_string(tracked.slam.tracked - kept) + of_all +
                    "are omitted: tracking was lost again before they formed a map");
  if (tracked.slam.sensor == orbis::slam::sensor_kind::monocular && tracked.slam.tracked != 0)
    notes.emplace_back("monocular camera: lengths are in arbitrary units, and there is no cloud and no octree");
  else if (!s.localize_only && tracked.slam.tracked != 0 && tracked.keyframes.size() == 0)
    notes.emplace_back(
        "no cloud and no octree: the loaded map contains everything in view, so no keyframe was created");
  if (tracked.camera_doubt) notes.push_back(describe(*tracked.camera_doubt));
  for (std::string& note : mapping_notes(tracked.keyframes, tracked.world)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace app
