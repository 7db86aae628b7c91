// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Reads and writes whole files. Writes are atomic: readers see the old file or the new one.
#pragma once

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ios>
#include <limits>
#include <new>
#include <ostream>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include <orbis/core/result.hpp>

#if __has_include(<unistd.h>) && __has_include(<fcntl.h>)
#define ORBIS_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <unistd.h>
#endif

namespace orbis::detail {

/// A newly created empty file that replaces the target file with a single rename; the destructor removes it unless it
/// was renamed.
///
/// Where the system supports it (Linux), the file has no name before the rename, so that no file remains if the process
/// is killed. Otherwise its name is hidden. Names are unique per process and call, so that concurrent writers of the
/// same file, in one process or in several, do not conflict.
template <class = void>
class basic_temporary_file {
 public:
  /// Creates the file in the folder of `target`. If that fails, `exists()` is false and `errno` holds the reason.
  explicit basic_temporary_file(const std::filesystem::path& target) : folder_{target.parent_path()} {
    if (!create_unnamed()) make_named([&] { return create(); });
  }
  ~basic_temporary_file() {
    close();
    std::error_code ignored;
    if (is_named_) std::filesystem::remove(path_, ignored);
  }
  basic_temporary_file(const basic_temporary_file&) = delete;
  basic_temporary_file& operator=(const basic_temporary_file&) = delete;

  [[nodiscard]] bool exists() const noexcept { return is_named_ || is_unnamed_; }
  /// The path with which callers open the file; valid until the file is renamed.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  /// Flushes the file to disk; returns false and sets `errno` if that fails.
  [[nodiscard]] bool sync() {
#ifdef ORBIS_HAS_POSIX_FILES
    return ::fsync(file_) == 0 || errno == EINVAL || errno == ENOTSUP;  // some file systems have no fsync
#else
    return true;
#endif
  }

  /// Renames the file to `target`, replacing it, and flushes the new name to the disk.
  [[nodiscard]] std::error_code rename_to(const std::filesystem::path& target) {
    if (is_unnamed_ && !give_name()) return {errno, std::generic_category()};
    close();
    std::error_code failure;
    std::filesystem::rename(path_, target, failure);
    if (failure) return failure;
    is_named_ = false;
#ifdef ORBIS_HAS_POSIX_FILES
    // The file is complete and in place: a folder that cannot be synced (e.g. without read permission) is not a
    // failure.
    const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
    if (const int names = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC); names >= 0) {
      static_cast<void>(::fsync(names));
      ::close(names);
    }
#endif
    return {};
  }

 private:
  [[nodiscard]] std::filesystem::path next_name() const {
    static std::atomic<std::uint32_t> calls{0};
    return folder_ / (".orbis-" + process() + "-" + std::to_string(calls.fetch_add(1)) + ".part");
  }
  /// Calls `make` with a new name in `path_` until it succeeds, or fails for any reason except that the name exists: an
  /// earlier process with the same id may have left a file of that name.
  template <class Make>
  bool make_named(const Make& make) {
    for (int attempt = 0; attempt != 100; ++attempt) {
      path_ = next_name();
      is_named_ = make();
      if (is_named_ || errno != EEXIST) break;
    }
    return is_named_;
  }
#ifdef O_TMPFILE
  /// Creates a file without a name. Fails if the file system does not support such files, or if /proc is not available.
  [[nodiscard]] bool create_unnamed() {
    file_ = ::open(folder_.empty() ? "." : folder_.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666);
    if (file_ < 0) return false;
    path_ = "/proc/self/fd/" + std::to_string(file_);
    is_unnamed_ = ::access(path_.c_str(), W_OK) == 0;
    if (!is_unnamed_) close();
    return is_unnamed_;
  }
  [[nodiscard]] bool give_name() {
    const std::filesystem::path link = std::exchange(path_, {});
    is_unnamed_ = false;
    return make_named(
        [&] { return ::linkat(AT_FDCWD, link.c_str(), AT_FDCWD, path_.c_str(), AT_SYMLINK_FOLLOW) == 0; });
  }
#else
  [[nodiscard]] static bool create_unnamed() { return false; }
  [[nodiscard]] static bool give_name() { return false; }
#endif
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

  std::filesystem::path folder_, path_;
  bool is_named_ = false;    ///< the file exists at path_
  bool is_unnamed_ = false;  ///< the file exists, without a name
};
using temporary_file = basic_temporary_file<>;

}  // namespace orbis::detail

namespace orbis {

/// Reads a regular file. Refuses endless files (devices), files that may block (pipes), and files larger than
/// `max_bytes`. Errors: not_found, unreadable; malformed (too large).
[[nodiscard]] inline result<std::string> read_file(const std::filesystem::path& path,
                                                   std::uintmax_t max_bytes = std::numeric_limits<std::size_t>::max()) {
  std::error_code ec;
  const auto status = std::filesystem::status(path, ec);
  if (status.type() == std::filesystem::file_type::none)  // no permission, or not a valid file name
    return fail(errc::unreadable, path.string(), "cannot be accessed: " + ec.message());
  if (!std::filesystem::exists(status)) return fail(errc::not_found, path.string(), "no such file");
  if (std::filesystem::is_directory(status)) return fail(errc::unreadable, path.string(), "is a directory");
  if (!std::filesystem::is_regular_file(status)) return fail(errc::unreadable, path.string(), "is not a regular file");
  const auto too_large = [&] {
    return fail(errc::malformed, path.string(),
                "is larger than " + std::to_string(max_bytes) + " bytes, the limit for such files");
  };
  std::ifstream in{path, std::ios::binary};
  if (!in) return fail(errc::unreadable, path.string(), "cannot be opened: " + std::generic_category().message(errno));
  std::string bytes;
  if (const auto size = std::filesystem::file_size(path, ec); !ec) {
    if (size > max_bytes) return too_large();
    if (size > bytes.max_size()) throw std::bad_alloc{};
    bytes.reserve(static_cast<std::size_t>(size));
  }
  char buffer[8192];  // stacks may be small
  while (in.read(buffer, sizeof buffer) || in.gcount() > 0) {
    const auto count = static_cast<std::size_t>(in.gcount());
    if (count > max_bytes - bytes.size()) return too_large();  // the file grows, or does not report its size
    bytes.append(buffer, count);
  }
  if (in.bad())
    return fail(errc::unreadable, path.string(), "cannot be read: " + std::generic_category().message(errno));
  return bytes;
}

/// Calls `write(std::ostream&)` on a temporary file next to `path`, flushes it to the disk (fsync) and renames it to
/// `path`. If anything fails (including an exception from `write`), the temporary file is removed and `path` is
/// unchanged. Readers, and the next start after a crash, find the old file or the new one, never a partial file.
///
/// The temporary file has a unique name: two threads or two programs may write the same file at the same time; the last
/// one wins. A `path` that is not a regular file (a device, a folder) is not replaced; a symbolic link itself is
/// replaced, not its target. `write` returns `void`, or `result<void>` to report an error. Errors: write_failed, or
/// those of `write`.
template <class Write>
[[nodiscard]] result<void> write_file_atomically(const std::filesystem::path& path, Write&& write) {
  const auto reason = [] { return std::generic_category().message(errno != 0 ? errno : EIO); };
  const auto cannot = [&](const std::string& what) { return fail(errc::write_failed, path.string(), what); };

  std::error_code ec;
  if (const auto existing = std::filesystem::status(path, ec);
      std::filesystem::exists(existing) && !std::filesystem::is_regular_file(existing))
    return cannot("is not a regular file and cannot be replaced");
  detail::temporary_file temporary{path};
  if (!temporary.exists()) return cannot("cannot be created: " + reason());
  errno = 0;
  std::ofstream out{temporary.path(), std::ios::binary | std::ios::trunc};
  if (!out) return cannot("cannot be created: " + reason());
  if constexpr (std::is_void_v<std::invoke_result_t<Write&, std::ostream&>>) {
    write(static_cast<std::ostream&>(out));
  } else {
    if (result<void> done = write(static_cast<std::ostream&>(out)); !done) return fail(std::move(done.error()));
  }
  out.close();
  if (!out || !temporary.sync()) return cannot("cannot be written: " + reason());
  if (const std::error_code failure = temporary.rename_to(path))
    return cannot("cannot be renamed into place: " + failure.message());
  return {};
}

}  // namespace orbis
#undef ORBIS_HAS_POSIX_FILES
