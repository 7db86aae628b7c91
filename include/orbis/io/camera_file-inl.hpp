// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of camera_file.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <ostream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/plausible.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/io/toml.hpp>

namespace orbis::io {
namespace detail {

/// Reads the fields of a camera table; keeps the first failure.
class camera_fields {
 public:
  camera_fields(const toml::table& table, std::string where) : table_{table}, where_{std::move(where)} {}

  /// The number with the key `name`; it must satisfy `ok`, which `wanted` describes in errors.
  template <class Ok>
  double number(const char* name, std::optional<double> fallback, const char* wanted, Ok&& ok) {
    const auto node = table_[name];
    if (!node) {
      if (!fallback) reject(name, "is missing");
      return fallback.value_or(1.0);
    }
    const std::optional<double> value = node.value<double>();
    if (!value || !std::isfinite(*value) || !ok(*value)) {
      reject(name, std::string{"must be "} + wanted);
      return 1.0;
    }
    return *value;
  }
  double positive(const char* name, std::optional<double> fallback = std::nullopt) {
    return number(name, fallback, "a number above zero", [](double v) { return v > 0.0 && v < 1e9; });
  }
  int size(const char* name) {
    return static_cast<int>(number(name, std::nullopt, "a whole number from 1 to 100000",
                                   [](double v) { return v >= 1.0 && v <= 1e5 && v == std::floor(v); }));
  }
  std::string text(const char* name) {
    const auto node = table_[name];
    const std::optional<std::string> value = node.value<std::string>();
    if (!node)
      reject(name, "is missing");
    else if (!value)
      reject(name, "must be a string");
    return value.value_or("");
  }
  std::vector<double> numbers(const char* name) {
    std::vector<double> values;
    const auto node = table_[name];
    if (!node) return values;
    const toml::array* list = node.as_array();
    if (list == nullptr) {
      reject(name, "must be a list of numbers");
      return values;
    }
    for (const toml::node& element : *list) {
      const std::optional<double> value = element.value<double>();
      if (!value || !std::isfinite(*value)) reject(name, "must be a list of finite numbers");
      values.push_back(value.value_or(0.0));
    }
    return values;
  }
  /// Rejects keys that are not in `known`, so that a misspelt key does not silently leave a setting at its default.
  void accept_only(std::initializer_list<std::string_view> known) {
    for (const auto& [key, value] : table_) {
      if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
      std::string names;
      for (const std::string_view name : known) names += (names.empty() ? "" : ", ") + std::string{name};
      reject(shortened(key.str(), 60).c_str(), "is not a camera setting; the settings are " + names);
    }
  }
  void reject(const char* name, const std::string& why) {
    if (!failure_) failure_ = error{errc::malformed, where_, std::string{name} + " " + why};
  }
  [[nodiscard]] const std::optional<error>& failure() const { return failure_; }

 private:
  const toml::table& table_;
  std::string where_;
  std::optional<error> failure_;
};

}  // namespace detail

ORBIS_LAZY_INLINE result<camera::camera_settings> parse_camera(std::string_view text,
                                                               const std::filesystem::path& where) {
  const auto parsed = parse_toml(text, where);
  if (!parsed) return fail(parsed.error());
  const toml::table& table = *parsed;
  detail::camera_fields fields{table, where.string()};
  const std::string model = fields.text("model");
  const camera::intrinsics read{
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
  const auto checked = camera::plausible(read, where.string());
  if (!checked) return fail(checked.error());
  const camera::intrinsics& k = *checked;

  const auto list = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  const auto wrong_length = [&](const char* wanted) {
    return fail(errc::malformed, where.string(),
                "distortion has " + std::to_string(d.size()) + " values; the model " + model + " takes " + wanted);
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
                "model " + in_quotes(model) + " is not one of pinhole, radtan, kannala_brandt");
  }
  return settings;
}

ORBIS_LAZY_INLINE result<camera::camera_settings> read_camera(const std::filesystem::path& path) {
  const auto text = read_file(path, max_toml_bytes);
  if (!text) return fail(text.error());
  return parse_camera(*text, path);
}

ORBIS_LAZY_INLINE result<void> write_camera(const std::filesystem::path& path,
                                            const camera::camera_settings& settings) {
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
      static_assert(std::is_same_v<Model, camera::pinhole>, "cannot write the distortion of this camera model");
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
