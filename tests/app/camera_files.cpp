// SPDX-License-Identifier: BSD-3-Clause
#include "rgbd_slam/camera_files.hpp"

#include <string>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

using Catch::Matchers::Contains;
using orbis::test::temporary_folder;

TEST_CASE("cameras in the files of other programs are read") {
  const temporary_folder folder;
  struct example {
    std::string name, text, model;
    double depth_scale;
  };
  for (
      const example& e : {
          example{"open3d.json",
                  R"({"width": 640, "height": 480, "intrinsic_matrix": [525.5, 0, 0, 0, 526.5, 0, 319.5, 239.5, 1]})",
                  "pinhole", 1000},
          example{
              "rows.json",
              R"({"w": 640, "h": 480, "K": [[525.5, 0, 319.5], [0, 526.5, 239.5], [0, 0, 1]], "depth_scale": 0.001})",
              "pinhole", 1000},
          example{"realsense.json",
                  R"({"width": 640, "height": 480, "ppx": 319.5, "ppy": 239.5, "fx": 525.5, "fy": 526.5,
                       "model": "distortion.inverse_brown_conrady", "coeffs": [0, 0, 0, 0, 0], "depth_scale": 0.00025})",
                  "pinhole", 4000},
          example{
              "replica.json",
              R"({"camera": {"w": 640, "h": 480, "fx": 525.5, "fy": 526.5, "cx": 319.5, "cy": 239.5, "scale": 6553.5}})",
              "pinhole", 6553.5},
          example{"calibration.yaml",
                  "image_width: 640\nimage_height: 480\ncamera_name: rgb\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
                  "  data: [525.5, 0.0, 319.5, 0.0, 526.5, 239.5, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n"
                  "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.0, 0.0, 0.05]\n",
                  "radtan", 1000},
          example{"message.yaml",
                  "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: color\nheight: 480\nwidth: 640\n"
                  "distortion_model: equidistant\nd:\n- 0.1\n- 0.01\n- 0.0\n- 0.0\nk:\n- 525.5\n- 0.0\n- 319.5\n- 0.0\n"
                  "- 526.5\n- 239.5\n- 0.0\n- 0.0\n- 1.0\n---\n",
                  "kannala_brandt", 1000},
          example{"orb.yaml",
                  "%YAML:1.0\n---\nCamera.type: \"PinHole\"\nCamera.fx: 525.5\nCamera.fy: 526.5\nCamera.cx: 319.5\n"
                  "Camera.cy: 239.5\n\nCamera.k1: 0.2\nCamera.k2: -0.9\nCamera.p1: -0.005\nCamera.p2: 0.002\n"
                  "Camera.width: 640\nCamera.height: 480\nCamera.fps: 15.0\n# comment\nDepthMapFactor: 5000.0\n",
                  "radtan", 5000},
      }) {
    INFO(e.name);
    const auto file = app::read_camera_file(folder.write(e.name, e.text));
    REQUIRE(file.has_value());
    const auto& k = file->camera.model.k();
    CHECK((k.width == 640 && k.height == 480));
    CHECK((k.fx == 525.5 && k.fy == 526.5 && k.cx == 319.5 && k.cy == 239.5));
    CHECK(file->camera.model.model_name() == e.model);
    CHECK(std::abs(file->camera.depth_scale - e.depth_scale) < 1e-9);
    CHECK_THAT(file->describe(), Contains(e.name + ", " + e.model) && Contains("640 x 480, fx 525.5"));
    CHECK(app::named_camera((folder / e.name).string()).has_value());
  }
  for (const char* const text :
       {"525.5 0 319.5\n0 526.5 239.5\n0 0 1\n", "525.5 0 319.5 0 0 526.5 239.5 0 0 0 1 0 0 0 0 1",
        "525.5 0 0\n0 526.5 0\n319.5 239.5 1\n", "525.5 526.5 319.5 239.5\n"}) {
    const auto file = app::read_camera_file(folder.write("cam_K.txt", text));
    CHECK(file.value().camera.model.k().cx == 319.5);
    CHECK(file->camera.model.width() == 0);  // unknown
    CHECK_THAT(file->describe(), Contains("millimetres are assumed"));
  }
  folder.write("associated.txt", "");
  const auto eth3d = app::read_camera_file(folder.write("calibration.txt", "525.5 526.5 319.5 239.5\n")).value();
  CHECK((eth3d.camera.model.k().fy == 526.5 && eth3d.camera.model.k().cy == 239.5));
  CHECK_THAT(eth3d.describe(), Contains("depth_scale 5000 (the depth scale of ETH3D is assumed)"));
  CHECK(app::find_camera_file(folder.path()) == folder / "calibration.yaml");
}

TEST_CASE("files that are no cameras are refused in one sentence") {
  const temporary_folder folder;
  for (const auto& [name, text, words] :
       {std::tuple{"a.json", std::string{"{\"width\": 640}"}, "width and height"},
        std::tuple{"a.json", std::string{"{\"width\": 640, \"height\": 480}"}, "has no camera"},
        std::tuple{"a.json", std::string{"{\"fx\": "}, "not valid JSON"},
        std::tuple{"a.json", std::string(300, '['), "nested"}, std::tuple{"a.json", std::string(300, '{'), "nested"},
        std::tuple{"a.json", std::string{}, "JSON"}, std::tuple{"a.yaml", std::string{"- 1\n- 2\n"}, "JSON"},
        std::tuple{"a.yaml", std::string{"\x01\x02\xFF: ["}, "JSON"},
        std::tuple{"a.txt", std::string{"525 525 319.5 239.5 0.26 -0.95 -0.005 0.002 1.16\n"},
                   "neither a camera matrix"},
        std::tuple{"a.json", std::string{R"({"width": 6, "height": 4, "K": [7, 7, 3, 2, 0, 0, 0, 0, 1]})"},
                   "camera matrix"},
        std::tuple{"a.json", std::string{R"({"width": 6, "height": 4, "fx": 900, "fy": 1, "cx": 1, "cy": 1})"},
                   "factor"},
        std::tuple{
            "a.json",
            std::string{R"({"width": 6, "height": 4, "fx": 1, "fy": 1, "cx": 1, "cy": 1, "distortion_model": "fov",
                                   "d": [0.1, 0.1, 0.1, 0.1]})"},
            "distortion model \"fov\""},
        std::tuple{"a.json", std::string{R"({"width": 640, "height": 480, "fx": -1, "fy": 1, "cx": 1, "cy": 1})"},
                   "must be positive"},
        std::tuple{"a.json",
                   std::string{R"({"width": 6, "height": 4, "fx": 1, "fy": 1, "cx": 1, "cy": 1, "depth_scale": 0})"},
                   "depth scale"},
        std::tuple{"a.json",
                   std::string{R"({"width": 6, "height": 4, "fx": 1, "fy": 1, "cx": 1, "cy": 1, "coeffs": [1, 2]})"},
                   "distortion model"},
        std::tuple{"a.json",
                   std::string{R"({"width": 160, "height": 120, "fx": 0.000001, "fy": 0.000001, "cx": 80, "cy": 60})"},
                   "fx = 1e-06 is too short"},
        std::tuple{"a.txt", std::string{"1 0 2\n0 1 2\n"}, "camera matrix"}}) {
    const auto file = app::read_camera_file(folder.write(name, text));
    INFO(text);
    REQUIRE_FALSE(file.has_value());
    CHECK_THAT(file.error().to_string(), Contains(name) && Contains(words));
  }
  std::string camera = R"({"width": 640, "height": 480, "K": [[525.5, 0, 319.5], [0, 526.5, 239.5], [0, 0, 1]]})";
  for (std::size_t i = 0; i != camera.size(); ++i) {  // cut or damaged anywhere: a camera or an error
    (void)app::read_camera_file(folder.write("cut.json", camera.substr(0, i)));
    std::string damaged = camera;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x15);
    (void)app::read_camera_file(folder.write("damaged.json", damaged));
  }
}
