// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Trajectories as text: the lines of the TUM, EuRoC and KITTI layouts, lost poses, repeated time stamps, and several
/// runs in one file.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/files/pose_header.hpp>
#include <orbis/io/detail/files/pose_matrix.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/detail/time_stamp.hpp>
#include <orbis/io/trajectory_reading.hpp>

namespace orbis::io::detail {

/// The poses of a file, line by line.
struct pose_lines {
  struct entry {
    stamped_pose pose;
    std::size_t line = 0;
  };
  std::vector<entry> entries;  ///< in the order of the file
  trajectory_layout layout = trajectory_layout::tum;
  time_unit unit = time_units[0];  ///< unit of the first time stamp in the file; `entries` are in seconds
  std::size_t lost = 0;            ///< number of lines with NaN, infinity or a zero quaternion
  std::size_t first_lost_line = 0;
  std::vector<std::string> notes{};
};

/// Parses a pose as numbers: time, position, quaternion in the order of the file. Returns an explanation if the line is
/// not a pose; sets `lost` if a number is NaN or infinite.
template <class = void>
[[nodiscard]] std::string parse_pose_numbers(std::string_view line, char separator, bool more_columns,
                                             std::array<double, 8>& v, bool& lost,
                                             const pose_columns& columns = usual_columns) {
  const char* const eight = more_columns ? "a pose must have a time, a position and a quaternion"
                                         : "a pose must have 8 numbers: timestamp tx ty tz qx qy qz qw";
  lost = false;
  std::size_t found = 0;
  for (std::size_t column = 0; found != v.size(); ++column) {
    if (line.empty()) return eight;
    const std::string_view field = next_value(line, separator);
    const auto at = std::ranges::find(columns, column);
    if (at == columns.end()) continue;
    double& value = v[static_cast<std::size_t>(at - columns.begin())];
    if (field.empty()) return eight;
    if (!parse_number(field, value)) return in_quotes(field) + " is not a number";
    lost = lost || !std::isfinite(value);
    ++found;
  }
  return more_columns || trimmed(line).empty() ? std::string{} : eight;
}

/// Converts the numbers of a line to a pose; empty if the quaternion is zero or too large.
template <class = void>
[[nodiscard]] std::optional<se3> make_pose(const std::array<double, 8>& v, bool w_first) {
  const so3::quaternion q = w_first ? so3::quaternion(v[4], v[5], v[6], v[7]) : so3::quaternion(v[7], v[4], v[5], v[6]);
  if (!(q.norm() > 1e-6) || !std::isfinite(q.norm())) return std::nullopt;
  return se3(so3(q), vec3(v[1], v[2], v[3]));
}

/// Returns true if the line consists of column names: no field is a number, or the fields are 0, 1, 2, ...
template <class = void>
[[nodiscard]] bool has_names(std::string_view line) {
  const char separator = find_separator(line);
  std::size_t numbers = 0, columns = 0;
  bool in_order = true;
  for (double value = 0.0; !line.empty(); ++columns)
    if (parse_number(next_value(line, separator), value)) {
      ++numbers;
      in_order = in_order && value == static_cast<double>(columns);
    }
  return numbers == 0 || (in_order && numbers == columns && columns >= usual_columns.size());
}

/// Parses the lines of a trajectory. The header and the first pose determine the layout: EuRoC if the header is an
/// EuRoC header, or if values are separated by commas and times are in nanoseconds; KITTI if each line has 12 numbers;
/// otherwise TUM. `assumed`: the header to assume for a file without a header. Adds notes about a header line that
/// cannot be interpreted and about columns other than the first eight. Errors: malformed, with the line number;
/// unsupported (a header that lists the columns in another order).
template <class = void>
result<pose_lines> parse_pose_lines(std::string_view text, const std::filesystem::path& where,
                                    pose_header assumed = {}) {
  pose_lines read;
  pose_header header = assumed;
  std::string unknown_names;  // note about a line before the poses
  const auto start = [&](std::string_view line) {
    const char separator = find_separator(line);
    std::string_view first = line;
    std::size_t fields = 0;
    for (std::string_view rest = line; !rest.empty(); ++fields) (void)next_value(rest, separator);
    const bool nanoseconds = detect_unit(next_value(first, separator)) == time_units[3];
    header.w_first = header.quaternion ? header.w_first : separator == ',' && nanoseconds;
    read.layout = header.w_first                                           ? trajectory_layout::euroc
                  : fields == 12 && separator == ' ' && !header.quaternion ? trajectory_layout::kitti
                                                                           : trajectory_layout::tum;
    // The words before the time in a comment are column names if the lines have a column for each of them.
    if (header.before != 0 && fields == header.before + header.names)
      for (std::size_t& column : header.columns) column += header.before;
    else if (header.is_comment && fields == usual_columns.size())  // its words need not be names of columns
      header.columns = usual_columns;
    if (header.columns != usual_columns)
      read.notes.push_back("according to the header, column " + std::to_string(header.columns[0] + 1) +
                           " is the time, column " + std::to_string(header.columns[1] + 1) +
                           " the start of the position, and column " + std::to_string(header.columns[4] + 1) +
                           " the start of the quaternion");
    if (!unknown_names.empty() && !header.quaternion && read.layout != trajectory_layout::kitti)
      read.notes.push_back(unknown_names + (header.w_first ? "qw qx qy qz" : "qx qy qz qw"));
  };
  const auto parse_line = [&](std::string_view line, std::size_t number) -> std::string {
    bool lost = false;
    std::optional<se3> pose;
    double seconds = static_cast<double>(read.entries.size() + read.lost);
    if (read.layout == trajectory_layout::kitti) {
      lost = is_lost_pose(line);
      auto matrix = lost ? result<se3>{se3{}} : parse_pose_matrix(std::string{line} + " 0 0 0 1", where);
      if (!matrix) return matrix.error().message;
      pose = *matrix;
    } else {
      const char separator = find_separator(line);
      std::array<double, 8> v{};
      const bool more = header.w_first || header.columns != usual_columns;
      if (auto why = parse_pose_numbers(line, separator, more, v, lost, header.columns); !why.empty()) return why;
      lost = lost || (v[4] == 0.0 && v[5] == 0.0 && v[6] == 0.0 && v[7] == 0.0);
      if (!lost) pose = make_pose(v, header.w_first);
      if (!lost && !pose)
        return header.w_first ? "the quaternion (w first) is zero or too large" : "the quaternion is zero or too large";
      std::string_view stamp = next_value(line, separator);
      for (std::size_t column = 0; column != header.columns[0]; ++column) stamp = next_value(line, separator);
      const bool is_whole = stamp.find('.') == stamp.npos;
      if (read.entries.empty()) read.unit = header.nanoseconds && is_whole ? time_units[3] : detect_unit(stamp);
      seconds = v[0] * read.unit.seconds;
    }
    if (!lost)
      read.entries.push_back({{seconds, *pose}, number});
    else if (read.lost++ == 0)
      read.first_lost_line = number;
    return {};
  };

  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  bool in_header = true;  // until the first pose; one line without numbers may precede it
  bool named = false;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = trimmed(next_line(text));
    const bool comment = line.starts_with('#');
    if (line.empty() || (comment && !in_header)) continue;
    if (comment || (in_header && !named && has_names(line))) {
      named = named || !comment;
      const auto found = parse_pose_header(line);
      const bool nanoseconds = header.nanoseconds || found.nanoseconds;
      if (!found.problem.empty()) return fail(errc::unsupported, at_line(where, number), found.problem);
      if (found.quaternion) header = found;
      header.nanoseconds = nanoseconds;
      if (!comment && !found.quaternion)
        unknown_names = "line " + std::to_string(number) +
                        " does not list a quaternion (such as qx, qy, qz and qw): read as timestamp tx ty tz ";
      continue;
    }
    if (in_header) start(line);
    in_header = false;
    if (auto why = parse_line(line, number); !why.empty())
      return fail(errc::malformed, at_line(where, number), std::move(why));
  }
  return read;
}

/// Indices of the entries at which time jumps back so far that another run begins there; empty if the lines are only
/// out of order.
template <class = void>
[[nodiscard]] std::vector<std::size_t> starts_of_runs(const std::vector<pose_lines::entry>& entries) {
  constexpr std::size_t shortest = 3, most = 20;
  constexpr double jump = 10.0;  // median intervals
  std::vector<double> steps;
  for (std::size_t i = 1; i < entries.size(); ++i)
    steps.push_back(std::abs(entries[i].pose.timestamp - entries[i - 1].pose.timestamp));
  if (steps.empty()) return {};
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  std::vector<std::size_t> starts;
  std::size_t last = 0;
  for (std::size_t i = 1; i <= entries.size(); ++i) {
    const bool ends = i == entries.size();
    if (!ends && !(entries[i].pose.timestamp < entries[i - 1].pose.timestamp)) continue;
    if (i - last < shortest || starts.size() == most) return {};
    if (ends) break;
    if (entries[i - 1].pose.timestamp - entries[i].pose.timestamp < jump * *middle) return {};
    starts.push_back(last = i);
  }
  return starts;
}

/// Returns true if two poses are bit-identical.
template <class = void>
[[nodiscard]] bool same_pose(const se3& a, const se3& b) {
  return a.translation() == b.translation() &&
         a.rotation().unit_quaternion().coeffs() == b.rotation().unit_quaternion().coeffs();
}

/// Keeps the first of consecutive entries with equal times.
struct repeated_times {
  std::size_t same = 0;       ///< number of removed entries with the same pose as the kept one
  std::size_t different = 0;  ///< number of removed entries with a different pose
};
template <class = void>
repeated_times keep_first(std::vector<pose_lines::entry>& entries) {
  repeated_times removed;
  std::size_t kept = 0;
  for (std::size_t i = 0; i != entries.size(); ++i) {
    const bool repeated = kept != 0 && entries[i].pose.timestamp == entries[kept - 1].pose.timestamp;
    if (!repeated)
      entries[kept++] = entries[i];
    else
      ++(same_pose(entries[i].pose.T_world_camera, entries[kept - 1].pose.T_world_camera) ? removed.same
                                                                                          : removed.different);
  }
  entries.resize(kept);
  return removed;
}

/// Returns true if an entry from index `later` on has a time within the span of the entries before `later`, whose times
/// ascend, and a pose that differs from all poses at that time.
template <class = void>
[[nodiscard]] bool contradicts(const std::vector<pose_lines::entry>& entries, std::size_t later) {
  const auto begin = entries.begin(), end = begin + static_cast<std::ptrdiff_t>(later);
  const auto earlier = [](const auto& a, const auto& b) { return a.pose.timestamp < b.pose.timestamp; };
  return std::any_of(end, entries.end(), [&](const pose_lines::entry& e) {
    const auto [first, last] = std::equal_range(begin, end, e, earlier);
    const bool during = first != end && last != begin;
    return during && std::none_of(first, last, [&](const pose_lines::entry& f) {
             return same_pose(f.pose.T_world_camera, e.pose.T_world_camera);
           });
  });
}

/// Explains why different poses have equal times. `entries` have distinct, ascending times. Times have too few digits
/// if they are multiples of 1, 0.1, ... seconds, and this unit is not much shorter than their median interval.
template <class = void>
[[nodiscard]] std::string explain_equal_times(const std::vector<pose_lines::entry>& entries) {
  std::vector<double> times;
  for (const pose_lines::entry& e : entries) times.push_back(e.pose.timestamp);
  const auto are_multiples = [&](double step) {
    return std::ranges::all_of(times, [&](double t) { return std::abs(t / step - std::round(t / step)) < 1e-3; });
  };
  double step = 1.0;
  while (step > 1e-3 && !are_multiples(step)) step /= 10.0;
  if (times.size() >= 2 && !(are_multiples(step) && median_interval(times) < 1.5 * step))
    return "several runs in one file, or time stamps with too few digits?";
  return times.size() >= 2 && step == 1.0 ? "the time stamps are in whole seconds; write them with more digits"
                                          : "the time stamps are written with too few digits";
}

/// Sorts the poses by time and keeps the first line for each time. If a later run contains other poses for times within
/// the first run, only the first run is kept. Errors: degenerate (see `parse_trajectory_file`).
template <class = void>
[[nodiscard]] result<trajectory_reading> order_poses(pose_lines&& lines, const std::filesystem::path& where) {
  trajectory_reading read{.poses = {}, .layout = lines.layout, .lost = lines.lost, .notes = {}};
  const auto note = [&](const std::string& text) { read.notes.push_back(where.string() + ": " + text); };
  for (const std::string& text : lines.notes) note(text);
  if (lines.lost != 0)
    note(std::to_string(lines.lost) +
         " poses with NaN, infinity or a zero quaternion are left out: tracking was lost at these times");

  std::vector<pose_lines::entry>& entries = lines.entries;
  const std::size_t all = entries.size();
  const auto earlier = [](const auto& a, const auto& b) { return a.pose.timestamp < b.pose.timestamp; };
  const bool sorted = std::is_sorted(entries.begin(), entries.end(), earlier);
  const auto runs = sorted ? std::vector<std::size_t>{} : starts_of_runs(entries);
  std::vector<pose_lines::entry> first;  // the first run, if a later run contradicts it
  std::string backwards = "not in chronological order; sorted";
  if (!runs.empty()) {
    if (contradicts(entries, runs[0]))
      first.assign(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(runs[0]));
    backwards =
        "time runs backwards at line " + std::to_string(entries[runs[0]].line) +
        (runs.size() == 1 ? "; two runs in one file?" : "; " + std::to_string(runs.size() + 1) + " runs in one file?");
  }
  std::stable_sort(entries.begin(), entries.end(), earlier);
  repeated_times repeated = keep_first(entries);
  const auto refused = [&](std::size_t poses, const std::string& why) {
    return fail(errc::degenerate, where.string(),
                std::to_string(repeated.different) + " of " + std::to_string(poses) +
                    " poses have the time stamp of another pose: " + why);
  };
  std::size_t kept = all;
  if (!first.empty()) {
    if (2 * repeated.different > all) return refused(all, backwards);
    note(backwards + " The " + std::to_string(all - first.size()) + " poses from there on are left out");
    kept = first.size();
    entries = std::move(first);
    repeated = keep_first(entries);
  } else if (!sorted) {
    note(backwards);
  }
  if (repeated.different != 0 && 4 * repeated.different >= kept) return refused(kept, explain_equal_times(entries));
  if (repeated.same != 0) note(std::to_string(repeated.same) + " repeated lines are left out");
  if (repeated.different != 0)
    note(std::to_string(repeated.different) +
         " poses with the time stamp of another pose are left out: " + explain_equal_times(entries));
  read.poses.reserve(entries.size());
  for (const pose_lines::entry& e : entries) read.poses.push_back(e.pose);
  return read;
}

}  // namespace orbis::io::detail
