// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include <orbis/camera/presets.hpp>

#include "camera/model_checks.hpp"

using namespace orbis;
using namespace orbis::camera;

TEST_CASE("every preset is a VGA camera that sees through all its pixels") {
  for (const std::string_view name : preset_names) {
    const auto settings = preset(name);
    REQUIRE(settings);
    CHECK((settings->model.width() == 640 && settings->model.height() == 480));
    CHECK(settings->fps == 30.0);
    CHECK(settings->depth_scale == (name == "kinect" ? 1000.0 : 5000.0));
    CHECK(test::round_trip_error(settings->model) < 1e-9);
  }
}

TEST_CASE("presets have the published numbers") {
  const any_camera fr1 = preset("tum_fr1").value().model;
  CHECK(fr1 == any_camera{radial_tangential{{640, 480, 517.3, 516.5, 318.6, 255.3},
                                            {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}}});
  const any_camera fr2 = preset("tum_fr2").value().model;
  CHECK(fr2 ==
        any_camera{radial_tangential{{640, 480, 520.9, 521.0, 325.1, 249.7},
                                     {.k1 = 0.2312, .k2 = -0.7849, .p1 = -0.0033, .p2 = -0.0001, .k3 = 0.9172}}});
  CHECK(preset("tum_fr3").value().model == any_camera{pinhole{640, 480, 535.4, 539.2, 320.1, 247.6}});
  CHECK(preset("icl").value().model == any_camera{pinhole{640, 480, 481.2, 480.0, 319.5, 239.5}});
  CHECK(preset("kinect").value().model == any_camera{pinhole{640, 480, 525.0, 525.0, 319.5, 239.5}});
}

TEST_CASE("only the camera of freiburg1 has a typical shutter") {
  for (const std::string_view name : preset_names)
    CHECK(typical_shutter(preset(name).value().model).has_value() == (name == "tum_fr1"));
  CHECK(typical_shutter(preset("tum_fr1").value().model) == shutter{0.020, 0.020, -0.013});
  CHECK(!typical_shutter(pinhole{640, 480, 517.3, 516.5, 318.6, 255.3}));
}

TEST_CASE("a name that is no preset is answered with those that are") {
  for (const std::string_view name : {"", "tum_fr4", "ICL"}) {
    const auto r = preset(name);
    REQUIRE(!r);
    CHECK(r.error().code == errc::invalid_argument);
    for (const std::string_view known : preset_names) CHECK(r.error().message.find(known) != std::string::npos);
  }
}
