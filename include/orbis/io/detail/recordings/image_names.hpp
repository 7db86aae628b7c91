// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Images in a folder, and their times or frame numbers from their names.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/result.hpp>
#include <orbis/io/detail/recordings/kitti.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/detail/time_stamp.hpp>

namespace orbis::io::detail {

/// The images directly in `folder`, sorted by name.
[[nodiscard]] inline std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder) {
  auto paths = list_folder(folder);
  std::erase_if(paths, [](const auto& path) { return !is_image_name(path); });
  return paths;
}

/// The meaning of the names of images.
enum class image_keys { times, numbers, alphabet };

/// Images, each with a key, in ascending order: seconds, frame numbers, or their index in alphabetical order.
struct keyed_images {
  image_keys keys_are = image_keys::alphabet;
  std::vector<double> keys;
  std::vector<std::filesystem::path> paths;

  /// Times in seconds. `fps`: rate of images without times.
  [[nodiscard]] std::vector<double> times(double fps) const {
    std::vector<double> all = keys;
    if (keys_are != image_keys::times)
      for (double& t : all) t /= fps;
    return all;
  }
};

/// The number in a file name: its last digits, with a fraction if it has one, and the text around it.
struct name_number {
  std::string_view before, number, after;

  explicit name_number(std::string_view stem) {
    constexpr std::string_view digits = "0123456789";
    const std::size_t end = stem.find_last_of(digits) + 1;
    if (end == 0) return;
    std::size_t begin = stem.find_last_not_of(digits, end - 1) + 1;
    if (begin >= 2 && stem[begin - 1] == '.' && digits.find(stem[begin - 2]) != std::string_view::npos)
      begin = stem.find_last_not_of(digits, begin - 2) + 1;
    before = stem.substr(0, begin);
    number = stem.substr(begin, end - begin);
    after = stem.substr(end);
  }
  /// Returns true if the number is a time: it has a fraction, or the digits of a time since 1970.
  [[nodiscard]] bool is_time() const {
    return number.find('.') != std::string_view::npos || !(unit_of(number) == time_units[0]) ||
           (number.size() == 10 && number.front() != '0');
  }
};

/// Orders images by their names: `1305031102.1753.png` and `1403636579763555584.png` are times (`parse_time_stamp`),
/// `frame_000123.png` is frame 123. If the names have no common form, they keep their order.
[[nodiscard]] inline keyed_images order_by_name(std::vector<std::filesystem::path> paths) {
  std::vector<std::string> stems;
  for (const auto& path : paths) stems.push_back(path.stem().string());
  const auto keys_by = [&](const auto& key_of) {
    std::vector<double> keys;
    const name_number first{stems.empty() ? std::string_view{} : stems.front()};
    for (const std::string& stem : stems) {
      const name_number name{stem};
      const bool is_like_first = name.before == first.before && name.after == first.after;
      const std::optional<double> key = is_like_first ? key_of(name) : std::nullopt;
      if (!key) return std::vector<double>{};
      keys.push_back(*key);
    }
    return keys;
  };
  keyed_images found;
  found.keys_are = image_keys::times;
  found.keys = keys_by([](const name_number& n) { return n.is_time() ? parse_time_stamp(n.number) : std::nullopt; });
  if (found.keys.empty()) {
    found.keys_are = image_keys::numbers;
    found.keys = keys_by([](const name_number& n) {
      std::uint32_t number = 0;
      return parse_number(n.number, number) ? std::optional<double>{number} : std::nullopt;
    });
  }
  if (found.keys.empty()) {
    found.keys_are = image_keys::alphabet;
    found.keys.resize(paths.size());
    std::iota(found.keys.begin(), found.keys.end(), 0.0);
    found.paths = std::move(paths);
    return found;
  }
  // Numbers without leading zeros are not in alphabetical order.
  std::vector<std::size_t> order(paths.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return found.keys[a] < found.keys[b]; });
  for (const std::size_t i : order) found.paths.push_back(paths[i]);
  std::sort(found.keys.begin(), found.keys.end());
  return found;
}

/// Replaces the times of images in order by those of `times.txt` or `timestamps.txt` in `folder`, if one exists;
/// images without a time are removed and noted. Errors: unreadable, malformed (with file and line).
[[nodiscard]] inline result<void> read_image_times(const std::filesystem::path& folder,
                                                   std::vector<stamped_file>& images, recording_index& index) {
  const auto file = first_present(folder, {"times.txt", "timestamps.txt"});
  if (file.empty()) return {};
  const auto text = read_file(file);
  if (!text) return fail(text.error());
  const auto times = parse_kitti_times(*text, file);
  if (!times) return fail(times.error());
  if (times->size() != images.size())
    index.notes.push_back(file.string() + ": " + std::to_string(times->size()) + " times for " +
                          std::to_string(images.size()) + " images");
  images.resize(std::min(images.size(), times->size()));
  for (std::size_t i = 0; i != images.size(); ++i) images[i].timestamp = (*times)[i];
  index.files.push_back(file);
  return {};
}

}  // namespace orbis::io::detail
