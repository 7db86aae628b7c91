// SPDX-License-Identifier: BSD-3-Clause
//
// make_recording FOLDER FRAMES WIDTH [READ_OUT_MS]: a synthetic recording as a folder in TUM's format; with a read-out,
// by a hand that shakes.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <orbis/io/png.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/trajectory_file.hpp>

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return 1;
  const std::filesystem::path folder = argv[1];
  const int width = std::atoi(argv[3]);
  orbis::io::synthetic_options options{
      .frames = std::atoi(argv[2]), .width = width, .height = width / 4 * 3, .frames_around = 360};
  if (argc == 5) {
    options.path.jitter = 5.0;
    options.sensor.shutter.color_read_out = options.sensor.shutter.depth_read_out = 0.001 * std::atof(argv[4]);
  }
  const orbis::io::synthetic_recording recording{options};

  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  std::ofstream colors{folder / "rgb.txt"}, depths{folder / "depth.txt"}, camera{folder / "camera.toml"};
  for (std::size_t i = 0; i != recording.size(); ++i) {
    const auto frame = recording.frame(i).value();
    char name[64];
    std::snprintf(name, sizeof name, "%06zu.png", i);
    if (!orbis::io::write_png(folder / "rgb" / name, frame.color.view()) ||
        !orbis::io::write_png(folder / "depth" / name, frame.depth.view()))
      return 1;
    colors << frame.timestamp << " rgb/" << name << '\n';
    depths << frame.timestamp << " depth/" << name << '\n';
  }
  const auto settings = recording.camera();
  const auto& k = settings.model.k();
  camera << "model = \"pinhole\"\nwidth = " << k.width << "\nheight = " << k.height << "\nfx = " << k.fx
         << "\nfy = " << k.fy << "\ncx = " << k.cx << "\ncy = " << k.cy << "\ndepth_scale = " << settings.depth_scale
         << "\nfps = " << settings.fps << '\n';
  if (argc == 5) camera << "read_out_ms = " << argv[4] << "\ndepth_read_out_ms = " << argv[4] << '\n';
  if (!orbis::io::write_trajectory(folder / "groundtruth.txt", recording.ground_truth())) return 1;
  return colors && depths && camera ? 0 : 1;
}
