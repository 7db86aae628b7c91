// SPDX-License-Identifier: BSD-3-Clause
//
// depth_to_octree DEPTH.png MAP.bt: converts a depth image with a camera pose to an occupancy octree for octovis.
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/camera.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/io.hpp>
#include <orbis/octree.hpp>

#include "../common/memory.hpp"
#include "../common/program.hpp"
#include "../common/same_file.hpp"
#include "../common/voxel_estimate.hpp"

int report_error(int code, const std::string& why) { return examples::report_error("depth_to_octree", code, why); }

orbis::result<orbis::camera::camera_settings> camera_named(const std::string& s, int width, int height) {
  if (s.find(',') == s.npos) return orbis::camera::preset(s) ? orbis::camera::preset(s) : orbis::io::read_camera(s);
  orbis::camera::intrinsics k{width, height, 0, 0, 0, 0};
  char rest = 0;
  if (std::sscanf(s.c_str(), "%lf,%lf,%lf,%lf%c", &k.fx, &k.fy, &k.cx, &k.cy, &rest) != 4)
    return orbis::fail(orbis::errc::invalid_argument, "--camera",
                       orbis::in_quotes(s) + " is not fx,fy,cx,cy in pixels");
  const auto checked = orbis::camera::plausible(k, "--camera");
  if (!checked) return orbis::fail(checked.error());
  return orbis::camera::camera_settings{.model = orbis::camera::pinhole{*checked}};
}

int run(int argc, char** argv) {
  std::string input, output, camera_name = "525,525,319.5,239.5";
  std::vector<double> p{0, 0, 0, 0, 0, 0, 1};
  double resolution = 0.05, scale = 0.0;  // scale 0: use the scale of the camera
  CLI::App cli{"Convert a depth image with a camera pose to an occupancy octree", "depth_to_octree"};
  cli.add_option("DEPTH", input, "16-bit grey PNG")->required();
  cli.add_option("MAP", output, "output .bt file")->required();
  cli.add_option("--pose", p, "camera-to-world pose: tx ty tz qx qy qz qw")->expected(7)->capture_default_str();
  cli.add_option("--camera", camera_name, "camera.toml, preset (tum_fr1 ...), or fx,fy,cx,cy")->capture_default_str();
  cli.add_option("--scale", scale, "depth units per metre (default: that of the camera; 1000 for fx,fy,cx,cy)");
  cli.add_option("--resolution", resolution, "voxel size in metres")->capture_default_str();
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  const orbis::so3::quaternion q{p.data() + 3};  // x y z w
  if (!(q.norm() > 1e-6 && orbis::vec3{p.data()}.norm() + q.norm() < 1e6))
    return report_error(1, "--pose: not a valid pose");
  if (!(resolution >= 1e-4 && resolution <= 1e3))
    return report_error(1, "--resolution: must be between 0.0001 and 1000");
  if (!(scale == 0.0 || (scale >= 1e-3 && scale <= 1e9)))
    return report_error(1, "--scale: must be between 0.001 and 1e9");
  for (const std::string& read : {input, camera_name})
    if (examples::is_same_file(output, read)) return report_error(1, examples::overwrite_message(output, read));
  if (const std::string why = examples::unwritable_message(output); !why.empty()) return report_error(2, why);
  const auto depth = orbis::io::read_depth(input);
  if (!depth) return report_error(2, examples::describe(depth.error()));
  const auto camera = camera_named(camera_name, depth->width(), depth->height());
  if (!camera) return report_error(camera.error().where == "--camera" ? 1 : 2, examples::describe(camera.error()));
  if (camera->model.width() != depth->width() || camera->model.height() != depth->height())
    return report_error(2, orbis::shortened_path(camera_name) + ": the image size of the camera differs from that of " +
                               orbis::shortened_path(input));
  const double units = scale > 0.0 ? scale : camera->depth_scale;
  const auto voxels =
      examples::voxels_of_depth(camera->model.k(), [&](std::size_t i) { return depth->pixels()[i] / units; });
  if (voxels.is_too_large(resolution, examples::free_memory()))
    return report_error(2, "--resolution: " + voxels.describe(resolution, "the image") + ", which is too many");
  if (voxels.takes_long(resolution))
    std::fprintf(stderr, "depth_to_octree: %s; this takes a long time\n",
                 voxels.describe(resolution, "the image").c_str());
  orbis::octree::occupancy_octree<> map{resolution};
  const orbis::camera::depth_view metres{*depth, units};
  const auto scan = map.integrate(metres, camera->model, orbis::se3{orbis::so3{q}, orbis::vec3{p.data()}});
  if (scan.used == 0) return report_error(2, orbis::shortened_path(input) + ": no depth within the bounds of the map");
  if (const auto done = write_bt(map, output); !done) return report_error(2, examples::describe(done.error()));
  return 0;
}

int main(int argc, char** argv) {
  return examples::run_program("depth_to_octree", [&] { return run(argc, argv); });
}
