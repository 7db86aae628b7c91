// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recordings written by export tools: a folder of colour images and a folder of depth images registered to them,
/// paired by the numbers or times in their names; optionally `times.txt` and `groundtruth.txt`.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/image_names.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>

namespace orbis::io::detail {

/// The first subfolder of `folder` with one of these names, in upper or lower case; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path first_folder(const std::filesystem::path& folder,
                                                 std::initializer_list<const char*> names) {
  const auto paths = list_folder(folder);
  for (const std::string_view name : names)
    for (const auto& path : paths) {
      std::error_code ignored;
      if (lower_cased(path.filename().string()) == name && std::filesystem::is_directory(path, ignored)) return path;
    }
  return {};
}

/// The folder of colour images in `folder`; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path find_color_folder(const std::filesystem::path& folder) {
  for (const char* const name : {"rgb", "color", "colour", "image", "images"})
    if (const auto path = first_folder(folder, {name}); !path.empty() && !images_in(path).empty()) return path;
  return {};
}

/// The folder of depth images in `folder`, registered ones first; empty if there is none.
template <class = void>
[[nodiscard]] std::filesystem::path find_depth_folder(const std::filesystem::path& folder) {
  return first_folder(
      folder, {"aligned_depth_to_color", "aligned_depth", "depth_aligned", "depth_registered", "depth", "depths"});
}

/// Returns true if `folder` contains a folder of colour images and a folder for depth images.
template <class = void>
[[nodiscard]] bool is_image_folders(const std::filesystem::path& folder) {
  return !find_color_folder(folder).empty() && !find_depth_folder(folder).empty();
}

/// Pairs images by equal numbers, by times at most `max_time_difference` seconds apart, or by equal names. Errors:
/// invalid_argument (the names do not match).
template <class = void>
[[nodiscard]] result<std::vector<index_pair>> pair_by_name(const keyed_images& color, const keyed_images& depth,
                                                           double max_time_difference,
                                                           const std::filesystem::path& where) {
  if (color.keys_are != depth.keys_are || color.keys_are == image_keys::alphabet) {
    std::map<std::string, std::uint32_t> by_name;
    for (std::uint32_t d = 0; d != depth.paths.size(); ++d) by_name[depth.paths[d].stem().string()] = d;
    std::vector<index_pair> pairs;
    for (std::uint32_t c = 0; c != color.paths.size(); ++c)
      if (const auto same = by_name.find(color.paths[c].stem().string()); same != by_name.end())
        pairs.push_back({c, same->second});
    if (!pairs.empty()) return pairs;
    return fail(errc::invalid_argument, where.string(),
                "the names of colour images (" + color.paths.front().filename().string() + ") and depth images (" +
                    depth.paths.front().filename().string() +
                    ") do not match: both must contain numbers or times, or the folder must contain the lists rgb.txt "
                    "and depth.txt (a time stamp and a file name per line)");
  }
  return associate(color.keys, depth.keys, color.keys_are == image_keys::numbers ? 0.0 : max_time_difference);
}

/// The index of a recording in a folder of colour images and a folder of depth images. `fps`: frame rate of numbered
/// images. Errors: not_found (a folder), no_data (no depth images, no pair), invalid_argument (names that do not
/// match), unreadable, malformed (times, ground truth, with the line number).
template <class = void>
[[nodiscard]] result<recording_index> index_image_folders(const std::filesystem::path& folder,
                                                          double max_time_difference, double fps) {
  const auto color_folder = find_color_folder(folder), depth_folder = find_depth_folder(folder);
  if (color_folder.empty())
    return fail(errc::not_found, folder.string(),
                "no PNG or JPEG images in rgb, color, colour, image or images; the folder " + describe_content(folder));
  if (depth_folder.empty())
    return fail(errc::not_found, folder.string(),
                "no folder named depth, aligned_depth or depth_registered; the folder " + describe_content(folder));
  auto depth_images = images_in(depth_folder);
  std::erase_if(depth_images, [](const auto& path) { return !is_png_name(path); });
  if (depth_images.empty())
    return fail(errc::no_data, depth_folder.string(),
                "no PNG images: depth images must be 16-bit PNG files; the folder " + describe_content(depth_folder));
  const keyed_images color = order_by_name(images_in(color_folder)), depth = order_by_name(std::move(depth_images));

  recording_index index;
  const auto pairs = pair_by_name(color, depth, max_time_difference, folder);
  if (!pairs) return fail(pairs.error());
  std::vector<stamped_file> colors = color.stamped(fps);
  if (const auto read = read_image_times(folder, colors, index); !read) return fail(read.error());
  note_order(color_folder, color, !index.files.empty(), index.notes);
  note_order(depth_folder, depth, true, index.notes);
  const bool are_timed =
      color.keys_are == image_keys::times && depth.keys_are == image_keys::times && index.files.empty();
  for (const auto& [c, d] : *pairs)
    if (c < colors.size())
      index.frames.push_back({colors[c].timestamp,
                              colors[c].path,
                              depth.paths[d],
                              {},
                              are_timed ? std::optional{depth.keys[d]} : std::nullopt});
  const auto span = [](const keyed_images& images) {
    return images.paths.front().filename().string() + " to " + images.paths.back().filename().string();
  };
  if (index.frames.empty())
    return fail(errc::no_data, folder.string(),
                "no image of " + color_folder.filename().string() + " (" + span(color) + ") has a counterpart in " +
                    depth_folder.filename().string() + " (" + span(depth) + ")");
  for (const auto& [images, kind] : {std::pair{&color, "colour"}, std::pair{&depth, "depth"}})
    if (const std::size_t lonely = images->paths.size() - index.frames.size(); lonely != 0)
      index.notes.push_back(std::to_string(lonely) + " of " + std::to_string(images->paths.size()) + " " + kind +
                            " images have no counterpart and are skipped: colour images are " + span(color) +
                            ", depth images " + span(depth));
  note_unused_folders(folder, {color_folder, depth_folder}, index.notes);
  if (const auto truth = read_ground_truth(folder, max_time_difference, index, fps); !truth) return fail(truth.error());
  return index;
}

}  // namespace orbis::io::detail
