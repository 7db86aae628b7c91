// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Images in a folder, and the times or frame numbers in their names.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>
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

/// The images directly in `folder`, sorted by name, excluding hidden files.
template <class = void>
[[nodiscard]] std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder) {
  auto paths = list_folder(folder);
  std::erase_if(paths,
                [](const auto& path) { return !is_image_name(path) || path.filename().string().starts_with('.'); });
  return paths;
}

/// The order that image names determine: by time, by number, or only alphabetical.
enum class image_keys { times, numbers, alphabet };

/// Images in ascending order of their keys: times in seconds, frame numbers, or indices in alphabetical order.
struct keyed_images {
  image_keys keys_are = image_keys::alphabet;
  std::vector<double> keys;
  std::vector<std::filesystem::path> paths;
  std::vector<std::filesystem::path> others;  ///< images whose names have another form

  /// The images with times in seconds. `fps`: frame rate of images without times.
  [[nodiscard]] std::vector<stamped_file> stamped(double fps) const {
    std::vector<stamped_file> all;
    for (std::size_t i = 0; i != keys.size(); ++i)
      all.push_back({keys_are == image_keys::times ? keys[i] : keys[i] / fps, paths[i]});
    return all;
  }
};

/// The last number in a file name (whole, with a fraction, or seconds and nanoseconds), and the text before and after
/// it.
struct name_number {
  std::string_view before, number, after;
  std::string_view fraction;  ///< the part after `_` or `-` in `seconds_nanoseconds`; `number` contains both parts

  explicit name_number(std::string_view stem) {
    constexpr std::string_view digits = "0123456789";
    const std::size_t end = stem.find_last_of(digits) + 1;
    if (end == 0) return;
    std::size_t begin = stem.find_last_not_of(digits, end - 1) + 1;
    const auto digits_before = [&](std::size_t at) { return at - (stem.find_last_not_of(digits, at - 1) + 1); };
    if (begin >= 2 && stem[begin - 1] == '.' && digits_before(begin - 1) != 0) {
      begin -= 1 + digits_before(begin - 1);
    } else if (begin >= 11 && (stem[begin - 1] == '_' || stem[begin - 1] == '-') && digits_before(begin - 1) == 10 &&
               stem[begin - 11] != '0' && end - begin <= 9) {
      fraction = stem.substr(begin, end - begin);
      begin -= 11;
    }
    before = stem.substr(0, begin);
    number = stem.substr(begin, end - begin);
    after = stem.substr(end);
  }
  /// Returns true if the number is a time: it has a fraction, or the digits of a time since 1970.
  [[nodiscard]] bool is_time() const {
    return !fraction.empty() || number.find('.') != std::string_view::npos || !(detect_unit(number) == time_units[0]) ||
           (number.size() == 10 && number.front() != '0');
  }
  /// The time in seconds, or the frame number. `unit`: unit of the fraction after whole seconds.
  [[nodiscard]] std::optional<double> key(double unit) const {
    if (!fraction.empty()) {
      double whole = 0.0, part = 0.0;
      const bool good = parse_number(number.substr(0, 10), whole) && parse_number(fraction, part);
      return good ? std::optional{whole + part * unit} : std::nullopt;
    }
    if (is_time()) return parse_time_stamp(number);
    std::uint32_t frame = 0;
    return parse_number(number, frame) ? std::optional<double>{frame} : std::nullopt;
  }
};

/// Orders images by their names: `1305031102.1753.png`, `1403636579763555584.png` and `1311868164_20000000.png`
/// (seconds and nanoseconds) are times, `frame_000123.png` is frame 123. The most common form of the names is used;
/// images with other names are left out. If no name has one of these forms, all images keep their alphabetical order.
template <class = void>
[[nodiscard]] keyed_images order_by_name(std::vector<std::filesystem::path> paths) {
  struct image {
    double key = 0.0;
    std::size_t index = 0;
  };
  std::vector<std::string> stems;
  for (const auto& path : paths) stems.push_back(path.stem().string());
  using form = std::tuple<std::string_view, std::string_view, bool, bool>;
  const auto form_of = [](const name_number& n) { return form{n.before, n.after, n.is_time(), !n.fraction.empty()}; };
  std::map<form, std::vector<image>> by_form;
  std::size_t shortest = 9, longest = 0;
  for (const std::string& stem : stems)
    if (const name_number name{stem}; !name.fraction.empty()) {
      shortest = std::min(shortest, name.fraction.size());
      longest = std::max(longest, name.fraction.size());
    }
  // Fractions of equal lengths are decimals; others are integers in the coarsest unit in which they are below 1 s.
  const bool is_padded = shortest == longest && longest % 3 == 0;
  const double unit = is_padded      ? std::pow(10.0, -static_cast<double>(longest))
                      : longest <= 3 ? 1e-3
                      : longest <= 6 ? 1e-6
                                     : 1e-9;
  for (std::size_t i = 0; i != stems.size(); ++i) {
    const name_number name{stems[i]};
    if (const auto key = name.key(unit)) by_form[form_of(name)].push_back({*key, i});
  }
  const auto most = std::max_element(by_form.begin(), by_form.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  keyed_images found;
  if (most == by_form.end() || 2 * most->second.size() <= paths.size()) {
    found.keys.resize(paths.size());
    std::iota(found.keys.begin(), found.keys.end(), 0.0);
    found.paths = std::move(paths);
    return found;
  }
  found.keys_are = std::get<2>(most->first) ? image_keys::times : image_keys::numbers;
  // Numbers without leading zeros are not in alphabetical order.
  std::vector<image>& images = most->second;
  std::stable_sort(images.begin(), images.end(), [](const image& a, const image& b) { return a.key < b.key; });
  std::vector<bool> is_used(paths.size());
  for (const image& i : images) {
    found.keys.push_back(i.key);
    found.paths.push_back(paths[i.index]);
    is_used[i.index] = true;
  }
  for (std::size_t i = 0; i != paths.size(); ++i)
    if (!is_used[i]) found.others.push_back(paths[i]);
  return found;
}

/// Adds notes about images whose names do not determine their order, and about images that are left out because of
/// their names. `has_times`: the times of the images are known from another source.
template <class = void>
void note_order(const std::filesystem::path& folder, const keyed_images& images, bool has_times,
                std::vector<std::string>& notes) {
  if (images.keys_are == image_keys::alphabet && !has_times)
    notes.push_back(folder.string() +
                    ": the names of the images are neither numbers nor times; they are read in alphabetical order");
  if (!images.others.empty())
    notes.push_back(folder.string() + ": " + std::to_string(images.others.size()) + " images with other names (" +
                    images.others.front().filename().string() + ") are skipped");
}

/// Adds a note that lists the subfolders of `folder` that contain images and are not in `used`.
template <class = void>
void note_unused_folders(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& used,
                         std::vector<std::string>& notes) {
  std::string unused;
  for (const auto& path : list_folder(folder)) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(path, ignored) || std::find(used.begin(), used.end(), path) != used.end())
      continue;
    if (!images_in(path).empty()) unused += (unused.empty() ? "" : ", ") + path.filename().string() + "/";
  }
  if (!unused.empty()) notes.push_back(folder.string() + ": the images in " + unused + " are not used");
}

/// Replaces the times of the images, in order, with those in `times.txt` or `timestamps.txt` in `folder`, if it exists;
/// images without a time are removed and noted. Errors: unreadable, malformed (with file and line).
template <class = void>
[[nodiscard]] result<void> read_image_times(const std::filesystem::path& folder, std::vector<stamped_file>& images,
                                            recording_index& index) {
  const auto file = first_present(folder, {"times.txt", "timestamps.txt"});
  if (file.empty()) return {};
  const auto text = read_file(file);
  if (!text) return fail(text.error());
  const auto times = parse_times(*text, file);
  if (!times) return fail(times.error());
  if (times->size() != images.size())
    index.notes.push_back(file.string() + ": " + std::to_string(times->size()) + " time stamps for " +
                          std::to_string(images.size()) + " images");
  images.resize(std::min(images.size(), times->size()));
  for (std::size_t i = 0; i != images.size(); ++i) images[i].timestamp = (*times)[i];
  index.files.push_back(file);
  return {};
}

}  // namespace orbis::io::detail
