// SPDX-License-Identifier: BSD-3-Clause
#include <random>
#include <string>
#include <vector>

#include <orbis/io/detail/recordings/image_folders.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"

namespace io = orbis::io;
namespace test = orbis::test;
using Catch::Matchers::Contains;
using test::message_of;
using test::temporary_folder;

namespace {

void write_pair(const temporary_folder& folder, const std::string& color, const std::string& depth, int value) {
  folder.write(color, test::tiny_color(static_cast<std::uint8_t>(value)));
  folder.write(depth, test::tiny_depth(static_cast<std::uint16_t>(value)));
}

std::string padded(int number, int width) {
  const std::string digits = std::to_string(number);
  return std::string(static_cast<std::size_t>(std::max(0, width - static_cast<int>(digits.size()))), '0') + digits;
}

}  // namespace

TEST_CASE("folders of any exporter are read by numbers or times in their names") {
  std::mt19937 random{3};
  const auto one_of = [&](const std::vector<std::string>& all) { return all[random() % all.size()]; };
  for (int trial = 0; trial != 40; ++trial) {
    const temporary_folder folder;
    folder.write("camera.toml", std::string{test::tiny_camera} + "fps = 10\n");
    const std::string color = one_of({"rgb", "color", "colour", "image", "images"}),
                      depth = one_of({"depth", "aligned_depth", "depth_registered", "aligned_depth_to_color"}),
                      color_prefix = one_of({"", "frame_", "color-"}), depth_prefix = one_of({"", "frame_", "d"});
    const bool by_time = random() % 2 == 0;
    const int color_width = static_cast<int>(random() % 8), depth_width = static_cast<int>(random() % 8),
              first = static_cast<int>(random() % 20);
    const std::int64_t unit = std::vector<std::int64_t>{1'000, 1'000'000, 1'000'000'000}[random() % 3];
    for (int i = 0; i != 12; ++i) {
      const auto name = [&](int width, double late) {
        return by_time ? std::to_string(static_cast<std::int64_t>(1305031102 * unit) +
                                        static_cast<std::int64_t>((0.1 * i + late) * static_cast<double>(unit)))
                       : padded(first + i, width);
      };
      write_pair(folder, color + "/" + color_prefix + name(color_width, 0.0) + ".png",
                 depth + "/" + depth_prefix + name(depth_width, 0.008) + ".png", i + 1);
    }
    INFO(color << " " << depth << " " << color_prefix << " " << depth_prefix << " " << by_time);
    CHECK(io::detect_format(folder.path()) == io::recording_format::folders);
    const auto recording = io::open_recording(folder.path()).value();
    REQUIRE(recording.size() == 12);
    CHECK(recording.notes().empty());
    for (std::size_t i = 0; i != 12; ++i) {
      const auto frame = recording.frame(i).value();
      CHECK(frame.color(0, 0).r == i + 1);
      CHECK(frame.depth(0, 0) == i + 1);
      CHECK(std::abs(frame.timestamp - recording.timestamp(0) - 0.1 * static_cast<double>(i)) < 2e-3);
    }
    if (!by_time) CHECK(recording.timestamp(0) == first / 10.0);
  }
}

TEST_CASE("what a folder of images has besides pairs is used or noted") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  for (int i = 0; i != 4; ++i)
    write_pair(folder, "color/" + std::to_string(i) + ".png", "depth/" + std::to_string(i) + ".png", i + 1);
  folder.write("color/9.png", test::tiny_color(9));
  folder.write("masks/0.png", test::tiny_color(1));
  folder.write("times.txt", "10\n10.5\n11\n11.5\n12\n");
  folder.write("groundtruth.txt", "10 1 2 3 0 0 0 1\n11.5 2 2 3 0 0 0 1\n");
  const auto recording = io::open_recording(folder.path()).value();
  REQUIRE(recording.size() == 4);
  CHECK(recording.timestamp(3) == 11.5);
  CHECK(recording.frame(3).value().T_world_camera.value().translation().x() == 2.0);
  REQUIRE(recording.notes().size() == 3);
  CHECK_THAT(recording.notes()[0], Contains("1 of 5 colour images have no counterpart"));
  CHECK_THAT(recording.notes()[1], Contains("the images in masks/ are not used"));
  CHECK_THAT(recording.notes()[2], Contains("2 of 4 frames are outside the ground truth"));
  // Registered depth is preferred, and the other folder is noted.
  for (int i = 0; i != 4; ++i) folder.write("aligned_depth/" + std::to_string(i) + ".png", test::tiny_depth(77));
  const auto registered = io::open_recording(folder.path()).value();
  CHECK(registered.frame(0).value().depth(0, 0) == 77);
  CHECK_THAT(registered.notes()[1], Contains("the images in depth/, masks/ are not used"));
  CHECK(io::open_mono_recording(folder.path()).value().size() == 4);
}

TEST_CASE("images with equal names that are neither numbers nor times pair by these names") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  int value = 0;
  for (const char* const name : {"a", "b", "door"})
    write_pair(folder, std::string{"rgb/"} + name + ".png", std::string{"depth/"} + name + ".png", ++value);
  const auto recording = io::open_recording(folder.path()).value();
  REQUIRE(recording.size() == 3);
  CHECK(recording.frame(2).value().depth(0, 0) == 3);
  REQUIRE(recording.notes().size() == 1);
  CHECK_THAT(recording.notes()[0], Contains("alphabetical order"));
}

TEST_CASE("one image with another name changes neither order nor times of the rest") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  for (int i = 0; i != 12; ++i)
    write_pair(folder, "rgb/" + std::to_string(i) + ".png", "depth/" + std::to_string(i) + ".png", i + 1);
  folder.write("rgb/preview.png", test::tiny_color(99));
  folder.write("rgb/._0.png", "resource fork");
  folder.write("depth/._0.png", "resource fork");
  const auto recording = io::open_recording(folder.path()).value();
  REQUIRE(recording.size() == 12);
  for (std::size_t i = 0; i != 12; ++i) {
    CHECK(recording.frame(i).value().color(0, 0).r == i + 1);
    CHECK(recording.timestamp(i) == static_cast<double>(i) / 30.0);
  }
  REQUIRE(recording.notes().size() == 1);
  CHECK_THAT(recording.notes()[0], Contains("1 images with other names (preview.png) are skipped"));
}

TEST_CASE("a ground truth of frame numbers or of seconds has the poses of the right frames") {
  for (const bool has_list : {false, true})
    for (const bool truth_has_numbers : {false, true}) {
      const temporary_folder folder;
      folder.write("camera.toml", std::string{test::tiny_camera} + "fps = 10\n");
      std::string list, truth;
      for (int i = 0; i != 40; ++i) {
        const std::string n = std::to_string(i);
        write_pair(folder, "rgb/" + n + ".png", "depth/" + n + ".png", i + 1);
        list += n + " rgb/" + n + ".png " + n + " depth/" + n + ".png\n";
        truth += (truth_has_numbers ? n : std::to_string(0.1 * i)) + " " + n + " 0 0 0 0 0 1\n";
      }
      if (has_list) folder.write("associations.txt", list);
      folder.write("groundtruth.txt", truth);
      INFO(has_list << truth_has_numbers);
      const auto recording = io::open_recording(folder.path()).value();
      REQUIRE(recording.size() == 40);
      for (std::size_t i = 0; i != 40; ++i) {
        const auto pose = recording.frame(i).value().T_world_camera;
        REQUIRE(pose.has_value());
        CHECK(std::abs(pose->translation().x() - static_cast<double>(i)) < 1e-4);
      }
    }
}

TEST_CASE("folders whose images do not pair are refused with both names") {
  const temporary_folder folder;
  folder.write("camera.toml", test::tiny_camera);
  write_pair(folder, "rgb/000001.png", "depth/1305031102.5.png", 1);
  CHECK_THAT(message_of(io::open_recording(folder.path())),
             Contains("(000001.png)") && Contains("(1305031102.5.png)") && Contains("rgb.txt and depth.txt"));
  std::filesystem::remove_all(folder / "depth");
  folder.write("depth/000007.png", test::tiny_depth(1));
  CHECK_THAT(
      message_of(io::open_recording(folder.path())),
      Contains("no image of rgb (000001.png to 000001.png) has a counterpart in depth (000007.png to 000007.png)"));
  std::filesystem::remove_all(folder / "depth");
  folder.write("depth/000001.npy", "x");
  CHECK_THAT(message_of(io::open_recording(folder.path())),
             Contains("depth: no PNG images") && Contains("holds 000001.npy"));
}
