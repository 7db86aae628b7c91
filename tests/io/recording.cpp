// SPDX-License-Identifier: BSD-3-Clause
#include <iterator>
#include <string>

#include <orbis/camera/presets.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

namespace io = orbis::io;
using orbis::test::message_of;
using orbis::test::temporary_folder;

static_assert(std::input_iterator<io::recording::iterator>);
static_assert(std::sentinel_for<std::default_sentinel_t, io::recording::iterator>);

namespace {

/// Four frames at 0, 1, 2, 3 seconds, whose pixels are 1, 2, 3, 4.
void write_recording(const temporary_folder& folder) {
  std::string rgb, depth;
  for (int i = 0; i != 4; ++i) {
    const std::string n = std::to_string(i);
    folder.write("rgb/" + n + ".png", orbis::test::tiny_color(static_cast<std::uint8_t>(i + 1)));
    folder.write("depth/" + n + ".png", orbis::test::tiny_depth(static_cast<std::uint16_t>(i + 1)));
    rgb += n + " rgb/" + n + ".png\n";
    depth += n + ".01 depth/" + n + ".png\n";
  }
  folder.write("rgb.txt", rgb);
  folder.write("depth.txt", depth);
  folder.write("groundtruth.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  folder.write("camera.toml", orbis::test::tiny_camera);
}

int valid_depths(const orbis::camera::rgbd_frame& frame) {
  int count = 0;
  for (int y = 0; y != frame.depth.height(); ++y)
    for (int x = 0; x != frame.depth.width(); ++x) count += frame.depth_metres()(x, y) > 0.0F ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("the frames of a recording come one by one") {
  const temporary_folder folder;
  write_recording(folder);
  int count = 0;
  for (const auto& frame : io::open_recording(folder.path()).value()) {
    CHECK(frame.timestamp == count);
    CHECK(frame.depth_timestamp.value() == Approx(count + 0.01));
    CHECK(frame.color(7, 5).g == count + 1);
    CHECK(frame.depth(7, 5) == count + 1);
    CHECK(frame.depth_scale == 5000.0);
    CHECK(frame.T_world_camera.has_value() == (count < 2));
    ++count;
  }
  CHECK(count == 4);
}

TEST_CASE("frames are read in any order and a recording can be gone over again") {
  const temporary_folder folder;
  write_recording(folder);
  auto recording = io::open_recording(folder.path()).value();
  CHECK(recording.size() == 4);
  CHECK(recording.timestamp(2) == 2.0);
  CHECK(recording.format() == io::recording_format::tum);
  CHECK(recording.ground_truth().size() == 2);
  CHECK(recording.frame(3).value().color(0, 0).r == 4);
  CHECK(recording.frame(1).value().color(0, 0).r == 2);
  for (int pass = 0; pass != 2; ++pass) {
    int count = 0;
    for (const auto& frame : recording) count += frame.color(0, 0).r;
    CHECK(count == 10);
    CHECK(recording.status());
  }
}

TEST_CASE("a colour image is read alone") {
  const temporary_folder folder;
  write_recording(folder);
  const auto recording = io::open_recording(folder.path()).value();
  std::filesystem::remove(folder.path() / "depth" / "2.png");
  for (std::size_t i = 0; i != 4; ++i) {
    const auto color = recording.color(i).value();
    CHECK(color.width() == recording.camera().model.width());
    CHECK(color(7, 5).g == i + 1);
  }
  CHECK_FALSE(recording.frame(2));
  std::filesystem::remove(folder.path() / "rgb" / "1.png");
  const auto gone = recording.color(1);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().code == orbis::errc::not_found);
}

TEST_CASE("iteration ends at a damaged frame and says why") {
  const temporary_folder folder;
  write_recording(folder);
  const std::string good = orbis::test::tiny_depth(9);
  folder.write("depth/2.png", good.substr(0, good.size() / 2));
  auto recording = io::open_recording(folder.path()).value();
  int count = 0;
  for (const auto& frame : recording) count += frame.color(0, 0).r > 0 ? 1 : 0;
  CHECK(count == 2);
  REQUIRE_FALSE(recording.status());
  CHECK(recording.status().error().code == orbis::errc::malformed);
  CHECK(recording.status().error().where == (folder / "depth/2.png").string());
  CHECK(recording.frame(3).has_value());
  folder.write("depth/2.png", good);
  for (const auto& frame : recording) count += frame.color(0, 0).r > 0 ? 1 : 0;
  CHECK(count == 6);
  CHECK(recording.status());
}

TEST_CASE("an image that does not exist or has another size is an error on access") {
  const temporary_folder folder;
  write_recording(folder);
  std::filesystem::remove(folder / "rgb/1.png");
  folder.write("rgb/2.png", io::encode_png(orbis::image<orbis::rgb8>(4, 4)));
  folder.write("depth/3.png", orbis::test::tiny_color(1));
  const auto recording = io::open_recording(folder.path()).value();
  CHECK(recording.frame(0).has_value());
  CHECK(recording.frame(1).error().code == orbis::errc::not_found);
  CHECK(recording.frame(2).error().message == "the image has 4x4 pixels, but the camera has 8x6");
  CHECK(recording.frame(3).error().code == orbis::errc::unsupported);
}

TEST_CASE("the camera comes from the option or the file or the format and else the error says so") {
  const temporary_folder folder;
  write_recording(folder);
  CHECK(io::open_recording(folder.path()).value().camera().model.k().fx == 7.0);
  const auto kinect = orbis::camera::preset("kinect").value();
  CHECK(io::open_recording(folder.path(), {.camera = kinect}).value().camera().model.k().fx == 525.0);
  folder.write("camera.toml", "model = 'pinhole'\nwidth = 8\nheight = 6\nfx = nan\nfy = 7\ncx = 0\ncy = 0\n");
  CHECK(message_of(io::open_recording(folder.path())) ==
        (folder / "camera.toml").string() + ": fx must be a number above zero");
  CHECK(io::open_recording(folder.path(), {.camera = kinect}).has_value());
  std::filesystem::remove(folder / "camera.toml");
  const auto unknown = io::open_recording(folder.path());
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().code == orbis::errc::invalid_argument);
  CHECK(unknown.error().message.find("camera.toml") != std::string::npos);
}

TEST_CASE("formats are told apart") {
  const temporary_folder folder;
  folder.write("tum/rgb.txt", "x");
  folder.write("icl/rgb/0.png", "x");
  folder.write("icl/depth/0.png", "x");
  folder.write("icl/a.gt.freiburg", "x");
  folder.write("folders/color/0.jpg", "x");
  folder.write("folders/aligned_depth/0.png", "x");
  folder.write("scenes/frame-000000.color.png", "x");
  folder.write("other/readme.txt", "x");
  CHECK(io::detect_format(folder / "tum") == io::recording_format::tum);
  CHECK(io::detect_format(folder / "icl") == io::recording_format::icl_nuim);
  CHECK(io::detect_format(folder / "folders") == io::recording_format::folders);
  CHECK(io::detect_format(folder / "scenes") == io::recording_format::seven_scenes);
  CHECK(io::detect_format(folder / "other") == io::recording_format::automatic);
  CHECK(io::open_recording(folder / "other").error().code == orbis::errc::unsupported);
  CHECK(io::open_recording(folder / "none").error().code == orbis::errc::not_found);
  CHECK(io::open_recording(folder / "tum" / "rgb.txt").error().code == orbis::errc::unsupported);
  // A value that is no format at all is no silent choice of one of them.
  CHECK(io::open_recording(folder / "icl", {.format = static_cast<io::recording_format>(17)}).error().code ==
        orbis::errc::unsupported);
  CHECK(io::open_recording(folder / "other", {.format = io::recording_format::tum}).error().code ==
        orbis::errc::not_found);
}

TEST_CASE("a piece of the TUM benchmark opens and reads") {
  ORBIS_NEEDS_DATA("fr1_desk_9");
  auto recording = io::open_recording(orbis::test::data_dir() / "fr1_desk_9").value();
  CHECK(recording.size() == 9);
  int frames = 0;
  for (const auto& frame : recording) {
    ++frames;
    CHECK(frame.T_world_camera.has_value());
    CHECK(valid_depths(frame) > 150000);
  }
  CHECK(frames == 9);
  CHECK(recording.status());
}

TEST_CASE("real 7-Scenes frames open and read") {
  ORBIS_NEEDS_DATA("sevenscenes_raw");
  auto recording = io::open_recording(orbis::test::data_dir() / "sevenscenes_raw").value();
  CHECK(recording.format() == io::recording_format::seven_scenes);
  CHECK(recording.camera().model.k().fx == 585.0);
  CHECK_FALSE(recording.notes().empty());
  int frames = 0;
  for (const auto& frame : recording) {
    ++frames;
    int far = 0;
    for (int y = 0; y != frame.depth.height(); ++y)
      for (int x = 0; x != frame.depth.width(); ++x) far += frame.depth_metres()(x, y) > 20.0F ? 1 : 0;
    CHECK(far == 0);  // 65535 is no depth
    CHECK(valid_depths(frame) > 100000);
  }
  CHECK(frames == 10);
}

TEST_CASE("the real kitchen and living room open with all frames") {
  ORBIS_NEEDS_DATA("kitchen");
  ORBIS_NEEDS_DATA("livingroom");
  const auto kitchen = io::open_recording(orbis::test::data_dir() / "kitchen").value();
  CHECK(kitchen.size() == 500);
  CHECK(kitchen.notes().empty());
  CHECK(valid_depths(kitchen.frame(250).value()) > 100000);
  const auto room = io::open_recording(orbis::test::data_dir() / "livingroom").value();
  CHECK(room.size() == 211);
  CHECK(valid_depths(room.frame(210).value()) > 100000);
}
