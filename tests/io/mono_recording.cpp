// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <orbis/io/mono_recording.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/stereo_recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using Catch::Matchers::Contains;
using io::mono_format;
using test::message_of;
using test::temporary_folder;

namespace {

void write_images(const temporary_folder& folder, const std::vector<std::string>& names) {
  std::uint8_t value = 10;
  for (const std::string& name : names) folder.write(name, test::tiny_color(value++));
}

std::vector<double> times_of(const io::mono_recording& recording) {
  std::vector<double> times;
  for (std::size_t i = 0; i != recording.size(); ++i) times.push_back(recording.timestamp(i));
  return times;
}

const char* const sensor_yaml =
    "T_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.06, 0.0, 0.0, 1.0, 0.01, 0.0, 0.0, "
    "0.0, 1.0]\nrate_hz: 20\nresolution: [8, 6]\ncamera_model: pinhole\nintrinsics: [7.0, 7.1, 3.5, 2.5]\n"
    "distortion_model: radial-tangential\ndistortion_coefficients: [-0.02, 0.001, 0.0001, 0.0]\n";

}  // namespace

TEST_CASE("a list of colour images without depth is a recording of one camera") {
  const temporary_folder folder;
  write_images(folder, {"rgb/a.png", "rgb/b.png", "rgb/c.png"});
  folder.write("rgb.txt", "# time file\n1.0 rgb/a.png\n1.5 rgb/c.png\n1.25 rgb/b.png\nnonsense\n");
  folder.write("groundtruth.txt", "1 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 1\n");
  CHECK(io::detect_mono_format(folder.path()) == mono_format::tum);
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())), Contains("the camera is not known"));
  folder.write("camera.toml", test::tiny_camera);
  const auto recording = io::open_mono_recording(folder.path()).value();
  CHECK(recording.format() == mono_format::tum);
  CHECK(times_of(recording) == std::vector<double>{1.0, 1.25, 1.5});
  CHECK(recording.path(1) == folder.path() / "rgb/b.png");
  CHECK(recording.camera().model.k() == camera::intrinsics{8, 6, 7.0, 7.0, 3.5, 2.5});
  CHECK(recording.notes().size() == 3);  // the order, the line, and a frame between poses that are far apart
  CHECK(recording.files().size() == 3 + 3);
  const auto frame = recording.frame(2).value();
  CHECK(frame.timestamp == 1.5);
  CHECK(frame.color(7, 5) == rgb8{12, 12, 12});
  CHECK(frame.T_world_camera.value().translation() == vec3(1, 0, 0));
  CHECK(!recording.frame(1).value().T_world_camera);
  CHECK(recording.ground_truth().size() == 2);
}

TEST_CASE("one camera of KITTI is read with its own poses") {
  const temporary_folder folder;
  const int camera = GENERATE(0, 2);
  const std::string images = "image_" + std::to_string(camera);
  write_images(folder, {images + "/000000.png", images + "/000001.png", images + "/000003.png"});
  folder.write("calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP2: 7 0 3.5 0.7 0 7 2.5 0.35 0 0 1 0.1\n");
  folder.write("times.txt", "0.0\n0.1\n0.2\n");
  folder.write("poses.txt", "1 0 0 5 0 1 0 0 0 0 1 0\n0 0 1 5 0 1 0 0 -1 0 0 1\n1 0 0 1 0 1 0 0 0 0 1 2\n");
  CHECK(io::detect_mono_format(folder.path()) == mono_format::kitti);
  CHECK(io::detect_stereo_format(folder.path()) == io::stereo_format::automatic);
  const auto recording = io::open_mono_recording(folder.path()).value();
  CHECK(times_of(recording) == std::vector<double>{0.0, 0.1});
  CHECK(recording.notes().size() == 1);  // an image without a time
  CHECK(recording.camera().fps == 10.0);
  CHECK(recording.camera().model.k() == camera::intrinsics{8, 6, 7.0, 7.0, 3.5, 2.5});
  CHECK(recording.frame(1).value().color(0, 0) == rgb8{11, 11, 11});
  // Of camera 2 the projection of camera 0's origin is known: 7 x + 3.5 z = 0.7, 7 y + 2.5 z = 0.35, z = 0.1.
  const vec3 in_camera = camera == 0 ? vec3(0, 0, 0) : vec3(0.05, 0.1 / 7, 0.1);
  CHECK((recording.frame(0).value().T_world_camera.value() * in_camera - vec3(5, 0, 0)).norm() < 1e-12);
  CHECK((recording.frame(1).value().T_world_camera.value() * in_camera - vec3(5, 0, 1)).norm() < 1e-12);

  folder.write("calib.txt", "P1: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\n");
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())),
             Contains("calib.txt: P" + std::to_string(camera) + " is missing"));
  folder.write("times.txt", "0\n0\n");
  folder.write("calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP2: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\n");
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())), Contains("times.txt:2: "));
}

TEST_CASE("a camera of the ASL layout is read alone and from within its folder") {
  const temporary_folder folder;
  write_images(folder, {"mav0/cam0/data/1403636579763555584.png", "mav0/cam0/data/1403636579813555456.png"});
  folder.write("mav0/cam0/data.csv",
               "#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n"
               "1403636579813555456,1403636579813555456.png\n");
  folder.write("mav0/cam0/sensor.yaml", sensor_yaml);
  folder.write("mav0/state_groundtruth_estimate0/data.csv",
               "1403636579763555584,1.0,2.0,3.0,1.0,0.0,0.0,0.0\n1403636579813555456,1.5,2.0,3.0,1.0,0.0,0.0,0.0\n");
  CHECK(io::detect_stereo_format(folder.path()) == io::stereo_format::automatic);  // without a second camera
  {
    // A clock that counts nanoseconds from the start.
    const temporary_folder uptime;
    write_images(uptime, {"mav0/cam0/data/0.png", "mav0/cam0/data/50000000.png"});
    uptime.write("mav0/cam0/data.csv", "#timestamp [ns],filename\n0,0.png\n50000000,50000000.png\n");
    uptime.write("mav0/cam0/sensor.yaml", sensor_yaml);
    CHECK(times_of(io::open_mono_recording(uptime.path()).value()) == std::vector<double>{0.0, 0.05});
  }
  for (const char* const where : {".", "mav0", "mav0/cam0", "mav0/cam0/"}) {
    const auto path = folder.path() / where;
    CHECK(io::detect_mono_format(path) == mono_format::asl);
    const auto recording = io::open_mono_recording(path).value();
    REQUIRE(recording.size() == 2);
    CHECK(recording.camera().fps == 20.0);
    CHECK(recording.camera().model.model_name() == "radtan");
    CHECK(std::abs(recording.timestamp(1) - recording.timestamp(0) - 0.05) < 1e-6);
    const se3 pose = recording.frame(1).value().T_world_camera.value();
    CHECK((pose.translation() - vec3(1.5, 1.94, 3.01)).norm() < 1e-9);
    CHECK((pose.rotation() * vec3::UnitX() - vec3::UnitY()).norm() < 1e-6);
  }
}

TEST_CASE("the names of images in a plain folder tell their times") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera + std::string{"fps = 10\n"});
  const auto times = [&](const std::vector<std::string>& names) {
    write_images(folder, names);
    const auto recording = io::open_mono_recording(folder.path()).value();
    CHECK(recording.format() == mono_format::images);
    return times_of(recording);
  };
  SECTION("numbers, with and without leading zeros") {
    CHECK(times({"images/9.png", "images/10.png", "images/0011.PNG"}) == std::vector<double>{0.9, 1.0, 1.1});
  }
  SECTION("numbers behind a word") {
    CHECK(times({"frame_000002.png", "frame_000004.png"}) == std::vector<double>{0.2, 0.4});
  }
  SECTION("seconds") { CHECK(times({"rgb/1.25.png", "rgb/10.5.png"}) == std::vector<double>{1.25, 10.5}); }
  SECTION("nanoseconds") {
    CHECK(times({"data/1500000000000000000.png", "data/1500000000500000000.png"}) ==
          std::vector<double>{1.5e9, 1.5e9 + 0.5});
  }
  SECTION("nothing in common") {
    CHECK(times({"color/a1.png", "color/b1.png"}) == std::vector<double>{0.0, 0.1});
    CHECK_THAT(io::open_mono_recording(folder.path()).value().notes()[0], Contains("alphabetical order"));
  }
  SECTION("a list of times is for the images by their numbers, not by the alphabet") {
    folder.write("times.txt", "3.5\n4.5\n5.5\n");
    CHECK(times({"2.png", "10.png", "9.png"}) == std::vector<double>{3.5, 4.5, 5.5});
    const auto recording = io::open_mono_recording(folder.path()).value();
    CHECK(recording.path(1).filename() == "9.png");
    CHECK(recording.path(2).filename() == "10.png");
    CHECK(recording.notes().empty());
  }
  SECTION("a list of times has the last word") {
    folder.write("times.txt", "3.5\n4.5\n5.5\n");
    CHECK(times({"000000.png", "000007.png"}) == std::vector<double>{3.5, 4.5});
    CHECK_THAT(io::open_mono_recording(folder.path()).value().notes()[0], Contains("3 time stamps for 2 images"));
    folder.write("times.txt", "3.5\nfour\n");
    CHECK_THAT(message_of(io::open_mono_recording(folder.path())), Contains("times.txt:2: "));
  }
}

TEST_CASE("recordings with depth or with two cameras give the images of one") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  write_images(folder, {"frame-000000.color.png", "frame-000003.color.png"});
  for (const char* const depth : {"frame-000000.depth.png", "frame-000003.depth.png"})
    folder.write(depth, test::tiny_depth(1000));
  CHECK(io::detect_mono_format(folder.path()) == mono_format::rgbd);
  const auto recording = io::open_mono_recording(folder.path()).value();
  CHECK(times_of(recording) == std::vector<double>{0.0, 0.1});
  CHECK(recording.files().size() == 3);
  CHECK(recording.color(1).value()(0, 0) == rgb8{11, 11, 11});

  const temporary_folder pairs;
  pairs.write("camera.toml", test::tiny_camera);
  write_images(pairs, {"left/0.png", "left/1.png", "right/0.png", "right/1.png"});
  CHECK(io::open_mono_recording(pairs.path()).value().path(1) == pairs.path() / "left/1.png");
}

TEST_CASE("a folder that is no recording is told what was looked for and what is there") {
  const temporary_folder folder;
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())),
             Contains("known layouts: rgb.txt (TUM)") && Contains("mav0/cam0") && Contains("the folder is empty"));
  folder.write("readme.md", "");
  for (const char c : {'a', 'b', 'c', 'd'}) folder.write(std::string{c} + ".tiff", "");
  folder.write("cam_left/x", "");
  const std::string there = "the folder holds cam_left/, readme.md, 4 .tiff files";
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())), Contains(there));
  CHECK_THAT(message_of(io::open_recording(folder.path())),
             Contains("known layouts: rgb.txt and depth.txt") && Contains(there));
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())),
             Contains("known layouts: image_0") && Contains(there));
  CHECK_THAT(message_of(io::open_mono_recording(folder.path(), {.format = mono_format::images})),
             Contains("no PNG or JPEG images in it") && Contains(there));
  for (int i = 0; i != 12; ++i) folder.write("seq" + std::to_string(i) + "/x", "");
  CHECK_THAT(message_of(io::open_mono_recording(folder.path())), Contains("seq3/, seq4/ and 7 more"));
  CHECK_THAT(message_of(io::open_mono_recording(folder.path() / "none")), Contains("no such folder"));
  CHECK_THAT(message_of(io::open_mono_recording(folder.path() / "readme.md")),
             Contains("is a file; a recording is a folder"));
}

TEST_CASE("an image of another size than the one camera is refused") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  write_images(folder, {"0.png"});
  folder.write("1.png", io::encode_png(image<rgb8>(8, 7)));
  const auto recording = io::open_mono_recording(folder.path()).value();
  CHECK(recording.frame(0));
  CHECK_THAT(message_of(recording.frame(1)), Contains("8x7 pixels, but the camera has 8x6"));
}

TEST_CASE("the excerpts of KITTI open as one camera's") {
  ORBIS_NEEDS_DATA("kitti07_mono");
  const auto recording = io::open_mono_recording(test::data_dir() / "kitti07_mono").value();
  CHECK(recording.size() == 160);
  CHECK(recording.format() == mono_format::tum);
  CHECK(recording.notes().empty());
  CHECK(recording.ground_truth().size() == 160);
  CHECK(recording.frame(159).value().color.width() == 1226);
  CHECK(recording.frame(159).value().T_world_camera.has_value());
}
