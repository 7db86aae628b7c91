// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Functions shared by the readers of recording formats: folders, and checks of an index.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <system_error>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// Returns `read`, the image in the file `path`, if its size is that of the camera. Errors: malformed, those of `read`.
template <class T>
[[nodiscard]] result<image<T>> sized(result<image<T>> read, const std::filesystem::path& path, int width, int height) {
  if (!read || (read->width() == width && read->height() == height)) return read;
  return fail(errc::malformed, path.string(),
              "the image has " + std::to_string(read->width()) + "x" + std::to_string(read->height()) +
                  " pixels, but the camera has " + std::to_string(width) + "x" + std::to_string(height));
}

/// The time stamps of entries (files, frames, poses), seconds.
template <class Entry>
[[nodiscard]] std::vector<double> timestamps(const std::vector<Entry>& entries) {
  std::vector<double> times;
  for (const Entry& entry : entries) times.push_back(entry.timestamp);
  return times;
}

/// Sets the pose of every frame from the ground truth at its time: interpolated if poses are at most 0.2 s apart,
/// otherwise the nearest within `max_distance` seconds.
template <class = void>
void attach_ground_truth(recording_index& index, double max_distance) {
  std::size_t without = 0;
  for (recording_entry& frame : index.frames) {
    frame.T_world_camera = interpolate(index.ground_truth, frame.timestamp, 0.2, max_distance);
    without += frame.T_world_camera ? 0U : 1U;
  }
  if (!index.ground_truth.empty() && without != 0)
    index.notes.push_back(std::to_string(without) + " of " + std::to_string(index.frames.size()) +
                          " frames are outside the ground truth");
}

/// Fails if a frame list is empty or its first images do not exist, because the whole list is then wrong. Later images
/// are checked when they are read. Errors: no_data, not_found, unreadable (the folder).
template <class = void>
result<void> check_first_frame(const recording_index& index, const std::filesystem::path& where) {
  if (index.frames.empty()) return fail(errc::no_data, where.string(), "the recording has no frames");
  for (const std::filesystem::path& path : {index.frames.front().color, index.frames.front().depth}) {
    std::error_code why;
    if (path.empty() || std::filesystem::exists(path, why)) continue;
    if (why && why != std::errc::no_such_file_or_directory)
      return fail(errc::unreadable, path.string(), "cannot be opened: " + why.message());
    return fail(errc::not_found, path.string(), "the first image of the recording does not exist");
  }
  return {};
}

/// The regular files and folders directly in `folder`, sorted by name; empty if it cannot be read.
template <class = void>
[[nodiscard]] std::vector<std::filesystem::path> list_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  std::error_code failure;
  for (std::filesystem::directory_iterator it{folder, failure}, end; !failure && it != end; it.increment(failure))
    paths.push_back(it->path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// Returns true if the name of a file has the extension `.png`, in upper or lower case.
template <class = void>
[[nodiscard]] bool is_png_name(const std::filesystem::path& path) {
  return lower_cased(path.extension().string()) == ".png";
}
/// Returns true if the name of a file has the extension of a supported image format.
template <class = void>
[[nodiscard]] bool is_image_name(const std::filesystem::path& path) {
  const std::string ending = lower_cased(path.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

/// Returns true if `path` exists. A symbolic link counts as existing even if its target is missing, so that the error
/// names the link.
template <class = void>
[[nodiscard]] bool present(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(std::filesystem::symlink_status(path, ignored));
}

/// The first of these names that exists in `folder`; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path first_present(const std::filesystem::path& folder,
                                                  std::initializer_list<const char*> names) {
  for (const char* const name : names)
    if (present(folder / name)) return folder / name;
  return {};
}

/// Summary of a folder for a message: "holds calib.txt, 120 .png files, left/". At most eight items, each of which is a
/// folder, a file, or all files with one extension.
template <class = void>
[[nodiscard]] std::string describe_content(const std::filesystem::path& folder) {
  constexpr std::size_t most = 8;
  std::vector<std::string> items;
  std::map<std::string, std::vector<std::string>> by_ending;
  for (const auto& path : list_folder(folder)) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
      items.push_back(path.filename().string() + "/");
    else
      by_ending[path.extension().string()].push_back(path.filename().string());
  }
  for (const auto& [ending, names] : by_ending) {
    if (names.size() <= 3)
      items.insert(items.end(), names.begin(), names.end());
    else
      items.push_back(std::to_string(names.size()) +
                      (ending.empty() ? " files without an extension" : " " + ending + " files"));
  }
  if (items.empty()) return "is empty";
  for (std::string& name : items)
    std::replace_if(
        name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
  std::string text = "holds ";
  for (std::size_t i = 0; i != std::min(items.size(), most); ++i) text += (i == 0 ? "" : ", ") + items[i];
  if (items.size() > most) text += " and " + std::to_string(items.size() - most) + " more";
  return text;
}

/// Fails if `folder` does not exist or is a file. Errors: not_found, unsupported (a file).
template <class = void>
[[nodiscard]] result<void> check_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!present(folder)) return fail(errc::not_found, folder.string(), "no such folder");
  if (!std::filesystem::is_directory(folder, ignored))
    return fail(errc::unsupported, folder.string(), "is a file; a recording is a folder");
  return {};
}

/// Error for a folder that is not a recording, with its content and the known layouts.
template <class = void>
[[nodiscard]] error unknown_recording(const std::filesystem::path& folder, const std::string& known) {
  return {errc::unsupported, folder.string(),
          "not a known recording; the folder " + describe_content(folder) + ";\n  known layouts: " + known};
}

}  // namespace orbis::io::detail
