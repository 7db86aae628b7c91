// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>

#include <orbis/io/png.hpp>
#include <orbis/io/stereo_recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using io::stereo_format;
using test::message_of;
using test::temporary_folder;

namespace {

/// A sequence of KITTI's: three pairs of 8x6 pixels.
void write_kitti(const temporary_folder& folder) {
  for (int i = 0; i != 3; ++i)
    for (const int camera : {0, 1})
      folder.write("image_" + std::to_string(camera) + "/00000" + std::to_string(i) + ".png",
                   test::tiny_color(static_cast<std::uint8_t>(10 * i + camera)));
  folder.write("calib.txt",
               "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP1: 7 0 3.5 -3.5 0 7 2.5 0 0 0 1 0\nP2: 1 2 3\nTr: 1 0 0 0\n");
  folder.write("times.txt", "0.0\n1.036e-01\n2.073e-01\n");
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 1\n1 0 0 1 0 1 0 0 0 0 1 2\n");
}

std::string sensor_yaml(const std::string& translation, const std::string& more = "") {
  return "# General sensor definitions.\nsensor_type: camera\ncomment: VI-Sensor (MT9M034)\n\nT_BS:\n  cols: 4\n  "
         "rows: 4\n"
         "  data: [0.0, -1.0, 0.0, " +
         translation +
         ",\n         1.0, 0.0, 0.0, -0.06,\n         0.0, 0.0, 1.0, 0.01,\n         0.0, 0.0, 0.0, 1.0]\n\n"
         "rate_hz: 20\nresolution: [8, 6]\ncamera_model: pinhole\nintrinsics: [7.0, 7.1, 3.5, 2.5] #fu, fv, cu, cv\n"
         "distortion_model: radial-tangential\ndistortion_coefficients: [-0.02, 0.001, 0.0001, 0.0]\n" +
         more;
}

/// The body's x points where the cameras' y does: the right camera is on its right side.
void write_asl(const temporary_folder& folder) {
  for (const int camera : {0, 1}) {
    const std::string name = "mav0/cam" + std::to_string(camera);
    folder.write(name + "/data.csv",
                 "#timestamp [ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n"
                 "1403636579813555456,1403636579813555456.png\r\n");
    for (const char* const image : {"1403636579763555584", "1403636579813555456"})
      folder.write(name + "/data/" + image + ".png", test::tiny_color(static_cast<std::uint8_t>(20 + camera)));
  }
  std::string right = sensor_yaml("0.0");
  right.replace(right.find("-0.06"), 5, "0.05");
  folder.write("mav0/cam0/sensor.yaml", sensor_yaml("0.0"));
  folder.write("mav0/cam1/sensor.yaml", right);
  folder.write("mav0/state_groundtruth_estimate0/data.csv",
               "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v...\n"
               "1403636579763555584,1.0,2.0,3.0,1.0,0.0,0.0,0.0,0.1,0.2,0.3\n"
               "1403636579813555456,1.5,2.0,3.0,1.0,0.0,0.0,0.0,0.1,0.2,0.3\n");
}

}  // namespace

TEST_CASE("a sequence of KITTI odometry is read with its poses and its baseline") {
  const temporary_folder folder;
  write_kitti(folder);
  CHECK(io::detect_stereo_format(folder.path()) == stereo_format::kitti);
  const auto recording = io::open_stereo_recording(folder.path()).value();
  REQUIRE(recording.size() == 3);
  CHECK(recording.format() == stereo_format::kitti);
  CHECK(recording.notes().empty());
  CHECK(recording.timestamp(1) == 0.1036);
  CHECK(recording.camera().baseline == 0.5);
  CHECK(recording.camera().model.k() == camera::intrinsics{8, 6, 7.0, 7.0, 3.5, 2.5});
  CHECK(recording.rectification().is_identity());
  CHECK(recording.files().size() == 3 + 6);
  const auto pair = recording.frame(2).value();
  CHECK(pair.left(3, 3) == rgb8{20, 20, 20});
  CHECK(pair.right(3, 3) == rgb8{21, 21, 21});
  CHECK(pair.T_world_camera.value().translation() == vec3(1, 0, 2));
  CHECK(recording.left(1).value()(0, 0) == rgb8{10, 10, 10});
  CHECK(recording.ground_truth().size() == 3);
}

TEST_CASE("poses of KITTI are found beside the sequences, and what has no partner is left out") {
  const temporary_folder folder;
  const temporary_folder images;
  write_kitti(images);
  std::filesystem::create_directories(folder.path() / "sequences");
  std::filesystem::copy(images.path(), folder.path() / "sequences" / "07", std::filesystem::copy_options::recursive);
  std::filesystem::remove(folder.path() / "sequences" / "07" / "poses.txt");
  std::filesystem::remove(folder.path() / "sequences" / "07" / "image_1" / "000001.png");
  folder.write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 1\n");
  const auto recording = io::open_stereo_recording(folder.path() / "sequences" / "07").value();
  REQUIRE(recording.size() == 2);
  CHECK(recording.timestamp(1) == 0.2073);
  CHECK(recording.frame(0).value().T_world_camera.has_value());
  CHECK(!recording.frame(1).value().T_world_camera.has_value());
  CHECK(recording.notes().size() == 2);  // the lonely image, and one pose too few
}

TEST_CASE("poses of KITTI are those of the left camera, whichever that is") {
  const temporary_folder folder;
  write_kitti(folder);
  std::filesystem::rename(folder.path() / "image_0", folder.path() / "image_2");
  std::filesystem::rename(folder.path() / "image_1", folder.path() / "image_3");
  // Camera 0's origin lies at (0.05, 0.05, 0.1) in camera 2's frame.
  folder.write("calib.txt", "P2: 7 0 3.5 0.7 0 7 2.5 0.6 0 0 1 0.1\nP3: 7 0 3.5 -2.8 0 7 2.5 0.6 0 0 1 0.1\n");
  const auto recording = io::open_stereo_recording(folder.path()).value();
  CHECK(recording.camera().baseline.value() == Approx(0.5));
  const se3 T_world_2 = recording.frame(1).value().T_world_camera.value();
  CHECK((T_world_2 * vec3(0.05, 0.05, 0.1) - vec3(0.5, 0, 1)).norm() < 1e-12);
  CHECK((recording.ground_truth()[2].T_world_camera * vec3(0.05, 0.05, 0.1) - vec3(1, 0, 2)).norm() < 1e-12);
}

TEST_CASE("of KITTI's folders only images count, each number once") {
  const temporary_folder folder;
  write_kitti(folder);
  for (const char* const camera : {"image_0", "image_1"}) {
    folder.write(std::string{camera} + "/000001.jpeg", "another");
    folder.write(std::string{camera} + "/000002.txt", "no image");
  }
  const auto recording = io::open_stereo_recording(folder.path()).value();
  REQUIRE(recording.size() == 3);
  CHECK(recording.ground_truth().size() == 3);
  REQUIRE(recording.notes().size() == 1);
  CHECK_THAT(recording.notes()[0], Catch::Matchers::Contains("1 images with a repeated number"));
  for (const char* const image : {"000000.png", "000001.jpeg", "000001.png", "000002.png"})
    std::filesystem::remove(folder.path() / "image_1" / image);
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())),
             Catch::Matchers::Contains("image_1 holds 000002.txt"));
}

TEST_CASE("a format that has its cameras takes no other") {
  const temporary_folder folder;
  const bool is_kitti = GENERATE(true, false);
  is_kitti ? write_kitti(folder) : write_asl(folder);
  const std::string file = is_kitti ? "calib.txt" : "sensor.yaml";
  const camera::camera_settings other{.model = camera::pinhole{8, 6, 9.0, 9.0, 3.5, 2.5}, .baseline = 1.0};
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path(), {.camera = other})),
             Catch::Matchers::Contains("the two cameras are those in " + file));
  folder.write("camera.toml", test::tiny_camera);
  const auto recording = io::open_stereo_recording(folder.path()).value();
  REQUIRE(recording.notes().size() == 1);
  CHECK_THAT(recording.notes()[0], Catch::Matchers::Contains("camera.toml: not used"));
}

TEST_CASE("damaged files of KITTI are named with their line") {
  const temporary_folder folder;
  write_kitti(folder);
  const auto message = [&](const char* file, const char* text) {
    folder.write(file, text);
    const auto m = message_of(io::open_stereo_recording(folder.path()));
    write_kitti(folder);
    return m;
  };
  CHECK_THAT(message("calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1\n"),
             Catch::Matchers::Contains("calib.txt:1: a projection matrix must have 12 numbers"));
  CHECK_THAT(message("calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\n"), Catch::Matchers::Contains("P1 is missing"));
  CHECK_THAT(message("calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP1: 7 0 3.5 3.5 0 7 2.5 0 0 0 1 0\n"),
             Catch::Matchers::Contains("not a rectified pair"));
  CHECK_THAT(message("times.txt", "0\n1\n0.5\n"), Catch::Matchers::Contains("times.txt:3: "));
  CHECK_THAT(message("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 1 0 0 0 0 1 0\n"),
             Catch::Matchers::Contains("poses.txt:2: the matrix is not a rigid transform"));
  std::filesystem::remove(folder.path() / "times.txt");
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())), Catch::Matchers::Contains("times.txt"));
}

TEST_CASE("a recording in the ASL layout is read and rectified, with poses of the rectified camera") {
  const temporary_folder folder;
  write_asl(folder);
  CHECK(io::detect_stereo_format(folder.path()) == stereo_format::asl);
  const auto recording = io::open_stereo_recording(folder.path()).value();
  CHECK(io::open_stereo_recording(folder.path() / "mav0").value().size() == 2);
  REQUIRE(recording.size() == 2);
  CHECK(recording.camera().fps == 20.0);
  CHECK(recording.camera().baseline.value() == Approx(0.11).epsilon(1e-9));
  CHECK(!recording.rectification().is_identity());
  CHECK(std::abs(recording.timestamp(1) - recording.timestamp(0) - 0.05) < 1e-6);
  CHECK((recording.cameras().T_left_right.translation() - vec3(0.11, 0, 0)).norm() < 1e-12);
  const auto pair = recording.frame(1).value();
  CHECK(pair.left(4, 3) == rgb8{20, 20, 20});
  CHECK(pair.right(4, 3) == rgb8{21, 21, 21});
  // The left camera lies at (0, -0.06, 0.01) on the body, turned by 90 degrees about z.
  const se3 pose = pair.T_world_camera.value();
  CHECK((pose.translation() - vec3(1.5, 1.94, 3.01)).norm() < 1e-9);
  CHECK((pose.rotation() * vec3::UnitX() - vec3::UnitY()).norm() < 1e-6);
}

TEST_CASE("settings of ASL cameras that are damaged or not known are refused in words") {
  const temporary_folder folder;
  const auto message = [&](const std::string& from, const std::string& to) {
    write_asl(folder);
    std::string text = sensor_yaml("0.0");
    text.replace(text.find(from), from.size(), to);
    folder.write("mav0/cam0/sensor.yaml", text);
    return message_of(io::open_stereo_recording(folder.path()));
  };
  using Catch::Matchers::Contains;
  CHECK_THAT(message("resolution: [8, 6]", "resolution: [8, 6.5]"), Contains("resolution must be two whole numbers"));
  CHECK_THAT(message("resolution: [8, 6]", "resolution: [8]"), Contains("resolution has 1 numbers, not 2"));
  CHECK_THAT(message("resolution: [8, 6]", ""), Contains("sensor.yaml: resolution is missing"));
  CHECK_THAT(message("radial-tangential", "fov"), Contains("distortion_model \"fov\" is not one of"));
  CHECK_THAT(message("camera_model: pinhole", "camera_model: omni"), Contains("camera_model \"omni\""));
  CHECK_THAT(message("[7.0, 7.1", "[-7.0, 7.1"), Contains("focal lengths must be positive"));
  CHECK_THAT(message("[7.0, 7.1", "[seven, 7.1"), Contains("must be a list of finite numbers"));
  CHECK_THAT(message("data: [0.0", "data: [3.0"), Contains("T_BS: the matrix is not a rigid transform"));
  CHECK_THAT(message("1.0]", "1.0"), Contains("is an unterminated list"));
  CHECK_THAT(message("rate_hz: 20", "- 20"), Contains("sensor.yaml:13: is not \"name: value\""));
  CHECK_THAT(message("rate_hz: 20", "rate_hz: 0"), Contains("rate_hz"));
  CHECK_THAT(message("rate_hz: 20", "sensor_type: x"), Contains("a second time"));
  CHECK_THAT(message("radial-tangential", "equidistant"), !Contains("sensor.yaml"));
  write_asl(folder);
  folder.write("mav0/state_groundtruth_estimate0/data.csv", "1,2,3,4,0,0,0,1e-9\n");
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())), Contains("data.csv:1: the quaternion (w first) is"));
  write_asl(folder);
  folder.write("mav0/cam1/sensor.yaml", sensor_yaml("0.0"));  // both at one place
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())), Contains("must be to the right of the left one"));
}

TEST_CASE("two lists or two folders of images are a stereo recording, rectified or with a second camera") {
  const temporary_folder folder;
  for (const char* const side : {"left", "right"})
    for (int i = 0; i != 3; ++i)
      folder.write(std::string{side} + "/" + std::to_string(i) + ".png",
                   test::tiny_color(side == std::string{"left"} ? 30 : 31));
  const auto message = [&] { return message_of(io::open_stereo_recording(folder.path())); };
  CHECK(io::detect_stereo_format(folder.path()) == stereo_format::pairs);
  CHECK_THAT(message(), Catch::Matchers::Contains("the camera is not known"));
  folder.write("camera.toml", test::tiny_camera);
  CHECK_THAT(message(), Catch::Matchers::Contains("the baseline is not known"));
  folder.write("camera.toml", test::tiny_camera + std::string{"baseline = 0.2\nfps = 10\n"});
  {
    const auto recording = io::open_stereo_recording(folder.path()).value();
    REQUIRE(recording.size() == 3);
    CHECK(recording.timestamp(2) == 0.2);
    CHECK(recording.camera().baseline == 0.2);
    CHECK(recording.frame(0).value().right(0, 0) == rgb8{31, 31, 31});
    CHECK(!recording.camera().shutter);
  }
  folder.write("camera.toml", test::tiny_camera + std::string{"baseline = 0.2\nfps = 10\nread_out_ms = 20\n"});
  CHECK(io::open_stereo_recording(folder.path()).value().camera().shutter.value().color_read_out == Approx(0.02));
  folder.write("left.txt", "1.0 left/0.png\n2.0 left/1.png\n3.0 left/2.png\n");
  folder.write("right.txt", "1.001 right/0.png\n3.001 right/2.png\n");
  folder.write("groundtruth.txt", "1 0 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n");
  folder.write("camera_right.toml", test::tiny_camera);
  CHECK_THAT(message(), Catch::Matchers::Contains("T_left_right.txt"));
  folder.write("T_left_right.txt", "1 0 0 0.3\n0 1 0 0.01\n0 0 1 0\n0 0 0 1\n");
  const auto recording = io::open_stereo_recording(folder.path()).value();
  REQUIRE(recording.size() == 2);
  CHECK(recording.notes().size() == 1);
  CHECK(!recording.rectification().is_identity());
  CHECK(recording.camera().baseline.value() == Approx(std::hypot(0.3, 0.01)));
  CHECK(recording.frame(1).value().T_world_camera.value().translation() == vec3(2, 0, 0));
}

TEST_CASE("a folder that is no stereo recording is told what was looked for") {
  const temporary_folder folder;
  folder.write("readme.txt", "nothing here");
  CHECK(io::detect_stereo_format(folder.path()) == stereo_format::automatic);
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())),
             Catch::Matchers::Contains("KITTI") && Catch::Matchers::Contains("mav0/cam0"));
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path() / "none")),
             Catch::Matchers::Contains("no such folder"));
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path() / "readme.txt")),
             Catch::Matchers::Contains("is a file; a recording is a folder"));
}

TEST_CASE("an image of another size than its camera's is refused") {
  const temporary_folder folder;
  write_kitti(folder);
  folder.write("image_1/000002.png", io::encode_png(image<rgb8>(8, 7)));
  const auto recording = io::open_stereo_recording(folder.path()).value();
  CHECK(recording.frame(1));
  CHECK_THAT(message_of(recording.frame(2)), Catch::Matchers::Contains("8x7 pixels, but the camera has 8x6"));
}

TEST_CASE("a size that is far from that of the images is refused before there is memory for it") {
  const temporary_folder folder;
  write_asl(folder);
  for (const char* const camera : {"mav0/cam0", "mav0/cam1"}) {
    std::string text = sensor_yaml("0.0");
    text.replace(text.find("[8, 6]"), 6, "[100000, 100000]");
    text.replace(text.find("[7.0, 7.1"), 9, "[70000, 71000");  // of a camera that can have this size
    if (std::string{camera} == "mav0/cam1") text.replace(text.find("-0.06"), 5, "0.05");
    folder.write(std::string{camera} + "/sensor.yaml", text);
  }
  CHECK_THAT(message_of(io::open_stereo_recording(folder.path())),
             Catch::Matchers::Contains("8x6 pixels, but the camera has 100000x100000"));
}

TEST_CASE("the stereo excerpt of KITTI opens as a pair of lists") {
  ORBIS_NEEDS_DATA("kitti_stereo_a");
  const auto recording = io::open_stereo_recording(test::data_dir() / "kitti_stereo_a").value();
  CHECK(recording.size() == 51);
  CHECK(recording.format() == stereo_format::pairs);
  CHECK(recording.rectification().is_identity());
  CHECK(recording.camera().baseline.value() == 0.5371507);
  CHECK(recording.ground_truth().size() == 51);
  CHECK(recording.frame(50).value().right.width() == 1226);
}

TEST_CASE("times of stereo recordings have the unit of their clock or a warning") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera + std::string{"baseline = 0.2\nfps = 10\n"});
  std::string left, right;
  for (int i = 0; i != 4; ++i) {
    const std::string n = std::to_string(i);
    folder.write("left/" + n + ".png", test::tiny_color(1));
    folder.write("right/" + n + ".png", test::tiny_color(2));
    left += std::to_string(100.5 * i) + " left/" + n + ".png\n";
    right += std::to_string(100.5 * i) + " right/" + n + ".png\n";
  }
  folder.write("left.txt", left);  // milliseconds
  folder.write("right.txt", right);
  const auto slow = io::open_stereo_recording(folder.path()).value();
  REQUIRE(slow.notes().size() == 1);
  CHECK_THAT(slow.notes()[0], Catch::Matchers::Contains("1000 times too large"));
  folder.write("left.txt", "0 left/0.png\n1 left/1.png\n2 left/2.png\n");  // frame numbers
  folder.write("right.txt", "0 right/0.png\n1 right/1.png\n2 right/2.png\n");
  CHECK(io::open_stereo_recording(folder.path()).value().timestamp(2) == 0.2);
}
