// SPDX-License-Identifier: BSD-3-Clause
//
// 03_match [RECORDING I J]: matches the ORB features of two RGB-D frames, and estimates the motion of the camera from
// the matches. Without arguments, it uses two frames of a synthetic recording.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/features.hpp>
#include <orbis/io.hpp>
#include <orbis/optimize/pnp.hpp>

int complain(const orbis::error& e) { return std::fprintf(stderr, "%s\n", e.to_string().c_str()), 2; }

int match_frames(const orbis::camera::rgbd_frame& first, const orbis::camera::rgbd_frame& second,
                 const orbis::camera::any_camera& camera) {
  using namespace orbis::features;
  const orb_extractor extract{{.max_features = 1000}};
  orbis::image<std::uint8_t> grey_a(camera.width(), camera.height()), grey_b(camera.width(), camera.height());
  luma(first.color.view(), grey_a.view());
  luma(second.color.view(), grey_b.view());
  const features a = extract(grey_a), b = extract(grey_b);
  constexpr auto matcher = brute_force(hamming{}) | max_distance{60} | ratio_test{0.8F} | cross_check{};
  const std::vector<match> matches = matcher(a.descriptors, b.descriptors);
  std::printf("%zu and %zu features, %zu matches\n", a.size(), b.size(), matches.size());

  // Points of the first frame, from its depth image, and their pixels in the second frame.
  std::vector<orbis::vec3> points;
  std::vector<orbis::vec2> pixels;
  const auto depth = first.depth_metres();
  for (const match& m : matches) {
    const keypoint &p = a.keypoints[m.query], &q = b.keypoints[m.train];
    const float z = depth(static_cast<int>(p.x + 0.5F), static_cast<int>(p.y + 0.5F));  // metres
    const auto ray = camera.unproject(orbis::vec2{p.x, p.y});
    if (z <= 0.0F || !ray) continue;
    points.push_back(*ray * z);
    pixels.push_back({q.x, q.y});
  }
  const auto pose = orbis::optimize::estimate_pose(points, pixels, camera);  // P3P in RANSAC, then refinement
  if (!pose) return complain(pose.error());
  std::printf("%zu inliers of %zu; the camera moved by %.3f m and turned by %.2f degrees\n", pose->inliers.size(),
              points.size(), pose->T_world_camera.translation().norm(),
              pose->T_world_camera.rotation().log().norm() * 57.2958);
  return 0;
}

int main(int argc, char** argv) {
  if (argc != 4) {
    const orbis::io::synthetic_recording room{{.frames = 10, .frames_around = 360}};
    return match_frames(*room.frame(0), *room.frame(9), room.camera().model);
  }
  const auto recording = orbis::io::open_recording(argv[1]);
  if (!recording) return complain(recording.error());
  const auto first = recording->frame(std::strtoul(argv[2], nullptr, 10)),
             second = recording->frame(std::strtoul(argv[3], nullptr, 10));
  if (!first || !second) return complain((first ? second : first).error());
  return match_frames(*first, *second, recording->camera().model);
}
