// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The layout of the TUM RGB-D benchmark: `rgb.txt`, `depth.txt` (or `associations.txt`), `groundtruth.txt`.
///
/// Source: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and the benchmark's page
/// on file formats.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/presets.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/detail/time_stamp.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io::detail {

/// A line of `rgb.txt` or `depth.txt`.
struct stamped_file {
  double timestamp = 0.0;
  std::filesystem::path path;
};

/// Sorts the entries of a list by time and removes repeated time stamps; adds notes about changes. Errors: no_data
/// (the list is empty).
template <class Entry>
[[nodiscard]] result<std::vector<Entry>> in_order_of_time(const std::filesystem::path& list, std::vector<Entry> entries,
                                                          std::vector<std::string>& notes) {
  const auto earlier = [](const Entry& a, const Entry& b) { return a.timestamp < b.timestamp; };
  if (!std::is_sorted(entries.begin(), entries.end(), earlier)) {
    std::stable_sort(entries.begin(), entries.end(), earlier);
    notes.push_back(list.string() + ": not in chronological order; sorted");
  }
  const auto repeated = std::unique(entries.begin(), entries.end(),
                                    [](const Entry& a, const Entry& b) { return a.timestamp == b.timestamp; });
  if (repeated != entries.end()) {
    notes.push_back(list.string() + ": " + std::to_string(entries.end() - repeated) +
                    " lines with a repeated time stamp skipped");
    entries.erase(repeated, entries.end());
  }
  if (entries.empty()) return fail(errc::no_data, list.string(), "the list contains no images");
  return entries;
}

/// Parses a list with one entry per line. `parse(line)` returns an entry, or an empty optional for an invalid line;
/// `form` describes an entry. Comments, blank lines, CRLF and a byte order mark are accepted, and a first line without
/// an entry is a heading. The entries are sorted; other lines and repeated time stamps are skipped and noted. Errors:
/// no_data (no entry; the message quotes the first line).
template <class Entry, class Parse>
[[nodiscard]] result<std::vector<Entry>> parse_list(std::string_view text, const std::filesystem::path& list,
                                                    const std::string& form, Parse&& parse,
                                                    std::vector<std::string>& notes) {
  constexpr std::size_t most_noted = 10;
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  std::vector<Entry> entries;
  bool heading = false;
  std::size_t skipped = 0, first_line = 0;
  std::string first_skipped;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    if (std::optional<Entry> entry = parse(line)) {
      entries.push_back(*std::move(entry));
      return true;
    }
    if (entries.empty() && skipped == 0 && !heading && is_letter(line.front())) return heading = true;
    const std::string why = in_quotes(line) + " is not " + form;
    if (skipped++ == 0) first_skipped = why, first_line = number;
    if (skipped <= most_noted) notes.push_back(at_line(list, number) + ": skipped, " + why);
    return true;
  });
  if (skipped > most_noted)
    notes.push_back(list.string() + ": " + std::to_string(skipped - most_noted) + " more lines skipped");
  if (entries.empty() && skipped != 0)
    return fail(errc::no_data, at_line(list, first_line), "the list contains no images: " + first_skipped);
  return in_order_of_time(list, std::move(entries), notes);
}

[[nodiscard]] constexpr bool is_separator(char c) noexcept { return is_blank(c) || c == ',' || c == ';'; }

/// Removes the first field, which ends at a blank, comma or semicolon, and the separators after it from the front of
/// `line`; returns the field.
[[nodiscard]] constexpr std::string_view next_separated(std::string_view& line) noexcept {
  std::size_t end = 0;
  while (end != line.size() && !is_separator(line[end])) ++end;
  const std::string_view field = line.substr(0, end);
  while (end != line.size() && is_separator(line[end])) ++end;
  line.remove_prefix(end);
  return field;
}

/// Cleans a file name in a list: removes quotes and trailing separators, and converts backslashes to slashes.
template <class = void>
[[nodiscard]] std::string listed_name(std::string_view name) {
  while (!name.empty() && is_separator(name.back())) name.remove_suffix(1);
  if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
  std::string path{name};
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

/// Parses a list of lines with a time stamp (`parse_time_stamp`) and a file name, separated by blanks, a comma or a
/// semicolon; see `parse_list`. File names are relative to `folder`. `unit`: unit of the time stamps; if empty, their
/// number of digits determines it. Errors: no_data.
template <class = void>
[[nodiscard]] result<std::vector<stamped_file>> parse_image_list(std::string_view text,
                                                                 const std::filesystem::path& list,
                                                                 const std::filesystem::path& folder,
                                                                 std::vector<std::string>& notes,
                                                                 std::optional<time_unit> unit = {}) {
  return parse_list<stamped_file>(
      text, list, "a time stamp and a file name",
      [&](std::string_view line) -> std::optional<stamped_file> {
        const std::optional<double> t = parse_time_stamp(next_separated(line), unit);
        const std::string name = listed_name(line);
        if (!t || name.empty()) return std::nullopt;
        return stamped_file{*t, folder / name};
      },
      notes);
}

/// Reads a list; see `parse_image_list`. Errors: not_found, unreadable, no_data.
template <class = void>
[[nodiscard]] result<std::vector<stamped_file>> read_image_list(const std::filesystem::path& list,
                                                                std::vector<std::string>& notes) {
  const auto text = read_file(list);
  if (!text) return fail(text.error());
  return parse_image_list(*text, list, list.parent_path(), notes);
}

/// A line of `associations.txt`: a colour and a depth image, each with a time stamp.
struct associated_files {
  double timestamp = 0.0, depth_timestamp = 0.0;
  std::filesystem::path color, depth;
};

/// Parses a line with two pairs of a time stamp and a file, in either order (the file whose path contains "depth" is
/// the depth image; if neither or both contain it, colour is first). Fields are separated by blanks, commas or
/// semicolons; file names may contain blanks if the second time stamp is the only number between them.
template <class = void>
[[nodiscard]] std::optional<associated_files> parse_association(std::string_view line,
                                                                const std::filesystem::path& folder) {
  const std::optional<double> t1 = parse_time_stamp(next_separated(line));
  std::optional<double> t2;
  std::string file1, file2;
  for (std::string_view rest = line; !rest.empty();) {
    const std::size_t at = line.size() - rest.size();
    const std::optional<double> t = parse_time_stamp(next_separated(rest));
    if (!t || at == 0 || rest.empty()) continue;
    if (t2) return std::nullopt;  // two numbers between the names
    t2 = t;
    file1 = listed_name(line.substr(0, at));
    file2 = listed_name(rest);
  }
  if (!t1 || !t2 || file1.empty() || file2.empty()) return std::nullopt;
  const auto says_depth = [](const std::string& name) { return name.find("depth") != std::string::npos; };
  const bool depth_first = says_depth(file1) && !says_depth(file2);
  const auto first = folder / file1, second = folder / file2;
  if (depth_first) return associated_files{*t2, *t1, second, first};
  return associated_files{*t1, *t2, first, second};
}

/// Parses `associations.txt`; see `parse_association` and `parse_list`. File names are relative to the folder of
/// `list`. Errors: no_data.
template <class = void>
[[nodiscard]] result<std::vector<associated_files>> parse_associations(std::string_view text,
                                                                       const std::filesystem::path& list,
                                                                       std::vector<std::string>& notes) {
  return parse_list<associated_files>(
      text, list, "two pairs of a time stamp and a file name",
      [&](std::string_view line) { return parse_association(line, list.parent_path()); }, notes);
}

/// Reads `associations.txt`; see `parse_associations`. Errors: those of `read_image_list`.
template <class = void>
[[nodiscard]] result<std::vector<associated_files>> read_associations(const std::filesystem::path& list,
                                                                      std::vector<std::string>& notes) {
  const auto text = read_file(list);
  if (!text) return fail(text.error());
  return parse_associations(*text, list, notes);
}

/// Moves a trajectory and its notes into an index. Ground truth whose times are unusable (degenerate) is left out with
/// a note. Errors: all other errors of `read`.
template <class = void>
[[nodiscard]] result<void> take_ground_truth(result<trajectory_reading> read, recording_index& index) {
  if (!read && read.error().code == errc::degenerate) {
    index.notes.push_back(read.error().to_string() + "; the ground truth is not used");
    return {};
  }
  if (!read) return fail(read.error());
  index.notes.insert(index.notes.end(), read->notes.begin(), read->notes.end());
  index.ground_truth = std::move(read->poses);
  return {};
}

/// Converts the times of frames to seconds at `fps` frames per second if they are frame numbers, and adds a note.
template <class = void>
void convert_frame_numbers(recording_index& index, double fps) {
  if (!are_frame_numbers(timestamps(index.frames))) return;
  for (recording_entry& frame : index.frames) {
    frame.timestamp /= fps;
    frame.depth_timestamp.reset();
  }
  char text[100];
  std::snprintf(text, sizeof text, "the time stamps are frame numbers; converted to seconds at %.6g frames per second",
                fps);
  index.notes.emplace_back(text);
}

/// If the times of the ground truth are frame numbers, and more frames have a pose after the conversion, converts the
/// times to seconds at `fps` frames per second and adds a note. @pre the times of the frames are in seconds
template <class = void>
void convert_numbered_truth(recording_index& index, double max_distance, double fps) {
  if (!are_frame_numbers(timestamps(index.ground_truth))) return;
  const auto known = [&](const trajectory& truth) {
    return std::count_if(index.frames.begin(), index.frames.end(), [&](const recording_entry& frame) {
      return interpolate(truth, frame.timestamp, 0.2, max_distance).has_value();
    });
  };
  trajectory converted = index.ground_truth;
  for (stamped_pose& pose : converted) pose.timestamp /= fps;
  if (known(converted) <= known(index.ground_truth)) return;
  index.ground_truth = std::move(converted);
  index.notes.emplace_back("the times of the ground truth are frame numbers, too");
}

/// Reads `groundtruth.txt` of a folder, if it exists, into an index that contains the frames already, and sets their
/// poses (`attach_ground_truth`). `fps`: frames per second, for poses with frame numbers instead of times. Errors:
/// unreadable, malformed (with the line number), unsupported.
template <class = void>
[[nodiscard]] result<void> read_ground_truth(const std::filesystem::path& folder, double max_time_difference,
                                             recording_index& index, double fps) {
  const auto file = folder / "groundtruth.txt";
  if (!present(file)) return {};
  auto truth = read_trajectory_file(file);
  if (truth && truth->layout == trajectory_layout::kitti)
    return fail(errc::malformed, file.string(), "the poses have no times; expected timestamp tx ty tz qx qy qz qw");
  if (auto taken = take_ground_truth(std::move(truth), index); !taken) return fail(taken.error());
  index.files.push_back(file);
  convert_numbered_truth(index, max_time_difference, fps);
  attach_ground_truth(index, max_time_difference);
  return {};
}

/// The list of pairs of colour and depth images in `folder`, with one of the usual names; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path find_association_list(const std::filesystem::path& folder) {
  return first_present(folder, {"associations.txt", "association.txt", "associated.txt", "associate.txt", "assoc.txt"});
}

/// Returns true if `folder` looks like a TUM recording.
template <class = void>
[[nodiscard]] bool is_tum(const std::filesystem::path& folder) {
  return present(folder / "rgb.txt") || present(folder / "depth.txt") || !find_association_list(folder).empty();
}

/// Sets the camera of a TUM benchmark sequence if the name of `folder` begins with `freiburg1` (or 2, or 3), or if a
/// folder in its path has a name that begins with `rgbd_dataset_freiburg1` (or 2, or 3); the innermost of these folders
/// counts.
template <class = void>
void guess_tum_camera(const std::filesystem::path& folder, recording_index& index) {
  const auto full = std::filesystem::absolute(folder / "").lexically_normal().parent_path();
  for (const auto& [word, preset] :
       {std::pair{"freiburg1", "tum_fr1"}, std::pair{"freiburg2", "tum_fr2"}, std::pair{"freiburg3", "tum_fr3"}}) {
    std::filesystem::path named;
    if (full.filename().string().starts_with(word)) named = full;
    for (auto path = full; named.empty() && path.has_relative_path(); path = path.parent_path()) {
      const std::string name = path.filename().string();
      if (!name.starts_with("rgbd_dataset_freiburg")) continue;
      if (!name.starts_with(std::string{"rgbd_dataset_"} + word)) break;
      named = path;
    }
    if (named.empty()) continue;
    if (auto camera = camera::preset(preset)) index.camera = *std::move(camera);
    index.camera_guess = std::string{preset} + ", according to the name " + named.filename().string();
  }
}

/// The index of a TUM recording. `associations.txt` is used if it exists; otherwise colour and depth images are paired
/// by `associate` within `max_time_difference` seconds, and images without a partner are noted. The ground truth is
/// interpolated at the colour images' time stamps. The camera is that of the benchmark's sequences
/// (`guess_tum_camera`). If all time stamps are frame numbers, they are converted to seconds at `fps` frames per
/// second. Errors: not_found (a list, the first image), unreadable, no_data (empty lists, no pair), malformed (ground
/// truth, with the line number).
template <class = void>
[[nodiscard]] result<recording_index> index_tum(const std::filesystem::path& folder, double max_time_difference = 0.020,
                                                double fps = 30.0) {
  recording_index index;
  bool depth_is_whole = true;
  if (const auto list = find_association_list(folder); !list.empty()) {
    auto frames = read_associations(list, index.notes);
    if (!frames) return fail(frames.error());
    for (associated_files& f : *frames) {
      depth_is_whole = depth_is_whole && are_whole({f.depth_timestamp});
      index.frames.push_back({f.timestamp, std::move(f.color), std::move(f.depth), {}, f.depth_timestamp});
    }
    index.files = {list};
  } else {
    index.files = {folder / "rgb.txt", folder / "depth.txt"};
    for (const auto& file : index.files)
      if (!present(file))
        return fail(errc::not_found, file.string(),
                    "no such file; a recording in the TUM layout has rgb.txt and depth.txt, or associations.txt; the "
                    "folder " +
                        describe_content(folder));
    const auto color = read_image_list(folder / "rgb.txt", index.notes);
    if (!color) return fail(color.error());
    const auto depth = read_image_list(folder / "depth.txt", index.notes);
    if (!depth) return fail(depth.error());
    const auto times = timestamps(*color), depth_times = timestamps(*depth);
    depth_is_whole = are_whole(depth_times);
    for (const auto& [c, d] : associate(times, depth_times, max_time_difference))
      index.frames.push_back({times[c], (*color)[c].path, (*depth)[d].path, {}, depth_times[d]});
    if (index.frames.empty())
      return fail(errc::no_data, folder.string(),
                  "no colour image has a depth image within " + describe(max_time_difference) +
                      " s: the times in rgb.txt are " + describe_span(times) + ", those in depth.txt " +
                      describe_span(depth_times));
    for (const auto& [list, kind] : {std::pair{&*color, "colour"}, std::pair{&*depth, "depth"}})
      if (const std::size_t lonely = list->size() - index.frames.size(); lonely != 0)
        index.notes.push_back(std::to_string(lonely) + " of " + std::to_string(list->size()) + " " + kind +
                              " images have no counterpart within " + describe(max_time_difference) +
                              " s and are skipped");
  }
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());

  if (depth_is_whole) convert_frame_numbers(index, fps);
  if (const auto truth = read_ground_truth(folder, max_time_difference, index, fps); !truth) return fail(truth.error());
  guess_tum_camera(folder, index);
  return index;
}

/// Pairs left and right images whose times differ by at most `max_time_difference` seconds and adds them as frames;
/// images without a partner are noted. Errors: no_data (no pair), not_found (the first images).
template <class = void>
[[nodiscard]] result<void> pair_images(const std::vector<stamped_file>& left, const std::vector<stamped_file>& right,
                                       const std::filesystem::path& where, double max_time_difference,
                                       recording_index& to) {
  const auto left_times = timestamps(left), right_times = timestamps(right);
  for (const auto& [l, r] : associate(left_times, right_times, max_time_difference))
    to.frames.push_back({left_times[l], left[l].path, right[r].path, {}});
  if (to.frames.empty())
    return fail(errc::no_data, where.string(),
                "no left image has a right image within " + describe(max_time_difference) +
                    " s: the times of the left images are " + describe_span(left_times) +
                    ", those of the right images " + describe_span(right_times));
  for (const auto& [list, side] : {std::pair{&left, "left"}, std::pair{&right, "right"}})
    if (const std::size_t lonely = list->size() - to.frames.size(); lonely != 0)
      to.notes.push_back(std::to_string(lonely) + " of " + std::to_string(list->size()) + " " + side +
                         " images have no partner and are skipped");
  return check_first_frame(to, where);
}

}  // namespace orbis::io::detail
