// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stage.hpp"

#include <orbis/slam/rgbd_system.hpp>

namespace app {

tracked_frames track(const frame_source& source, const settings& s, console& say) {
  say.stage("tracking");
  orbis::slam::options options;
  if (source.camera.baseline) options.bf = *source.camera.baseline * source.camera.model.k().fx;
  orbis::slam::rgbd_system slam{source.camera.model, options};
  tracked_frames out{.slam = {}, .keyframes = posed_frames{source}, .stopped = std::nullopt};

  std::optional<orbis::se3> T_world_start;  // where the ground truth, if there is any, has the first tracked frame
  console::catch_interrupts();
  read_ahead frames{source, s.threads != 1};
  for (std::size_t i = 0; frames.has_next() && !console::interrupted(); ++i) {
    const auto frame = frames.next();
    if (!frame) {
      out.stopped = frame.error();
      break;
    }
    const auto start = console::clock::now();
    const orbis::slam::track_result found = slam.track(*frame);
    const std::chrono::duration<double, std::milli> took = console::clock::now() - start;
    out.slam.tracking_ms.push_back(took.count());
    if (found.tracked() && !T_world_start) T_world_start = frame->T_world_camera.value_or(orbis::se3{});
    if (found.keyframe) out.keyframes.add(i, *found.T_world_camera, *frame);
    say.advance(i + 1, source.frames,
                std::string{to_string(found.state)} + ", " + std::to_string(out.keyframes.size()) + " keyframes");
  }
  console::release_interrupts();

  // SLAM's world is the first camera's; ours is the ground truth's where that is known. This is a choice
  // of the world frame alone. Keyframes may have moved since they were made.
  const orbis::se3 T_world_slam = T_world_start.value_or(orbis::se3{});
  const auto in_world = [&](orbis::trajectory poses) {
    for (orbis::stamped_pose& p : poses) p.T_world_camera = T_world_slam * p.T_world_camera;
    return poses;
  };
  out.slam.trajectory = in_world(slam.trajectory());
  out.slam.keyframes = in_world(slam.keyframe_trajectory());
  for (const orbis::slam::keyframe_pose& k : slam.keyframes())
    out.keyframes.move(k.frame, T_world_slam * k.T_world_camera);

  const auto& counters = slam.counters();
  out.slam.frames = counters.frames;
  out.slam.tracked = counters.tracked;
  out.slam.lost = counters.lost;
  out.slam.relocalized = counters.relocalized;
  out.slam.landmarks = slam.landmark_count();
  out.slam.seconds = say.elapsed();
  say.finish(std::to_string(counters.tracked) + " of " + std::to_string(counters.frames) + " frames, " +
             std::to_string(out.slam.keyframes.size()) + " keyframes, " + std::to_string(out.slam.landmarks) +
             " landmarks");
  return out;
}

orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source) {
  orbis::error e = *tracked.stopped;
  e.message += "; stopped after " + std::to_string(tracked.slam.frames) + " of " + std::to_string(source.frames) +
               " frames, what they gave is kept";
  return e;
}

}  // namespace app
