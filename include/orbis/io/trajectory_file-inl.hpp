// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of trajectory_file.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <ostream>
#include <tuple>
#include <utility>

#include <orbis/core/file.hpp>
#include <orbis/io/detail/files/pose_text.hpp>
#include <orbis/io/detail/files/time_list.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/detail/time_stamp.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io {

ORBIS_LAZY_INLINE result<trajectory> parse_trajectory(std::string_view text, const std::filesystem::path& where) {
  trajectory poses;
  std::string problem;
  std::size_t problem_line = 0;
  detail::for_each_line(text, [&](std::string_view line, std::size_t number) {
    std::array<double, 8> v{};
    bool lost = false;
    problem = detail::parse_pose_numbers(line, ' ', false, v, lost);
    const auto pose = problem.empty() && !lost ? detail::make_pose(v, false) : std::nullopt;
    if (problem.empty() && !pose)
      problem = lost ? "a pose with NaN or infinity" : "the quaternion is zero or too large";
    if (!pose) return problem_line = number, false;
    poses.push_back({v[0], *pose});
    return true;
  });
  if (problem_line != 0) return fail(errc::malformed, detail::at_line(where, problem_line), std::move(problem));
  std::stable_sort(poses.begin(), poses.end(),
                   [](const stamped_pose& a, const stamped_pose& b) { return a.timestamp < b.timestamp; });
  return poses;
}

ORBIS_LAZY_INLINE result<trajectory> read_trajectory(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_trajectory(*text, path);
}

ORBIS_LAZY_INLINE result<trajectory_reading> parse_trajectory_file(std::string_view text,
                                                                   const std::filesystem::path& where) {
  auto lines = detail::parse_pose_lines(text, where);
  if (!lines) return fail(lines.error());
  const auto unit = lines->unit;
  auto read = detail::order_poses(*std::move(lines), where);
  if (!read) return read;
  const auto note = [&](const std::string& text) {
    read->notes.insert(read->notes.begin(), where.string() + ": " + text);
  };
  if (read->layout != trajectory_layout::kitti && !(unit == detail::time_units[0]))
    note("the time stamps are in " + std::string{unit.name});
  if (read->layout == trajectory_layout::euroc) note("read in EuRoC's layout: the quaternion has w first");
  if (read->layout == trajectory_layout::kitti) note("read in KITTI's layout: one pose matrix per line");
  return read;
}

ORBIS_LAZY_INLINE result<trajectory_reading> read_trajectory_file(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_trajectory_file(*text, path);
}

ORBIS_LAZY_INLINE result<void> set_times(trajectory_reading& read, const std::filesystem::path& times) {
  const auto text = read_file(times);
  if (!text) return fail(text.error());
  const auto all = detail::parse_times(*text, times);
  if (!all) return fail(all.error());
  if (all->size() != read.poses.size() + read.lost)
    return fail(
        errc::malformed, times.string(),
        std::to_string(all->size()) + " time stamps for " + std::to_string(read.poses.size() + read.lost) + " poses");
  for (stamped_pose& p : read.poses) p.timestamp = (*all)[static_cast<std::size_t>(p.timestamp)];
  return {};
}

ORBIS_LAZY_INLINE std::string describe_spans(const trajectory& a, const trajectory& b) {
  const auto span = [](const trajectory& poses) {
    return poses.empty()
               ? std::string{"no time"}
               : detail::describe(poses.front().timestamp) + " to " + detail::describe(poses.back().timestamp) + " s";
  };
  const std::string units = describe_units(a, b);
  return span(a) + " and " + span(b) + (units.empty() ? "" : "; " + units);
}

ORBIS_LAZY_INLINE std::string describe_units(const trajectory& a, const trajectory& b) {
  constexpr double likely = 0.1;
  if (a.empty() || b.empty()) return {};
  // Intersection over union of the spans, with the times of `x` in another unit.
  const auto agreement = [](const trajectory& x, double unit, const trajectory& y) {
    const double x0 = x.front().timestamp * unit, x1 = x.back().timestamp * unit;
    const double y0 = y.front().timestamp, y1 = y.back().timestamp;
    return (std::min(x1, y1) - std::max(x0, y0)) / (std::max(x1, y1) - std::min(x0, y0));
  };
  if (agreement(a, 1.0, b) > likely) return {};
  for (const auto& unit : detail::time_units)
    for (const auto& [x, y, which] : {std::tuple{&a, &b, "first"}, std::tuple{&b, &a, "second"}})
      if (unit.seconds != 1.0 && agreement(*x, unit.seconds, *y) > likely)
        return "the times of the " + std::string{which} + " seem to be in " + std::string{unit.name};
  return {};
}

ORBIS_LAZY_INLINE result<void> write_trajectory(const std::filesystem::path& path, const trajectory& poses) {
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
