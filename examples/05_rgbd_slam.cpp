// SPDX-License-Identifier: BSD-3-Clause
//
// 05_rgbd_slam [RECORDING]: RGB-D SLAM with a live map on a separate thread; writes trajectory.txt and map.bt, and
// plans a path. RECORDING: a folder in the TUM RGB-D, 7-Scenes, ICL-NUIM or ScanNet layout; default: a synthetic room.
#include <cstdio>

#include <orbis/camera/any.hpp>
#include <orbis/io.hpp>
#include <orbis/mapping/live_map_thread.hpp>
#include <orbis/nav.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/slam.hpp>

template <class Recording>
int run(Recording&& recording) {
  using octree = orbis::octree::occupancy_octree<>;
  using live_map = orbis::mapping::live_map_thread<octree, orbis::camera::any_camera>;
  const auto camera = recording.camera().model;

  orbis::slam::options options;
  options.threads.enabled = true;  // local mapping and loop closing on separate threads
  orbis::slam::rgbd_system slam{camera, options};

  // The map's thread follows the keyframe poses, which SLAM corrects, and publishes snapshots.
  live_map map{camera,
               {.map = {.resolution = 0.05, .integration = {.max_range = 5.0}}},
               {.poll_poses = orbis::mapping::follow_keyframes(slam)}};

  std::size_t i = 0;
  for (const orbis::camera::rgbd_frame& frame : recording) {
    const auto result = slam.track(frame);
    if (result.keyframe) map.add_keyframe(i, frame.depth_metres(), *result.T_world_camera);
    ++i;
  }
  slam.wait();
  map.finish();

  const auto snapshot = map.latest();  // snapshots are immutable and available to any thread
  const auto trajectory = slam.trajectory();
  std::printf("%zu frames, %zu tracked, %zu keyframes, %zu leaves in the map\n", i, trajectory.size(),
              snapshot->keyframes, snapshot->map.num_leaves());
  if (trajectory.empty()) return 1;
  // A path for a ball with a radius of 10 cm through known free space, between points 0.7 m in front of the camera.
  const orbis::nav::distance_field field{snapshot->map, {.reach = 0.5}};
  const orbis::nav::planning_view view{snapshot->map, field, 0.1};
  const orbis::vec3 ahead{0.0, 0.0, 0.7};
  const auto path =
      find_path(view, trajectory.front().T_world_camera * ahead, trajectory.back().T_world_camera * ahead);
  std::printf("path: %s, %.2f m\n", to_string(path.status).data(), path.length);
  return orbis::io::write_trajectory("trajectory.txt", trajectory) && write_bt(snapshot->map, "map.bt") ? 0 : 2;
}

int main(int argc, char** argv) {
  if (argc < 2)
    return run(orbis::io::synthetic_recording{{.frames = 60, .width = 320, .height = 240, .frames_around = 360}});
  auto recording = orbis::io::open_recording(argv[1]);
  if (!recording) return std::fprintf(stderr, "%s\n", recording.error().to_string().c_str()), 2;
  return run(*recording);
}
