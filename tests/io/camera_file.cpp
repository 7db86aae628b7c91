// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/presets.hpp>
#include <orbis/io/camera_file.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
namespace camera = orbis::camera;

namespace {

/// A good camera file in which one line is replaced (or, without a value, left out).
std::string camera_text(const std::string& key = "", const std::optional<std::string>& value = {}) {
  const std::vector<std::pair<std::string, std::string>> fields{
      {"model", "\"radtan\""}, {"width", "640"},
      {"height", "480"},       {"fx", "517.3"},
      {"fy", "516.5"},         {"cx", "318.6"},
      {"cy", "255.3"},         {"distortion", "[0.26, -0.95, -0.005, 0.002, 1.16]"},
      {"depth_scale", "5000"}, {"fps", "30"},
      {"baseline", "0.075"}};
  std::string text = "# a camera\n";
  for (const auto& [name, usual] : fields) {
    if (name != key)
      text += name + " = " + usual + "\n";
    else if (value)
      text += name + " = " + *value + "\n";
  }
  return text;
}

std::string message(const std::string& text) {
  const auto read = io::parse_camera(text, "camera.toml");
  return read ? "" : read.error().to_string();
}

}  // namespace

TEST_CASE("a camera file gives every setting") {
  const auto settings = io::parse_camera(camera_text()).value();
  const auto* model = settings.model.get_if<camera::radial_tangential>();
  REQUIRE(model != nullptr);
  CHECK(model->k() == camera::intrinsics{640, 480, 517.3, 516.5, 318.6, 255.3});
  CHECK(model->distortion() == camera::radial_tangential::coefficients{0.26, -0.95, -0.005, 0.002, 1.16});
  CHECK(settings.depth_scale == 5000.0);
  CHECK(settings.fps == 30.0);
  CHECK(settings.baseline == 0.075);
}

TEST_CASE("what may be left out of a camera file has its default") {
  const auto settings = io::parse_camera("model='pinhole'\nwidth=2\nheight=3\nfx=1\nfy=1\ncx=0\ncy=0\n").value();
  CHECK(settings.depth_scale == 1000.0);
  CHECK(settings.fps == 30.0);
  CHECK_FALSE(settings.baseline.has_value());
}

TEST_CASE("a key that is no setting of a camera is named, lest a misspelt one gets its default") {
  CHECK(message(camera_text() + "depth_scal = 1000.0\n")
            .starts_with("camera.toml: depth_scal is not a camera setting; the settings are model, width, "));
  CHECK(message(camera_text() + "[left]\nfx = 1.0\n").starts_with("camera.toml: left is not a camera setting"));
  CHECK(message(camera_text("fx") + "f_x = 1.0\n") == "camera.toml: fx is missing");  // the first that is wrong
}

TEST_CASE("a bad field of a camera file is named") {
  CHECK(message(camera_text("fx", "-1.0")) == "camera.toml: fx must be a number above zero");
  for (const char* field : {"fx", "fy", "depth_scale", "fps", "baseline"})
    for (const char* bad : {"0", "-1.0", "nan", "inf", "1e300", "\"wide\"", "[1]"}) {
      INFO(field << " = " << bad);
      CHECK(message(camera_text(field, bad)).find(std::string{"camera.toml: "} + field + " must") == 0);
    }
  for (const char* field : {"width", "height"})
    for (const char* bad : {"0", "-640", "640.5", "1e12", "nan", "\"wide\""}) {
      INFO(field << " = " << bad);
      CHECK(message(camera_text(field, bad)).find(std::string{"camera.toml: "} + field + " must") == 0);
    }
  for (const char* field : {"cx", "cy"})
    for (const char* bad : {"nan", "-inf", "\"middle\""})
      CHECK(message(camera_text(field, bad)).find(std::string{"camera.toml: "} + field + " must") == 0);
  for (const char* field : {"model", "width", "height", "fx", "fy", "cx", "cy"})
    CHECK(message(camera_text(field)) == std::string{"camera.toml: "} + field + " is missing");
}

TEST_CASE("the length of the distortion is checked against the model") {
  CHECK(message(camera_text("distortion", "[1.0, 2.0, 3.0]")) ==
        "camera.toml: distortion has 3 values; the model radtan takes 4, 5 or 8");
  CHECK(message(camera_text("distortion", "[0, 0, 0, 0, nan]")).find("distortion must be") != std::string::npos);
  CHECK(message(camera_text("distortion", "0.3")).find("distortion must be") != std::string::npos);
  CHECK(message(camera_text("distortion")).find("distortion has 0 values") != std::string::npos);
  CHECK(message(camera_text("model", "\"pinhole\"")).find("the model pinhole takes none") != std::string::npos);
  CHECK(message(camera_text("model", "\"kannala_brandt\"")).find("takes 4") != std::string::npos);
}

TEST_CASE("an unknown model and text that is not TOML are refused") {
  CHECK(message(camera_text("model", "\"fisheye\"")) ==
        "camera.toml: model \"fisheye\" is not one of pinhole, radtan, kannala_brandt");
  CHECK(message("model = \"pinhole\"\nwidth = = 3\n").find("camera.toml:2: not TOML") == 0);
  CHECK(io::read_camera("/nonexistent/camera.toml").error().code == orbis::errc::not_found);
}

TEST_CASE("every truncation of a camera file is an error or a camera") {
  const std::string good = camera_text();
  for (std::size_t n = 0; n < good.size(); ++n) {
    const auto read = io::parse_camera(std::string_view{good}.substr(0, n));
    if (!read) CHECK_FALSE(read.error().message.empty());
  }
}

TEST_CASE("cameras survive writing and reading exactly") {
  const orbis::test::temporary_folder folder;
  std::vector<camera::camera_settings> all;
  for (const auto name : camera::preset_names) all.push_back(camera::preset(name).value());
  all.push_back(
      {.model = camera::kannala_brandt{{848, 800, 286.1 / 3.0, 286.2, 424.5, 400.5}, {-0.01, 0.04, -0.03, 0.006}},
       .depth_scale = 1.0 / 3.0,
       .fps = 29.97,
       .baseline = 0.0641});
  all.push_back({.model = camera::radial_tangential{{640, 480, 500.0, 501.0, 320.0, 240.0},
                                                    {0.1, 0.01, 0.001, -0.001, 0.02, 0.11, 0.012, 0.013}},
                 .depth_scale = 1000.0,
                 .fps = 1e-7});
  for (const auto& settings : all) {
    REQUIRE(io::write_camera(folder / "camera.toml", settings));
    const auto read = io::read_camera(folder / "camera.toml").value();
    CHECK(read.model == settings.model);
    CHECK(read.depth_scale == settings.depth_scale);
    CHECK(read.fps == settings.fps);
    CHECK(read.baseline == settings.baseline);
  }
}

TEST_CASE("the camera file of a real recording is read") {
  ORBIS_NEEDS_DATA("fr1_desk_9/camera.toml");
  const auto settings = io::read_camera(orbis::test::data_dir() / "fr1_desk_9" / "camera.toml").value();
  CHECK(settings.model == camera::preset("tum_fr1").value().model);
  CHECK(settings.depth_scale == 5000.0);
}

TEST_CASE("tables nested without end are refused before they use up the stack") {
  const orbis::test::temporary_folder folder;
  for (const std::size_t depth : {8000U, 500'000U}) {
    std::string text = "a";
    for (std::size_t i = 0; i != depth; ++i) text += ".a";
    text += " = 1\n";
    CHECK(io::parse_camera(text).error().code == orbis::errc::malformed);
    CHECK(io::read_camera(folder.write("deep.toml", text)).error().code == orbis::errc::malformed);
  }
  CHECK(io::parse_camera(camera_text() + std::string(20000, '#')).error().to_string() ==
        "is too large for a settings file");
}

TEST_CASE("A camera file may say when the rows of the images are taken") {
  const std::string camera = "model = \"pinhole\"\nwidth = 640\nheight = 480\nfx = 525.0\nfy = 525.0\n";
  const auto shutter_of = [&](const std::string& lines) {
    return io::parse_camera(camera + "cx = 1.0\ncy = 1.0\n" + lines);
  };
  CHECK_FALSE(shutter_of("").value().shutter);
  CHECK(shutter_of("read_out_ms = 0").value().shutter->is_global());
  const auto both = shutter_of("read_out_ms = 30.0\n").value().shutter;
  CHECK(both->color_read_out == Approx(0.03));
  CHECK(both->depth_read_out == both->color_read_out);
  CHECK(both->depth_delay == 0.0);
  const auto all = shutter_of("read_out_ms = 30.0\ndepth_read_out_ms = 20\ndepth_delay_ms = -12.5\n").value();
  CHECK(all.shutter->depth_read_out == Approx(0.02));
  CHECK(all.shutter->depth_delay == Approx(-0.0125));
  CHECK_FALSE(shutter_of("read_out_ms = -1.0"));
  CHECK_FALSE(shutter_of("read_out_ms = \"fast\""));
  CHECK_FALSE(shutter_of("depth_delay_ms = 2000.0"));
}
