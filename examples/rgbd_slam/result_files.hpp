// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The files that a run writes, and how they come into the folder that was asked for.
///
/// A run replaces the files that it makes, all together and at its end, and deletes nothing. Files of an earlier run
/// that it does not make stay; `summary.json` tells which are whose. What is in the folder under a result's name and
/// was not made by this program is not replaced, nor is any input of the run.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <orbis/core/result.hpp>

#include "settings.hpp"
#include "staged_folder.hpp"

namespace app {

/// Names of files, in the order in which the documentation lists them.
using file_names = std::vector<std::string>;

/// The trajectory of a map that was never joined with the main one; the first of them is number 2.
[[nodiscard]] std::string trajectory_name(std::size_t number);
/// Of maps with a file of their own, the main one included.
inline constexpr std::size_t most_maps = 9;

/// The files that the command may make in the output folder.
[[nodiscard]] file_names result_names(const settings& s);

/// Every file that the run reads; `source_files`: those of the recording.
[[nodiscard]] std::vector<std::filesystem::path> inputs_of(const settings& s,
                                                           std::vector<std::filesystem::path> source_files);
/// Whether one of the files `targets` is one of `inputs`, compared as files, so that links do not matter. Nothing if
/// not. Names may be empty.
[[nodiscard]] std::optional<orbis::error> find_overwritten(const std::vector<std::filesystem::path>& targets,
                                                           const std::vector<std::filesystem::path>& inputs);
/// Whether the run would write over a file that is not its to replace: one of `inputs` (compared as files, so that
/// links do not matter), or one that was not made by this program. Nothing if not. Cost: a look at each input's entry
/// in its folder, where there is anything that might be replaced.
[[nodiscard]] std::optional<orbis::error> find_overwritten(const settings& s,
                                                           const std::vector<std::filesystem::path>& inputs);

/// Whether a folder that the results go to cannot be written or made, as far as that can be told without making it: so
/// that a user need not wait to be told. Nothing if not. Errors: write_failed.
[[nodiscard]] std::optional<orbis::error> find_unwritable(const settings& s);

class result_files {
 public:
  /// Makes the folders, and sees whether files can be made in them. Errors: write_failed.
  [[nodiscard]] static orbis::result<result_files> begin(const settings& s);
  result_files(result_files&&) noexcept = default;
  result_files& operator=(result_files&&) = delete;
  ~result_files();

  /// Where the files of the output folder are made.
  [[nodiscard]] const std::filesystem::path& folder() const { return folders_.front().path(); }
  /// Where the map of landmarks is made. @pre settings name one
  [[nodiscard]] std::filesystem::path landmark_map() const { return folders_[map_folder_].path() / map_name_; }
  /// Where the floor map is made, the image beside it; empty if settings name none.
  [[nodiscard]] std::filesystem::path floor_map() const {
    return floor_name_.empty() ? std::filesystem::path{} : folders_[floor_folder_].path() / floor_name_;
  }

  /// The files of the output folder: those made so far, with those of `coming` ...
  [[nodiscard]] file_names made(const file_names& coming) const;
  /// ... and those of earlier runs that will stay beside them.
  [[nodiscard]] file_names of_earlier_runs(const file_names& made) const;

  /// Replaces the old files by those that were made: all, or none if this fails. Errors: write_failed.
  [[nodiscard]] orbis::result<void> put_in_place();

 private:
  result_files() = default;

  std::filesystem::path out_;
  std::string map_name_, floor_name_;
  std::size_t map_folder_ = 0, floor_folder_ = 0;
  std::vector<staged_folder> folders_;  ///< the output folder; those of the other files that are elsewhere
};

}  // namespace app
