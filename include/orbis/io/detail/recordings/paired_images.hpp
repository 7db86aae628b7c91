// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pairs of images of two cameras, by their time stamps.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_folder.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>

namespace orbis::io::detail {

/// Pairs left with right images within `max_time_difference` seconds and makes frames of them; what finds no partner is
/// noted. Errors: no_data (no pair), not_found (the first images).
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
                         " images have no partner and are left out");
  return check_first_frame(to, where);
}

}  // namespace orbis::io::detail
