// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A file under a name of its own that becomes the wanted file by one rename.
#pragma once

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#if __has_include(<unistd.h>) && __has_include(<fcntl.h>)
#define ORBIS_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <unistd.h>
#endif

namespace orbis::detail {

/// An empty file that did not exist before; removed by the destructor unless it was put in place.
///
/// Its name is hidden and unique for the process and the call, so writers of the same file do not meet, neither those
/// of one process nor those of several.
class temporary_file {
 public:
  /// Creates the file in the folder of `target`. Where that fails, `exists` is false and `errno` says why.
  explicit temporary_file(const std::filesystem::path& target) {
    static std::atomic<std::uint32_t> calls{0};
    for (int attempt = 0; attempt != 100; ++attempt) {
      path_ = target.parent_path() / (".orbis-" + process() + "-" + std::to_string(calls.fetch_add(1)) + ".part");
      exists_ = create();
      if (exists_ || errno != EEXIST) return;  // EEXIST: left behind by a process of the same number
    }
  }
  ~temporary_file() {
    close();
    std::error_code ignored;
    if (exists_) std::filesystem::remove(path_, ignored);
  }
  temporary_file(const temporary_file&) = delete;
  temporary_file& operator=(const temporary_file&) = delete;

  [[nodiscard]] bool exists() const noexcept { return exists_; }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  /// Brings the file's bytes to the disk; false and `errno` if that fails.
  [[nodiscard]] bool sync() {
#ifdef ORBIS_HAS_POSIX_FILES
    return ::fsync(file_) == 0 || errno == EINVAL || errno == ENOTSUP;  // some file systems have no fsync
#else
    return true;
#endif
  }

  /// Renames the file to `target`, which it replaces, and brings the new name to the disk.
  [[nodiscard]] std::error_code rename_to(const std::filesystem::path& target) {
    close();
    std::error_code failure;
    std::filesystem::rename(path_, target, failure);
    if (failure) return failure;
    exists_ = false;
#ifdef ORBIS_HAS_POSIX_FILES
    // The file is whole and in place: a folder that cannot be synced (one that may not be listed) is no failure.
    const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
    if (const int names = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC); names >= 0) {
      static_cast<void>(::fsync(names));
      ::close(names);
    }
#endif
    return {};
  }

 private:
#ifdef ORBIS_HAS_POSIX_FILES
  static std::string process() { return std::to_string(::getpid()); }
  [[nodiscard]] bool create() {
    file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return file_ >= 0;
  }
  void close() noexcept {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }
  int file_ = -1;
#else
  static std::string process() { return "0"; }
  [[nodiscard]] bool create() const {
    std::error_code ignored;
    if (std::filesystem::exists(path_, ignored)) return errno = EEXIST, false;
    return std::ofstream{path_}.is_open();
  }
  void close() noexcept {}
#endif

  std::filesystem::path path_;
  bool exists_ = false;
};

}  // namespace orbis::detail
#undef ORBIS_HAS_POSIX_FILES
