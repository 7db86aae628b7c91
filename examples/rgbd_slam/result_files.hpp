// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The files that a run writes to the output folder.
///
/// At its end, a run moves all files that it created into place together, and replaces earlier files of the same names;
/// it deletes no files. Other files of an earlier run remain; `summary.json` lists both. Files with a result's name
/// that exist when the run begins and that this program did not write are not replaced, nor are inputs of the run.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>

#include "settings.hpp"
#include "staged_folder.hpp"

namespace app {

/// Names of files, in the order in which the documentation lists them.
using file_names = std::vector<std::string>;

/// The name of the trajectory file for a map that was not merged with the main map; the first such map has number 2.
[[nodiscard]] std::string trajectory_name(std::size_t number);
/// The maximum number of maps with a trajectory file, including the main one.
inline constexpr std::size_t most_maps = 9;

/// The files that the command may write to the output folder.
[[nodiscard]] file_names result_names(const settings& s);

/// Completes earlier runs that were interrupted while they moved their files into place, in all folders that the
/// command reads or writes. Call it before any of these folders is read. Errors: write_failed.
[[nodiscard]] orbis::result<void> finish_earlier_runs(const settings& s);

/// All files that the run reads. `source_files`: the files of the recording.
[[nodiscard]] std::vector<std::filesystem::path> input_files(const settings& s,
                                                             std::vector<std::filesystem::path> source_files);
/// Returns an error if one of the files `targets` is one of `inputs`, directly or through a link. Names may be empty.
[[nodiscard]] std::optional<orbis::error> find_overwritten(const std::vector<std::filesystem::path>& targets,
                                                           const std::vector<std::filesystem::path>& inputs);
/// Returns an error if the run would overwrite one of `inputs`, directly or through a link, or a file that this program
/// did not write. Calls stat on each input if a target exists.
[[nodiscard]] std::optional<orbis::error> find_overwritten(const settings& s,
                                                           const std::vector<std::filesystem::path>& inputs);

/// Returns an error (write_failed) if an output folder can be neither written nor created. Creates nothing, so that it
/// can be called before the run starts; it therefore does not find all errors.
[[nodiscard]] std::optional<orbis::error> find_unwritable(const settings& s);

/// Lists the files of the output folder `out`. New files are created in `folder`.
class file_lists {
 public:
  file_lists(std::filesystem::path out, std::filesystem::path folder)
      : out_{std::move(out)}, folder_{std::move(folder)} {}

  /// The files of this run: those created so far, and those in `coming`.
  [[nodiscard]] file_names made(const file_names& coming) const;
  /// The files of earlier runs that will stay in the output folder.
  [[nodiscard]] file_names of_earlier_runs(const file_names& made) const;

 private:
  std::filesystem::path out_, folder_;
};

class result_files {
 public:
  /// Creates the folders and checks that files can be created in them. Errors: write_failed; invalid_argument (a
  /// reserved file name, or the same name for two results).
  [[nodiscard]] static orbis::result<result_files> begin(const settings& s);
  result_files(result_files&&) noexcept = default;
  result_files& operator=(result_files&&) = delete;
  ~result_files();

  /// The folder in which the files of the output folder are created.
  [[nodiscard]] std::filesystem::path folder() const { return folders_.front().path(); }
  /// The path at which the landmark map is created. @pre the settings request one
  [[nodiscard]] std::filesystem::path landmark_map() const { return folders_[map_folder_].path() / map_name_; }
  /// Removes the landmark map, to make room on the disk for other results. Returns false if there is none.
  bool drop_landmark_map() const;
  /// The path at which the floor map is created, next to its image; empty if the settings request none.
  [[nodiscard]] std::filesystem::path floor_map() const { return floor_map_in({}); }
  [[nodiscard]] file_lists lists() const { return {out_, folder()}; }
  /// Replaces, in an error, the path at which a file is created by the path at which it will appear. An error that
  /// names no file gets the output folder. @pre the files are not in place yet
  [[nodiscard]] orbis::error with_final_path(orbis::error e) const;

  /// Creates the folders for optional files, which `take_optional` adds to the results, either all or none. Errors:
  /// write_failed.
  [[nodiscard]] orbis::result<void> begin_optional();
  /// The counterparts of `folder` and `floor_map` for the optional files.
  [[nodiscard]] std::filesystem::path optional_folder() const { return folder() / optional_name; }
  [[nodiscard]] std::filesystem::path optional_floor_map() const { return floor_map_in(optional_name); }
  /// Adds the optional files to the other files: all of them, or none if this fails. Errors: write_failed.
  [[nodiscard]] orbis::result<void> take_optional();
  /// Removes the optional files.
  void drop_optional() noexcept;
  /// Replaces the old files by the new ones: all, or none if this fails. Errors: write_failed.
  [[nodiscard]] orbis::result<void> put_in_place();

 private:
  /// Returns true if an error shows that the user has deleted a folder other than the output folder. Its files are left
  /// out at the end (`put_in_place`).
  [[nodiscard]] bool is_deleted(const staged_folder& f, const std::error_code& error) const;
  /// Updates the list of other results in summary.json, as another run may have written to the output folder since the
  /// summary was written.
  void list_other_results() const;
  static inline const std::filesystem::path optional_name =
      std::filesystem::path{staged_folder::private_name} / "optional";

  result_files() = default;
  [[nodiscard]] std::filesystem::path floor_map_in(const std::filesystem::path& part) const {
    return floor_name_.empty() ? std::filesystem::path{} : folders_[floor_folder_].path() / part / floor_name_;
  }

  std::filesystem::path out_;
  std::string map_name_, floor_name_;
  std::size_t map_folder_ = 0, floor_folder_ = 0;
  std::vector<staged_folder> folders_;  ///< the output folder, and the folders of files outside it
};

}  // namespace app
