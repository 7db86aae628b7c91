// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of camera_file.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <toml++/toml.h>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/detail/files/camera_fields.hpp>
#include <orbis/io/toml.hpp>

namespace orbis::io {

ORBIS_INLINE result<camera::camera_settings> parse_camera(std::string_view text, const std::filesystem::path& where) {
  const auto parsed = parse_toml(text, where);
  if (!parsed) return fail(parsed.error());
  const toml::table& table = *parsed;
  detail::camera_fields fields{table, where.string()};
  const std::string model = fields.text("model");
  const camera::intrinsics k{
      .width = fields.size("width"),
      .height = fields.size("height"),
      .fx = fields.positive("fx"),
      .fy = fields.positive("fy"),
      .cx = fields.number("cx", std::nullopt, "a finite number", [](double v) { return std::abs(v) < 1e9; }),
      .cy = fields.number("cy", std::nullopt, "a finite number", [](double v) { return std::abs(v) < 1e9; })};
  const std::vector<double> d = fields.numbers("distortion");
  camera::camera_settings settings{
      .model = {}, .depth_scale = fields.positive("depth_scale", 1000.0), .fps = fields.positive("fps", 30.0)};
  fields.accept_only({"model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth_scale", "fps",
                      "baseline", "read_out_ms", "depth_read_out_ms", "depth_delay_ms"});
  const auto seconds = [&](const char* name, double fallback, double least) {
    return 0.001 * fields.number(name, 1000.0 * fallback, "a time in milliseconds, at most 1000",
                                 [&](double v) { return v >= least && v <= 1000.0; });
  };
  if (table.contains("read_out_ms") || table.contains("depth_read_out_ms") || table.contains("depth_delay_ms")) {
    camera::shutter& s = settings.shutter.emplace();
    s.color_read_out = seconds("read_out_ms", 0.0, 0.0);
    s.depth_read_out = seconds("depth_read_out_ms", s.color_read_out, 0.0);
    s.depth_delay = seconds("depth_delay_ms", 0.0, -1000.0);
  }
  if (table.contains("baseline")) settings.baseline = fields.positive("baseline");
  if (fields.failure()) return fail(*fields.failure());

  const auto list = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  const auto wrong_length = [&](const char* wanted) {
    return fail(errc::malformed, where.string(),
                "distortion has " + std::to_string(d.size()) + " values, the model " + model + " takes " + wanted);
  };
  if (model == "pinhole") {
    if (std::any_of(d.begin(), d.end(), [](double v) { return v != 0.0; })) return wrong_length("none");
    settings.model = camera::pinhole{k};
  } else if (model == "radtan") {
    if (d.size() != 4 && d.size() != 5 && d.size() != 8) return wrong_length("4, 5 or 8");
    settings.model =
        camera::radial_tangential{k, {list(0), list(1), list(2), list(3), list(4), list(5), list(6), list(7)}};
  } else if (model == "kannala_brandt") {
    if (d.size() != 4) return wrong_length("4");
    settings.model = camera::kannala_brandt{k, {list(0), list(1), list(2), list(3)}};
  } else {
    return fail(errc::unsupported, where.string(),
                "model \"" + model + "\" is not one of pinhole, radtan, kannala_brandt");
  }
  return settings;
}

ORBIS_INLINE result<camera::camera_settings> read_camera(const std::filesystem::path& path) {
  const auto text = read_file(path, max_toml_bytes);
  if (!text) return fail(text.error());
  return parse_camera(*text, path);
}

ORBIS_INLINE result<void> write_camera(const std::filesystem::path& path, const camera::camera_settings& settings) {
  const auto number = [](double value) {
    char buffer[40];
    std::string text(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text;
  };
  const camera::intrinsics& k = settings.model.k();
  std::string distortion;
  const auto add = [&](double value) { distortion += (distortion.empty() ? "" : ", ") + number(value); };
  settings.model.visit([&](const auto& model) {
    using Model = std::remove_cvref_t<decltype(model)>;
    if constexpr (std::is_same_v<Model, camera::radial_tangential>) {
      const auto& d = model.distortion();
      for (const double value : {d.k1, d.k2, d.p1, d.p2, d.k3}) add(value);
      if (d.k4 != 0.0 || d.k5 != 0.0 || d.k6 != 0.0)
        for (const double value : {d.k4, d.k5, d.k6}) add(value);
    } else if constexpr (std::is_same_v<Model, camera::kannala_brandt>) {
      const auto& d = model.distortion();
      for (const double value : {d.k1, d.k2, d.k3, d.k4}) add(value);
    } else {
      static_assert(std::is_same_v<Model, camera::pinhole>, "a camera model whose distortion is not written");
    }
  });
  return write_file_atomically(path, [&](std::ostream& out) {
    out << "model = \"" << settings.model.model_name() << "\"\n"
        << "width = " << std::to_string(k.width) << "\nheight = " << std::to_string(k.height)
        << "\nfx = " << number(k.fx) << "\nfy = " << number(k.fy) << "\ncx = " << number(k.cx)
        << "\ncy = " << number(k.cy) << "\ndistortion = [" << distortion << "]\n"
        << "depth_scale = " << number(settings.depth_scale) << "  # stored value / depth_scale = metres\n"
        << "fps = " << number(settings.fps) << "\n";
    if (settings.baseline) out << "baseline = " << number(*settings.baseline) << "\n";
    if (settings.shutter)
      out << "read_out_ms = " << number(1000.0 * settings.shutter->color_read_out)
          << "\ndepth_read_out_ms = " << number(1000.0 * settings.shutter->depth_read_out)
          << "\ndepth_delay_ms = " << number(1000.0 * settings.shutter->depth_delay) << "\n";
  });
}

}  // namespace orbis::io
