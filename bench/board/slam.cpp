// SPDX-License-Identifier: BSD-3-Clause
//
// SLAM and the live map, one after the other on one thread. Its places: "read" around reading a frame's files, "frame"
// and "clock" (the stages of `track`, see `slam::track_timings`), "adjust" around local bundle adjustment, "insert"
// around a keyframe's insertion into the live map, "correct" around the corrections that follow.
//
// usage: slam RECORDING FIRST FRAMES default|small [RESOLUTION]
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/mapping/keyframe_points.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/slam/system.hpp>

#include "../../examples/rgbd_slam/profiles.hpp"
#include "marks.hpp"

using orbis::bench::board::counted, orbis::bench::board::mark;
using camera_type = orbis::camera::any_camera;
using descriptor = orbis::features::orb_extractor::descriptor;

/// The body of the template with places around it.
template <>
void orbis::slam::detail::local_mapper<camera_type, descriptor, orbis::slam::bag_of_words_places>::adjust(
    basic_map<descriptor>& m, keyframe_id k, const std::function<bool()>& stop_requested) {
  counted("adjust", [&] {
    const adjustment_options& o = shared_.settings.adjustment;
    snapshot_ = shared_.locked([&] { return local_adjustment::take(m, k, shared_.rig, o, std::move(snapshot_)); });
    if (snapshot_.empty()) return;
    const auto go_on = [&](std::size_t, std::size_t) { return !stop_requested(); };
    solution_ = solver_.solve(snapshot_, local_adjustment::make_schedule(o), go_on, std::move(solution_));
    shared_.locked([&] { local_adjustment::apply(m, snapshot_, solution_); });
  });
}

int main(int argc, char** argv) {
  using namespace orbis;
  if (argc < 5) return std::fputs("usage: slam RECORDING FIRST FRAMES default|small [RESOLUTION]\n", stderr), 1;
  const auto recording = io::open_recording(argv[1]);
  if (!recording) return std::fprintf(stderr, "%s\n", recording.error().to_string().c_str()), 2;
  const auto first = static_cast<std::size_t>(std::atoi(argv[2]));
  const std::size_t end = std::min(recording->size(), first + static_cast<std::size_t>(std::atoi(argv[3])));
  const std::string profile = argv[4];

  slam::options settings;
  app::set_profile(profile, settings);
  const double usual = profile == "small" ? app::small_settings::resolution : 0.05;
  const mapping::live_map_options map_options{.resolution = argc > 5 ? std::atof(argv[5]) : usual};
  slam::rgbd_system<camera_type> slam{recording->camera().model, settings};
  mapping::live_map<octree::occupancy_octree<>, camera_type> map{recording->camera().model, map_options};
  mapping::keyframe_points reader;
  const mapping::keyframe_point_options points{.flying_pixels = cloud::flying_pixel_options{}};
  const camera::ray_table rays{recording->camera().model};
  std::vector<mapping::keyframe_position> poses;
  std::vector<slam::keyframe_id> made;
  std::size_t tracked = 0;
  for (std::size_t i = first; i < end; ++i) {
    mark("read");
    auto frame = recording->frame(i);
    mark("end");
    if (!frame) return std::fprintf(stderr, "%s\n", frame.error().to_string().c_str()), 2;
    mark("frame");
    const slam::track_result r = slam.track(*frame);
    mark("end");
    tracked += r.tracked();
    if (!r.keyframe) continue;
    made.push_back(*r.keyframe);
    const mapping::live_map<octree::occupancy_octree<>, camera_type>::depth_view depth(frame->depth.view(),
                                                                                       frame->depth_scale);
    counted("insert", [&] {
      reader.mask(seq, depth, rays, points, frame->depth.view());
      static_cast<void>(map.add_keyframe(seq, made.back().value(), depth, *r.T_world_camera));
    });
    counted("correct", [&] {
      poses.clear();
      slam.inspect([&](const slam::atlas& maps) {
        for (const slam::keyframe_id k : made)
          if (maps.active().has_keyframe(k)) poses.push_back({k.value(), maps.active().pose(k)});
      });
      map.set_poses(poses);
      static_cast<void>(map.correct(seq));
    });
  }
  std::printf("%zu tracked, %zu keyframes\n", tracked, made.size());
}
