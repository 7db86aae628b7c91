// SPDX-License-Identifier: BSD-3-Clause
//
// Depth images of a recording with known poses, into the octree of orbis and that of OctoMap: both traverse every ray,
// and both trees end alike.
//
// usage: octree RECORDING IMAGES RESOLUTION
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <vector>

#include <octomap/octomap.h>

#include <orbis/camera/depth.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "marks.hpp"

int main(int argc, char** argv) {
  using namespace orbis;
  using bench::board::counted;
  if (argc != 4) return std::fputs("usage: octree RECORDING IMAGES RESOLUTION\n", stderr), 1;
  const auto recording = io::open_recording(argv[1]);
  if (!recording) return std::fprintf(stderr, "%s\n", recording.error().to_string().c_str()), 2;
  const auto wanted = static_cast<std::size_t>(std::atoi(argv[2]));
  const double resolution = std::atof(argv[3]);
  constexpr double max_range = 4.0;  // as the program's
  constexpr std::size_t warm_up = 2, between = 10;

  octree::occupancy_octree<> ours{resolution};
  octomap::OcTree theirs{resolution};
  for (std::size_t i = 0; i != warm_up + wanted; ++i) {
    const auto frame = recording->frame(between * i);
    if (!frame || !frame->T_world_camera) return std::fputs("a frame with depth and pose is wanted\n", stderr), 2;
    const se3& pose = *frame->T_world_camera;
    const camera::depth_view<std::uint16_t> depth(frame->depth.view(), frame->depth_scale);
    std::vector<vec3f> points;
    recording->camera().model.visit(
        [&](const auto& model) { octree::append_world_points(depth, model, pose, points); });
    octomap::Pointcloud cloud;
    for (const vec3f& p : points) cloud.push_back(p.x(), p.y(), p.z());
    const vec3f o = pose.translation().cast<float>();
    recording->camera().model.visit([&](const auto& model) {
      counted(i < warm_up ? "first" : "orbis",
              [&] { ours.integrate(seq, depth, model, pose, {.max_range = max_range}); });
    });
    counted(i < warm_up ? "first" : "octomap", [&] {
      theirs.insertPointCloud(cloud, {o.x(), o.y(), o.z()}, max_range);
    });
  }
  std::ostringstream bytes;
  theirs.write(bytes);
  const bool are_equal = bytes.str() == octree::ot_bytes(ours);
  std::printf("leaves: orbis %zu, OctoMap %zu; the files are %s\n", ours.num_leaves(), theirs.getNumLeafNodes(),
              are_equal ? "equal" : "different");
  return are_equal ? 0 : 1;
}
