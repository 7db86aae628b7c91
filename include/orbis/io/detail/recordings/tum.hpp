// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The layout of the TUM RGB-D benchmark: `rgb.txt`, `depth.txt` (or `associations.txt`),
/// `groundtruth.txt`.
///
/// Source: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and the
/// benchmark's page on file formats.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/presets.hpp>
#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/trajectory_file.hpp>

namespace orbis::io::detail {

/// A line of `rgb.txt` or `depth.txt`.
struct stamped_file {
  double timestamp = 0.0;
  std::filesystem::path path;
};

/// The entries of a list in order of time, each time stamp once; notes report changes. Errors: no_data (the list is
/// empty).
template <class Entry>
[[nodiscard]] result<std::vector<Entry>> in_order_of_time(const std::filesystem::path& list, std::vector<Entry> entries,
                                                          std::vector<std::string>& notes) {
  const auto earlier = [](const Entry& a, const Entry& b) { return a.timestamp < b.timestamp; };
  if (!std::is_sorted(entries.begin(), entries.end(), earlier)) {
    std::stable_sort(entries.begin(), entries.end(), earlier);
    notes.push_back(list.string() + ": not in order of time; sorted");
  }
  const auto repeated = std::unique(entries.begin(), entries.end(),
                                    [](const Entry& a, const Entry& b) { return a.timestamp == b.timestamp; });
  if (repeated != entries.end()) {
    notes.push_back(list.string() + ": " + std::to_string(entries.end() - repeated) +
                    " lines with a repeated time stamp skipped");
    entries.erase(repeated, entries.end());
  }
  if (entries.empty()) return fail(errc::no_data, list.string(), "the list names no image");
  return entries;
}

/// Notes the skipped lines of a list: the first ones individually, the others by their number.
class skipped_lines {
 public:
  skipped_lines(const std::filesystem::path& list, std::vector<std::string>& notes) : list_{list}, notes_{notes} {}
  void add(std::size_t line, const char* why) {
    if (++count_ <= most_) notes_.push_back(at_line(list_, line) + ": skipped, " + why);
  }
  /// Notes the number of the others. @pre called once, after the last line
  void finish() {
    if (count_ > most_)
      notes_.push_back(list_.string() + ": " + std::to_string(count_ - most_) + " more lines skipped");
  }

 private:
  static constexpr std::size_t most_ = 10;
  const std::filesystem::path& list_;
  std::vector<std::string>& notes_;
  std::size_t count_ = 0;
};

/// Parses a list of `timestamp filename` lines: comments, blank lines and CRLF are accepted, the entries are sorted,
/// unreadable lines and repeated time stamps are skipped and noted. File names are relative to the folder of `list`.
/// Errors: no_data (no line remains).
[[nodiscard]] inline result<std::vector<stamped_file>> parse_image_list(std::string_view text,
                                                                        const std::filesystem::path& list,
                                                                        std::vector<std::string>& notes) {
  std::vector<stamped_file> files;
  skipped_lines skipped{list, notes};
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    double t = 0.0;
    const std::string_view stamp = next_field(line);
    const std::string_view name = trimmed(line);
    if (!parse_number(stamp, t) || !std::isfinite(t) || name.empty())
      skipped.add(number, "not a time stamp and a file name");
    else
      files.push_back({t, list.parent_path() / std::filesystem::path{name}});
    return true;
  });
  skipped.finish();
  return in_order_of_time(list, std::move(files), notes);
}

/// Reads a list; see `parse_image_list`. Errors: not_found, unreadable, no_data.
[[nodiscard]] inline result<std::vector<stamped_file>> read_image_list(const std::filesystem::path& list,
                                                                       std::vector<std::string>& notes) {
  const auto text = read_file(list);
  if (!text) return fail(text.error());
  return parse_image_list(*text, list, notes);
}

/// Parses `associations.txt`: four fields per line, a time stamp and a file for colour and for depth, in either order
/// (the file whose path contains "depth" is the depth image; colour first if neither or both do). Unreadable lines and
/// repeated time stamps are skipped and noted. Errors: as `parse_image_list`.
[[nodiscard]] inline result<std::vector<recording_entry>> parse_associations(std::string_view text,
                                                                             const std::filesystem::path& list,
                                                                             std::vector<std::string>& notes) {
  std::vector<recording_entry> frames;
  skipped_lines skipped{list, notes};
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    double t1 = 0.0, t2 = 0.0;
    const bool first_ok = parse_number(next_field(line), t1) && std::isfinite(t1);
    std::string_view file1 = next_field(line);
    const bool second_ok = parse_number(next_field(line), t2) && std::isfinite(t2);
    std::string_view file2 = next_field(line);
    if (!first_ok || !second_ok || file2.empty() || !trimmed(line).empty()) {
      skipped.add(number, "not two pairs of time stamp and file name");
      return true;
    }
    const auto says_depth = [](std::string_view name) { return name.find("depth") != std::string_view::npos; };
    if (says_depth(file1) && !says_depth(file2)) {
      std::swap(file1, file2);
      std::swap(t1, t2);
    }
    const std::filesystem::path folder = list.parent_path();
    frames.push_back({t1, folder / std::filesystem::path{file1}, folder / std::filesystem::path{file2}, {}});
    return true;
  });
  skipped.finish();
  return in_order_of_time(list, std::move(frames), notes);
}

/// Reads `associations.txt`; see `parse_associations`. Errors: as `read_image_list`.
[[nodiscard]] inline result<std::vector<recording_entry>> read_associations(const std::filesystem::path& list,
                                                                            std::vector<std::string>& notes) {
  const auto text = read_file(list);
  if (!text) return fail(text.error());
  return parse_associations(*text, list, notes);
}

/// Reads `groundtruth.txt` of a folder, if it exists, into an index with known frames, and sets their poses
/// (`attach_ground_truth`). Errors: unreadable, malformed (with its line).
[[nodiscard]] inline result<void> read_ground_truth(const std::filesystem::path& folder, double max_time_difference,
                                                    recording_index& index) {
  const auto file = folder / "groundtruth.txt";
  if (!present(file)) return {};
  auto truth = read_trajectory(file);
  if (!truth) return fail(truth.error());
  index.ground_truth = *std::move(truth);
  index.files.push_back(file);
  attach_ground_truth(index, max_time_difference);
  return {};
}

/// Returns true if `folder` looks like a TUM recording.
[[nodiscard]] inline bool is_tum(const std::filesystem::path& folder) {
  return present(folder / "rgb.txt") || present(folder / "depth.txt") || present(folder / "associations.txt");
}

/// The camera of a TUM recording with freiburg1, 2 or 3 in its path, or none. Of several such words the last one
/// counts: the sequence may be in the folder of another one.
[[nodiscard]] inline std::optional<camera::camera_settings> tum_camera(const std::filesystem::path& folder) {
  std::optional<camera::camera_settings> found;
  const std::string name = std::filesystem::absolute(folder).lexically_normal().string();
  std::size_t last = 0;
  for (const auto& [word, preset] :
       {std::pair{"freiburg1", "tum_fr1"}, std::pair{"freiburg2", "tum_fr2"}, std::pair{"freiburg3", "tum_fr3"}}) {
    const std::size_t at = name.rfind(word);
    if (at == std::string::npos || at < last) continue;
    last = at;
    if (auto camera = camera::preset(preset)) found = *std::move(camera);
  }
  return found;
}

/// The index of a TUM recording. `associations.txt` is used if it exists; otherwise colour and depth images are paired
/// by `associate` within `max_time_difference` seconds, and images without a partner are noted. The ground truth is
/// interpolated at the colour images' time stamps. The camera is known for folders with freiburg1, 2 or 3 in their
/// name. Errors: not_found (a list, the first image), unreadable, no_data (empty lists, no pair), malformed (ground
/// truth, with its line).
[[nodiscard]] inline result<recording_index> index_tum(const std::filesystem::path& folder,
                                                       double max_time_difference = 0.020) {
  recording_index index;
  if (const auto list = folder / "associations.txt"; present(list)) {
    auto frames = read_associations(list, index.notes);
    if (!frames) return fail(frames.error());
    index.frames = *std::move(frames);
    index.files = {list};
  } else {
    index.files = {folder / "rgb.txt", folder / "depth.txt"};
    const auto color = read_image_list(folder / "rgb.txt", index.notes);
    if (!color) return fail(color.error());
    const auto depth = read_image_list(folder / "depth.txt", index.notes);
    if (!depth) return fail(depth.error());
    const auto stamps = [](const std::vector<stamped_file>& files) {
      std::vector<double> t;
      for (const stamped_file& f : files) t.push_back(f.timestamp);
      return t;
    };
    for (const auto& [c, d] : associate(stamps(*color), stamps(*depth), max_time_difference))
      index.frames.push_back({(*color)[c].timestamp, (*color)[c].path, (*depth)[d].path, {}});
    if (index.frames.empty())
      return fail(errc::no_data, folder.string(),
                  "no colour image has a depth image within " + std::to_string(max_time_difference) + " s");
    if (const std::size_t lonely = color->size() - index.frames.size(); lonely != 0)
      index.notes.push_back(std::to_string(lonely) + " of " + std::to_string(color->size()) +
                            " colour images have no depth image within " + std::to_string(max_time_difference) +
                            " s and are skipped");
    if (const std::size_t lonely = depth->size() - index.frames.size(); lonely != 0)
      index.notes.push_back(std::to_string(lonely) + " of " + std::to_string(depth->size()) +
                            " depth images are skipped");
  }
  if (const auto ok = check_first_frame(index, folder); !ok) return fail(ok.error());

  if (const auto truth = read_ground_truth(folder, max_time_difference, index); !truth) return fail(truth.error());

  index.camera = tum_camera(folder);
  return index;
}

/// Pairs left with right images within `max_time_difference` seconds and adds them as frames; images without a partner
/// are noted. Errors: no_data (no pair), not_found (the first images).
[[nodiscard]] inline result<void> pair_images(const std::vector<stamped_file>& left,
                                              const std::vector<stamped_file>& right,
                                              const std::filesystem::path& where, double max_time_difference,
                                              recording_index& to) {
  const auto stamps = [](const std::vector<stamped_file>& files) {
    std::vector<double> t;
    for (const stamped_file& f : files) t.push_back(f.timestamp);
    return t;
  };
  for (const auto& [l, r] : associate(stamps(left), stamps(right), max_time_difference))
    to.frames.push_back({left[l].timestamp, left[l].path, right[r].path, {}});
  if (to.frames.empty())
    return fail(errc::no_data, where.string(),
                "no left image has a right image within " + std::to_string(max_time_difference) + " s");
  for (const auto& [list, side] : {std::pair{&left, "left"}, std::pair{&right, "right"}})
    if (const std::size_t lonely = list->size() - to.frames.size(); lonely != 0)
      to.notes.push_back(std::to_string(lonely) + " of " + std::to_string(list->size()) + " " + side +
                         " images have no partner and are skipped");
  return check_first_frame(to, where);
}

}  // namespace orbis::io::detail
