// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Files that are made beside the old ones and replace them together.
///
/// New files are made in a hidden folder `.rgbd_slam-XXXXXX` inside the folder that they are for. In the end they are
/// renamed to their places in one go:
///   1. everything is brought to the disk, and the hidden folder gets the ending `.ready`;
///   2. a child process of its own session renames the files: when this program is killed, it still finishes;
///   3. where the whole machine stops in between, the next run finds the folder that is `.ready` and finishes.
/// Only files of given names are put in place. Nothing else in the folder is touched, and nothing is deleted but the
/// hidden folders of processes that are gone. Processes that write into the same folder wait for each other by `flock`.
#pragma once

#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <orbis/core/result.hpp>

namespace app {

/// An open file descriptor.
class descriptor {
 public:
  descriptor() = default;
  explicit descriptor(int number) : number_{number} {}
  descriptor(descriptor&& other) noexcept;
  descriptor& operator=(descriptor&& other) noexcept;
  ~descriptor();
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_ = -1;
};

/// The hidden folders of this process, for another thread that removes them when the process is interrupted.
struct hidden_folders {
  std::mutex mutex;  ///< of the paths; held while a folder is made, and while files are put in place
  std::vector<std::filesystem::path> paths;
};

class staged_folder {
 public:
  /// Makes `folder` where it does not exist, and the hidden folder in it, and adds it to `hidden`. Finishes or removes
  /// what processes that are gone have left there. `names`: of the files that may be put in place. Errors:
  /// write_failed.
  [[nodiscard]] static orbis::result<staged_folder> open(const std::filesystem::path& folder,
                                                         std::vector<std::string> names, hidden_folders& hidden);
  staged_folder(staged_folder&&) = default;
  staged_folder& operator=(staged_folder&&) = delete;
  ~staged_folder() { discard(); }

  /// Where the files are made.
  [[nodiscard]] const std::filesystem::path& path() const { return staging_; }
  /// Names of the files that were made.
  [[nodiscard]] std::vector<std::string> made() const;
  /// Removes the hidden folder with what is in it.
  void discard() noexcept;

  /// Puts the files of all folders in place: all of them, or none if an error is returned. Errors: write_failed.
  /// `hidden`: as for `open`.
  [[nodiscard]] static orbis::result<void> put_in_place(std::span<staged_folder* const> folders,
                                                        hidden_folders& hidden);

 private:
  staged_folder() = default;

  std::filesystem::path folder_, staging_;
  std::vector<std::string> names_;
  descriptor folder_lock_;   // locked while files are put in place
  descriptor staging_lock_;  // locked as long as this process lives
};

}  // namespace app
