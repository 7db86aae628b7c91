// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>

#include <orbis/io/detail/recordings/scannet.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"

using namespace orbis;
using Catch::Matchers::Contains;
using test::message_of;
using test::temporary_folder;

namespace {

const camera::pinhole color_model{48, 36, 40.0, 40.0, 23.5, 17.5}, depth_model{16, 12, 14.0, 14.0, 7.0, 6.0};

/// A wall two metres before the colour camera, whose colour tells where one looks.
rgb8 color_of(const vec3& on_wall) {
  const vec3 p = on_wall / on_wall.z() * 2.0;
  return {static_cast<std::uint8_t>(std::lround(128.0 + 50.0 * p.x())),
          static_cast<std::uint8_t>(std::lround(128.0 + 50.0 * p.y())), 7};
}

std::string matrix_of(const se3& T) {
  const auto m = T.to_matrix();
  std::string text;
  for (int row = 0; row != 4; ++row) {
    for (int column = 0; column != 4; ++column) text += std::to_string(m(row, column)) + " ";
    text += "\n";
  }
  return text;
}

/// Depth is the wall's from a camera that looks the same way.
void write_scene(const temporary_folder& folder) {
  image<rgb8> color{48, 36};
  for (int y = 0; y != 36; ++y)
    for (int x = 0; x != 48; ++x) color(x, y) = color_of(*color_model.unproject(vec2(x, y)));
  for (const char* const n : {"0", "2", "10"}) {
    const std::string name{n};
    folder.write("color/" + name + ".png", io::encode_png(color));
    folder.write("depth/" + name + ".png", io::encode_png(image<std::uint16_t>(16, 12, 2000)));
    folder.write("pose/" + name + ".txt", "1 0 0 " + name + "\n0 1 0 2\n0 0 1 3\n0 0 0 1\n");
  }
  folder.write("color/11.png", io::encode_png(color));
  folder.write("pose/2.txt", "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  folder.write("intrinsic/intrinsic_color.txt", "40 0 23.5 0\n0 40 17.5 0\n0 0 1 0\n0 0 0 1\n");
  folder.write("intrinsic/intrinsic_depth.txt", "14 0 7 0\n0 14 6 0\n0 0 1 0\n0 0 0 1\n");
  folder.write("intrinsic/extrinsic_color.txt", matrix_of(se3{}));
  folder.write("intrinsic/extrinsic_depth.txt", matrix_of(se3{}));
}

/// Checks that each pixel of depth has the colour of what the colour camera sees there. `surface`: what a pixel of the
/// depth camera sees, in the colour camera's frame.
template <class Surface>
void check_colors(const image<rgb8>& color, const Surface& surface) {
  REQUIRE(color.width() == 16);
  int seen = 0;
  for (int y = 0; y != 12; ++y)
    for (int x = 0; x != 16; ++x) {
      const vec3 p = surface(vec3(*depth_model.unproject(vec2(x, y))));
      const auto pixel = color_model.project(p);
      if (!pixel || pixel->x() < 1 || pixel->y() < 1 || pixel->x() > 46 || pixel->y() > 34) continue;
      const rgb8 expected = color_of(p), got = color(x, y);
      CHECK(std::abs(expected.r - got.r) <= 1);
      CHECK(std::abs(expected.g - got.g) <= 1);
      ++seen;
    }
  CHECK(seen > 100);
}

}  // namespace

TEST_CASE("an exported scene of ScanNet is read with colour resampled to depth") {
  const temporary_folder folder;
  write_scene(folder);
  CHECK(io::detect_format(folder.path()) == io::recording_format::scannet);
  auto recording = io::open_recording(folder.path()).value();
  CHECK(to_string(recording.format()) == "scannet");
  REQUIRE(recording.size() == 3);
  CHECK(recording.timestamp(2) == 10.0 / 30.0);
  CHECK(recording.camera().model.k() == depth_model.k());
  CHECK(recording.camera().depth_scale == 1000.0);
  CHECK(recording.notes().size() == 3);  // no depth, no pose, resampled
  CHECK(recording.files().size() == 4 + 3 + 6);
  CHECK(recording.ground_truth().size() == 2);
  const auto frame = recording.frame(2).value();
  CHECK(frame.T_world_camera.value().translation() == vec3(10, 2, 3));
  CHECK(!recording.frame(1).value().T_world_camera);
  CHECK(frame.depth(3, 3) == 2000);
  check_colors(frame.color, [](const vec3& ray) { return ray; });
  CHECK(recording.color(0).value() == frame.color);
}

TEST_CASE("extrinsics of ScanNet say where the two cameras stand") {
  const temporary_folder folder;
  write_scene(folder);
  SECTION("turned") {
    const so3 R = so3::exp(vec3(0.02, -0.03, 0.1));
    folder.write("intrinsic/extrinsic_depth.txt", matrix_of(se3{R, vec3::Zero()}));
    const auto recording = io::open_recording(folder.path()).value();
    check_colors(recording.color(0).value(), [&](const vec3& ray) { return vec3(R * ray); });
  }
  SECTION("apart, and without depth in a pixel") {
    image<std::uint16_t> depth(16, 12, 2000);
    depth(8, 6) = 0;
    folder.write("depth/0.png", io::encode_png(depth));
    folder.write("intrinsic/extrinsic_color.txt", matrix_of(se3{so3{}, vec3(-0.1, 0.0, 0.0)}));
    const auto recording = io::open_recording(folder.path()).value();
    const auto color = recording.color(0).value();
    CHECK(color == recording.frame(0).value().color);
    const auto at = [](const vec3& ray, double z) { return vec3(ray * z + vec3(0.1, 0.0, 0.0)); };
    check_colors(recording.color(2).value(), [&](const vec3& ray) { return at(ray, 2.0); });
    CHECK(color(7, 6) == recording.color(2).value()(7, 6));
    CHECK(std::abs(color(8, 6).r - color_of(*depth_model.unproject(vec2(8, 6))).r) <= 1);  // as if far away
  }
}

TEST_CASE("a scene of ScanNet as one camera has its colour images as they are") {
  const temporary_folder folder;
  write_scene(folder);
  const auto recording = io::open_mono_recording(folder.path()).value();
  CHECK(recording.format() == io::mono_format::rgbd);
  CHECK(recording.camera().model.k() == color_model.k());
  CHECK(recording.color(0).value().width() == 48);
  CHECK(recording.notes().size() == 2);
}

TEST_CASE("colour is not averaged away where focal lengths are far apart, and absurd ones are refused") {
  const temporary_folder folder;
  write_scene(folder);
  const std::string f = GENERATE("1", "0.9", "1e-9", "1e-300");
  folder.write("intrinsic/intrinsic_depth.txt", f + " 0 7 0\n0 " + f + " 6 0\n0 0 1 0\n0 0 0 1\n");
  const auto recording = io::open_recording(folder.path());
  if (f.starts_with("1e"))
    CHECK_THAT(message_of(recording), Contains("intrinsic_depth.txt: fx = 1e-"));
  else
    CHECK(recording.value().frame(0).value().color(7, 6).b == 7);  // where both look straight ahead
}

TEST_CASE("damaged files of ScanNet are named") {
  const temporary_folder folder;
  write_scene(folder);
  const auto message = [&](const char* file, const char* text) {
    folder.write(file, text);
    const auto m = message_of(io::open_recording(folder.path()));
    write_scene(folder);
    return m;
  };
  CHECK_THAT(message("intrinsic/intrinsic_depth.txt", "1 2 3"),
             Contains("intrinsic_depth.txt: a camera matrix must have 9 or 16 finite numbers"));
  CHECK_THAT(message("intrinsic/intrinsic_color.txt", "40 1 23.5 0 40 17.5 0 0 1"), Contains("skew"));
  CHECK_THAT(message("intrinsic/extrinsic_color.txt", "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"),
             Contains("extrinsic_color.txt: the matrix is not a rigid transform"));
  CHECK_THAT(message("pose/10.txt", "1 0 0"), Contains("10.txt: a pose must be a 4x4 matrix"));
  folder.write("depth/2.png", io::encode_png(image<std::uint16_t>(16, 11, 1)));
  CHECK_THAT(message_of(io::open_recording(folder.path()).value().frame(1)),
             Contains("16x11 pixels, but the camera has 16x12"));
  folder.write("color/2.png", io::encode_png(image<rgb8>(47, 36)));
  CHECK_THAT(message_of(io::open_recording(folder.path()).value().color(1)),
             Contains("47x36 pixels, but the camera has 48x36"));
  std::filesystem::remove(folder.path() / "intrinsic" / "intrinsic_color.txt");
  CHECK_THAT(message_of(io::open_recording(folder.path())), Contains("intrinsic_color.txt"));
}
