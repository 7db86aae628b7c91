// SPDX-License-Identifier: BSD-3-Clause
//
// Every layout of a recording with a file missing, misnamed, empty, or of another format: the error names what was
// looked for and what is there.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/io/mono_recording.hpp>
#include <orbis/io/png.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/stereo_recording.hpp>

#include "io/recordings.hpp"
#include "support/catch.hpp"

namespace io = orbis::io;
namespace test = orbis::test;
using Catch::Matchers::Contains;
using orbis::image;
using orbis::rgb8;
using test::temporary_folder;

namespace {

using files = std::map<std::string, std::string>;

files with_images(files all, const std::vector<std::string>& color, const std::vector<std::string>& depth = {}) {
  for (const std::string& name : color) all[name] = test::tiny_color(9);
  for (const std::string& name : depth) all[name] = test::tiny_depth(9);
  return all;
}

const std::string sensor_yaml =
    "camera_model: pinhole\nresolution: [8, 6]\nintrinsics: [7, 7, 3.5, 2.5]\ndistortion_model: radial-tangential\n"
    "distortion_coefficients: [0, 0, 0, 0]\nrate_hz: 20\nT_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, "
    "1]\n";
const std::string right_yaml =
    "camera_model: pinhole\nresolution: [8, 6]\nintrinsics: [7, 7, 3.5, 2.5]\ndistortion_model: radial-tangential\n"
    "distortion_coefficients: [0, 0, 0, 0]\nT_BS:\n  data: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
const std::string csv =
    "#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n"
    "1403636579813555456,1403636579813555456.png\n";
const std::string identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
const std::string k = "7 0 3.5\n0 7 2.5\n0 0 1\n";

enum class sensor { depth, two, one };

/// A layout; `needed` are the files without which it cannot be opened, each with words of which the error contains one.
struct layout {
  std::string name;
  sensor kind;
  files all;
  std::map<std::string, std::vector<std::string>> needed;
};

std::vector<layout> layouts() {
  const std::string camera = test::tiny_camera;
  return {
      {"TUM",
       sensor::depth,
       with_images({{"camera.toml", camera},
                    {"rgb.txt", "1.0 rgb/a.png\n1.1 rgb/b.png\n"},
                    {"depth.txt", "1.0 depth/a.png\n1.1 depth/b.png\n"}},
                   {"rgb/a.png", "rgb/b.png"}, {"depth/a.png", "depth/b.png"}),
       {{"rgb.txt", {"rgb.txt"}},
        {"depth.txt", {"depth.txt"}},
        {"camera.toml", {"camera"}},
        {"rgb/a.png", {"a.png"}},
        {"depth/a.png", {"a.png"}}}},
      {"TUM with associations",
       sensor::depth,
       with_images({{"camera.toml", camera}, {"associations.txt", "1.0 c/a.png 1.0 d/a.png\n"}}, {"c/a.png"},
                   {"d/a.png"}),
       {{"associations.txt", {"associations.txt"}}, {"camera.toml", {"camera"}}}},
      {"7-Scenes",
       sensor::depth,
       with_images({{"frame-000000.pose.txt", identity}, {"camera-intrinsics.txt", k}}, {"frame-000000.color.png"},
                   {"frame-000000.depth.png"}),
       {{"camera-intrinsics.txt", {"camera"}}, {"frame-000000.depth.png", {"depth.png"}}}},
      {"ICL-NUIM",
       sensor::depth,
       {{"x.gt.freiburg", "1 0 0 0 0 0 0 1\n"},
        {"rgb/1.png", io::encode_png(image<rgb8>(640, 480))},
        {"depth/1.png", io::encode_png(image<std::uint16_t>(640, 480))}},
       {{"rgb/1.png", {"rgb"}}, {"depth/1.png", {"depth"}}}},
      {"ScanNet",
       sensor::depth,
       with_images(
           {{"intrinsic/intrinsic_color.txt", k}, {"intrinsic/intrinsic_depth.txt", k}, {"pose/0.txt", identity}},
           {"color/0.jpg"}, {"depth/0.png"}),
       {{"intrinsic/intrinsic_color.txt", {"intrinsic_color.txt"}},
        {"depth/0.png", {"depth/"}},
        {"color/0.jpg", {"color"}}}},
      {"folders",
       sensor::depth,
       with_images({{"camera.toml", camera}}, {"color/000000.png"}, {"aligned_depth/000000.png"}),
       {{"camera.toml", {"camera"}}, {"aligned_depth/000000.png", {"depth"}}, {"color/000000.png", {"color"}}}},
      {"KITTI",
       sensor::two,
       with_images({{"calib.txt", "P0: 7 0 3.5 0 0 7 2.5 0 0 0 1 0\nP1: 7 0 3.5 -3 0 7 2.5 0 0 0 1 0\n"},
                    {"times.txt", "0\n0.1\n"}},
                   {"image_0/000000.png", "image_1/000000.png"}),
       {{"calib.txt", {"calib.txt"}},
        {"times.txt", {"times.txt"}},
        {"image_0/000000.png", {"image_0"}},
        {"image_1/000000.png", {"image_1"}}}},
      {"ASL",
       sensor::two,
       with_images({{"mav0/cam0/sensor.yaml", sensor_yaml},
                    {"mav0/cam1/sensor.yaml", right_yaml},
                    {"mav0/cam0/data.csv", csv},
                    {"mav0/cam1/data.csv", csv}},
                   {"mav0/cam0/data/1403636579763555584.png", "mav0/cam0/data/1403636579813555456.png",
                    "mav0/cam1/data/1403636579763555584.png", "mav0/cam1/data/1403636579813555456.png"}),
       {{"mav0/cam0/sensor.yaml", {"sensor.yaml"}},
        {"mav0/cam0/data.csv", {"data.csv"}},
        {"mav0/cam1/sensor.yaml", {"sensor.yaml"}},
        {"mav0/cam1/data.csv", {"data.csv"}},
        {"mav0/cam0/data/1403636579763555584.png", {"1403636579763555584.png"}}}},
      {"pairs",
       sensor::two,
       with_images({{"camera.toml", camera + "baseline = 0.1\n"}}, {"left/0.png", "right/0.png"}),
       {{"camera.toml", {"camera"}}, {"right/0.png", {"right"}}, {"left/0.png", {"left"}}}},
      {"images",
       sensor::one,
       with_images({{"camera.toml", camera}}, {"images/0.png"}),
       {{"camera.toml", {"camera"}}, {"images/0.png", {"images"}}}},
  };
}

/// Opens the folder and reads the first frame; the error, or an empty text.
std::string failure(sensor kind, const std::filesystem::path& folder) {
  const auto open = [](auto opened) {
    if (!opened) return test::message_of(opened);
    return test::message_of(opened->frame(0));
  };
  switch (kind) {
    case sensor::depth: return open(io::open_recording(folder));
    case sensor::two: return open(io::open_stereo_recording(folder));
    case sensor::one: break;
  }
  return open(io::open_mono_recording(folder));
}

}  // namespace

TEST_CASE("every layout with a file missing, misnamed, empty or of another format is refused in words that help") {
  const std::vector<std::pair<std::string, std::function<void(const temporary_folder&, const std::string&)>>> damages{
      {"missing", [](const auto& folder, const auto& name) { std::filesystem::remove(folder / name); }},
      {"misnamed",
       [](const auto& folder, const auto& name) {
         std::filesystem::rename(folder / name, (folder / name).parent_path() / "other.bin");
       }},
      {"empty", [](const auto& folder, const auto& name) { folder.write(name, ""); }},
      {"another format", [](const auto& folder, const auto& name) { folder.write(name, "GIF89a\x01 not this\n"); }},
  };
  for (const layout& l : layouts()) {
    {
      INFO(l.name);
      const temporary_folder folder;
      for (const auto& [name, bytes] : l.all) folder.write(name, bytes);
      CHECK(failure(l.kind, folder.path()) == "");
    }
    for (const auto& [name, words] : l.needed)
      for (const auto& [what, damage] : damages) {
        const temporary_folder folder;
        for (const auto& [path, bytes] : l.all) folder.write(path, bytes);
        damage(folder, name);
        const std::string message = failure(l.kind, folder.path());
        INFO(l.name << ", " << name << " " << what << ": " << message);
        REQUIRE_FALSE(message.empty());
        CHECK(message.size() < 700);
        CHECK_THAT(message, Contains(folder.path().filename().string()));  // names the folder or a file in it
        const bool says = std::any_of(words.begin(), words.end(),
                                      [&](const std::string& word) { return message.find(word) != std::string::npos; });
        const bool lists = message.find("not a known recording; the folder ") != std::string::npos;
        CHECK((says || lists));
      }
  }
}

TEST_CASE("every file with a camera is refused if that cannot have made the images") {
  std::size_t cameras = 0;
  for (const layout& l : layouts())
    for (const auto& [name, bytes] : l.all) {
      const std::string wrong = std::regex_replace(bytes, std::regex{"\\b7\\b(\\.0)?"}, "0.001");
      if (name.ends_with(".png") || name.ends_with(".jpg") || wrong == bytes) continue;
      const temporary_folder folder;
      for (const auto& [path, content] : l.all) folder.write(path, path == name ? wrong : content);
      INFO(l.name << ", " << name << ": " << wrong);
      CHECK_THAT(failure(l.kind, folder.path()),
                 Contains(std::filesystem::path{name}.filename().string() + ": fx = 0.001 is too short"));
      const bool is_left = l.kind == sensor::two && name.find("cam1") == std::string::npos;
      if (is_left) CHECK_THAT(failure(sensor::one, folder.path()), Contains("fx = 0.001 is too short"));
      ++cameras;
    }
  CHECK(cameras == 11);
}
