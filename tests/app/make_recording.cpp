// SPDX-License-Identifier: BSD-3-Clause
//
// make_recording FOLDER FRAMES WIDTH [READ_OUT_MS|- [K1 [BLIND]]]: a synthetic recording as a folder in TUM's format;
// with a read-out, by a hand that shakes; with K1, through a lens whose distortion camera.toml does not know of; the
// first BLIND frames without depth.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace {

/// The image that a lens with this radial distortion makes of a pinhole's; nothing where that shows nothing.
template <class T>
orbis::image<T> bent(const orbis::image<T>& straight, const orbis::camera::intrinsics& k, double k1) {
  orbis::image<T> out(straight.width(), straight.height());
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x) {
      const double by_lens_x = (x - k.cx) / k.fx, by_lens_y = (y - k.cy) / k.fy;
      double scale = 1.0;
      for (int i = 0; i != 30; ++i)
        scale = 1.0 + k1 * (by_lens_x * by_lens_x + by_lens_y * by_lens_y) / (scale * scale);
      const long u = std::lround(k.cx + k.fx * by_lens_x / scale), v = std::lround(k.cy + k.fy * by_lens_y / scale);
      const bool is_seen = u >= 0 && v >= 0 && u < straight.width() && v < straight.height();
      out(x, y) = is_seen ? straight(static_cast<int>(u), static_cast<int>(v)) : T{};
    }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4 || argc > 7) return 1;
  const std::filesystem::path folder = argv[1];
  const int width = std::atoi(argv[3]);
  orbis::io::synthetic_options options{
      .frames = std::atoi(argv[2]), .width = width, .height = width / 4 * 3, .frames_around = 360};
  const bool rolls = argc > 4 && std::string_view{argv[4]} != "-";
  if (rolls) {
    options.path.jitter = 5.0;
    options.sensor.shutter.color_read_out = options.sensor.shutter.depth_read_out = 0.001 * std::atof(argv[4]);
  }
  const double k1 = argc > 5 ? std::atof(argv[5]) : 0.0;
  const std::size_t blind = argc > 6 ? static_cast<std::size_t>(std::atoi(argv[6])) : 0;
  const orbis::io::synthetic_recording recording{options};
  const auto settings = recording.camera();
  const auto& k = settings.model.k();

  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  std::ofstream colors{folder / "rgb.txt"}, depths{folder / "depth.txt"}, camera{folder / "camera.toml"};
  for (std::size_t i = 0; i != recording.size(); ++i) {
    auto frame = recording.frame(i).value();
    if (k1 != 0.0) {
      frame.color = bent(frame.color, k, k1);
      frame.depth = bent(frame.depth, k, k1);
    }
    if (i < blind) std::ranges::fill(frame.depth.pixels(), std::uint16_t{0});
    char name[64];
    std::snprintf(name, sizeof name, "%06zu.png", i);
    if (!orbis::io::write_png(folder / "rgb" / name, frame.color.view()) ||
        !orbis::io::write_png(folder / "depth" / name, frame.depth.view()))
      return 1;
    colors << frame.timestamp << " rgb/" << name << '\n';
    depths << frame.timestamp << " depth/" << name << '\n';
  }
  camera << "model = \"pinhole\"\nwidth = " << k.width << "\nheight = " << k.height << "\nfx = " << k.fx
         << "\nfy = " << k.fy << "\ncx = " << k.cx << "\ncy = " << k.cy << "\ndepth_scale = " << settings.depth_scale
         << "\nfps = " << settings.fps << '\n';
  if (rolls) camera << "read_out_ms = " << argv[4] << "\ndepth_read_out_ms = " << argv[4] << '\n';
  if (!orbis::io::write_trajectory(folder / "groundtruth.txt", recording.ground_truth())) return 1;
  return colors && depths && camera ? 0 : 1;
}
