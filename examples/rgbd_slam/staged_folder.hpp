// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Replaces a set of files together.
///
/// New files are created in hidden folders `.rgbd_slam-XXXXXX` inside their target folders. At the end they are renamed
/// into place together:
///   1. all data is synced to the disk, and the suffix `.ready` is added to the name of the first hidden folder;
///   2. a child process in a separate session renames the files, and finishes even if this program is killed;
///   3. if the machine stops in between, the next program that reads or writes one of the folders finishes first
///      (`finish`).
/// Only files with the given names are moved; the hidden folders list them and each other in a folder `private_name`,
/// so that any program can complete the transaction. No other file in the folders is changed, and only hidden folders
/// of ended processes are deleted. Processes that write into the same folder wait for each other by `flock`.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include <orbis/core/result.hpp>

namespace app {

/// Owns a file descriptor.
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

/// The hidden folders of this process, which another thread removes if the process is interrupted.
struct hidden_folders {
  std::mutex mutex;  ///< guards `paths`; locked while a folder is created and while files are moved into place
  std::vector<std::filesystem::path> paths;
};

class staged_folder {
 public:
  /// Prefix of the names of hidden folders, and the name of a folder for other files in each hidden folder. No result
  /// may have a name with this prefix.
  static constexpr const char* private_name = ".rgbd_slam";

  /// Completes the moves into `folder` that ended processes have begun, and removes the other hidden folders of ended
  /// processes. Call it before anything in the folder is read. No effect if the folder does not exist. Errors:
  /// write_failed.
  [[nodiscard]] static orbis::result<void> finish(const std::filesystem::path& folder);

  /// Creates `folder` if it does not exist, creates the hidden folder in it, and adds the hidden folder to `hidden`.
  /// Calls `finish`. `names`: the files that may be moved into place. Errors: write_failed.
  [[nodiscard]] static orbis::result<staged_folder> open(const std::filesystem::path& folder,
                                                         std::vector<std::string> names, hidden_folders& hidden);
  staged_folder(staged_folder&&) = default;
  staged_folder& operator=(staged_folder&&) = delete;
  ~staged_folder() { discard(); }

  /// A path to the hidden folder that remains valid if the user renames one of the folders that contain it.
  [[nodiscard]] std::filesystem::path path() const;
  /// The folder into which the files will be moved.
  [[nodiscard]] const std::filesystem::path& target() const { return folder_; }
  /// Names of the files in the hidden folder.
  [[nodiscard]] std::vector<std::string> made() const;
  /// Removes the hidden folder with its files.
  void discard() noexcept;

  /// Moves the files of all folders into place: all of them, or none if it returns an error. Exception: if the files of
  /// a folder other than the first cannot be listed (it was deleted, or its disk is full), they are left out, and the
  /// error says so. If another program holds the lock of a folder, or files can be moved neither into place nor back,
  /// the error indicates that the next program that uses the folder completes the moves. `hidden`: see `open`.
  /// `complete` completes the files; it is called after the results of earlier runs have been moved into place. Errors:
  /// write_failed.
  [[nodiscard]] static orbis::result<void> put_in_place(std::span<staged_folder* const> folders, hidden_folders& hidden,
                                                        const std::function<void()>& complete);

 private:
  staged_folder() = default;
  /// Finds the current paths of the folders. @pre hidden.mutex is locked
  void follow(hidden_folders& hidden);
  /// Renames the hidden folder and updates its path in `hidden`, so that the handling of an interrupt finds the folder.
  /// @pre hidden.mutex is locked
  std::error_code rename_hidden(const std::filesystem::path& to, hidden_folders& hidden);
  /// Keeps the hidden folder after the end of this process. @pre hidden.mutex is locked
  void leave(hidden_folders& hidden);

  std::filesystem::path folder_, staging_;
  std::vector<std::string> names_;
  descriptor folder_lock_;   // locked while files are moved into place
  descriptor staging_lock_;  // locked during the life of this process
};

}  // namespace app
