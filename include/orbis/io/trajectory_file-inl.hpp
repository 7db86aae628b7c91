// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Function definitions of trajectory_file.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <string>

#include <orbis/core/file.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io {

ORBIS_INLINE result<trajectory> parse_trajectory(std::string_view text, const std::filesystem::path& where) {
  trajectory poses;
  std::string problem;
  std::size_t problem_line = 0;
  detail::for_each_line(text, [&](std::string_view line, std::size_t number) {
    const auto reject = [&](std::string why) {
      problem = std::move(why);
      problem_line = number;
      return false;
    };
    double v[8];
    for (double& value : v) {
      const std::string_view field = detail::next_field(line);
      if (field.empty()) return reject("a pose has 8 numbers: timestamp tx ty tz qx qy qz qw");
      if (!detail::parse_number(field, value))
        return reject("\"" + std::string{field.substr(0, 40)} + "\" is not a number");
      if (!std::isfinite(value)) return reject("a pose with NaN or infinity");
    }
    if (!detail::trimmed(line).empty()) return reject("a pose has 8 numbers: timestamp tx ty tz qx qy qz qw");
    const so3::quaternion q(v[7], v[4], v[5], v[6]);
    if (!(q.norm() > 1e-6) || !std::isfinite(q.norm())) return reject("the quaternion is zero or too large");
    poses.push_back({v[0], se3(so3(q), vec3(v[1], v[2], v[3]))});
    return true;
  });
  if (problem_line != 0) return fail(errc::malformed, detail::at_line(where, problem_line), std::move(problem));
  std::stable_sort(poses.begin(), poses.end(),
                   [](const stamped_pose& a, const stamped_pose& b) { return a.timestamp < b.timestamp; });
  return poses;
}

ORBIS_INLINE result<trajectory> read_trajectory(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_trajectory(*text, path);
}

ORBIS_INLINE result<void> write_trajectory(const std::filesystem::path& path, const trajectory& poses) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  const auto add = [&](double value, std::chars_format format, int precision) {
    char buffer[400];  // the largest double has 309 digits before the point
    const auto [end, failure] = std::to_chars(buffer, buffer + sizeof buffer, value, format, precision);
    if (failure == std::errc{}) text.append(buffer, end);
  };
  for (const stamped_pose& pose : poses) {
    const vec3& t = pose.T_world_camera.translation();
    const auto& q = pose.T_world_camera.rotation().unit_quaternion();
    add(pose.timestamp, std::chars_format::fixed, 9);
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
      text += ' ';
      add(value, std::chars_format::general, 9);
    }
    text += '\n';
  }
  return write_file_atomically(
      path, [&](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

}  // namespace orbis::io
