// SPDX-License-Identifier: BSD-3-Clause
//
// 02_octree [OUT.bt]: builds a log-odds occupancy octree from depth images with known poses, queries it, and writes it
// for octovis.
#include <cstdio>

#include <orbis/io/synthetic.hpp>
#include <orbis/octree.hpp>

int main(int argc, char** argv) {
  // A depth camera that moves once around a furnished room, with known poses.
  const orbis::io::synthetic_recording room{{.frames = 36, .width = 320, .height = 240, .frames_around = 36}};
  const auto camera = room.camera().model;

  orbis::octree::occupancy_octree<> map{0.05};  // voxels of 5 cm
  for (const auto& frame : room)
    map.integrate(orbis::par, frame.depth_metres(), camera, *frame.T_world_camera, {.max_range = 5.0});
  std::printf("%zu leaves, %zu of them occupied\n", map.num_leaves(), map.num_occupied_leaves());

  // Query the state of points (metres, world frame).
  const orbis::vec3 eye = room.T_world_camera(0).translation();
  for (const orbis::vec3& p : {eye, orbis::vec3{0.0, 0.0, 10.0}}) {
    const auto state = map.state(p);
    const char* name = state == orbis::octree::occupancy::occupied ? "occupied"
                       : state == orbis::octree::occupancy::free   ? "free"
                                                                   : "unknown";
    std::printf("(%.1f, %.1f, %.1f) is %s\n", p.x(), p.y(), p.z(), name);
  }
  // Cast a ray along the optical axis to the first surface.
  const orbis::vec3 axis = room.T_world_camera(0).rotation() * orbis::vec3{0.0, 0.0, 1.0};
  const auto hit = map.cast_ray(eye, axis, 8.0);
  if (hit) std::printf("the camera looks at a surface %.2f m away\n", (hit.point - eye).norm());

  if (argc < 2) return map.state(eye) == orbis::octree::occupancy::free ? 0 : 1;
  const auto written = write_bt(map, argv[1]);
  if (!written) std::fprintf(stderr, "%s\n", written.error().to_string().c_str());
  return written ? 0 : 2;
}
