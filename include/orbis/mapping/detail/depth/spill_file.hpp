// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A file for data beyond the memory budget. It is unlinked as soon as it is open, so it never outlives the program,
/// even after a crash.
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <map>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/result.hpp>

#if __has_include(<unistd.h>) && __has_include(<fcntl.h>)
#define ORBIS_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <unistd.h>
#endif

namespace orbis::mapping::detail {

/// Unused ranges of a file; adjacent ones are joined.
class free_ranges {
 public:
  /// Allocates `size` bytes in the first unused range that is large enough, otherwise at the end of the file. Returns
  /// the start of the allocated range.
  [[nodiscard]] std::uint64_t take(std::uint64_t size) {
    for (auto hole = holes_.begin(); hole != holes_.end(); ++hole) {
      if (hole->second < size) continue;
      const auto [start, length] = *hole;
      holes_.erase(hole);
      if (length != size) holes_.emplace(start + size, length - size);
      return start;
    }
    return std::exchange(end_, end_ + size);
  }
  /// Frees a range. @pre it was allocated by `take`
  void give(std::uint64_t start, std::uint64_t size) {
    if (size == 0) return;
    auto next = holes_.lower_bound(start);
    if (next != holes_.end() && start + size == next->first) {
      size += next->second;
      next = holes_.erase(next);
    }
    if (next != holes_.begin())
      if (const auto before = std::prev(next); before->first + before->second == start) {
        start = before->first;
        size += before->second;
        holes_.erase(before);
      }
    if (start + size == end_)
      end_ = start;
    else
      holes_.emplace(start, size);
  }
  /// End of the last range in use.
  [[nodiscard]] std::uint64_t end() const noexcept { return end_; }

 private:
  std::map<std::uint64_t, std::uint64_t> holes_;  // size of each hole, keyed by its start
  std::uint64_t end_ = 0;
};

/// Byte records in an unlinked temporary file, with their checksums in memory. Any number of threads may read
/// concurrently while no thread writes.
template <class = void>
class basic_spill_file {
 public:
  struct record {
    std::uint64_t start = 0;
    std::uint32_t size = 0, checksum = 0;
  };

  /// Creates the file at `path` when the first record is written.
  explicit basic_spill_file(std::filesystem::path path) : path_{std::move(path)} {}
  ~basic_spill_file() { close(); }
  basic_spill_file(basic_spill_file&& other) noexcept
      : path_{std::move(other.path_)}, ranges_{std::move(other.ranges_)}, file_{std::exchange(other.file_, -1)} {}
  basic_spill_file& operator=(basic_spill_file&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(ranges_, other.ranges_);
    std::swap(file_, other.file_);
    return *this;
  }

  /// Appends a record. Error: write_failed; the file is then unchanged. @pre bytes.size() < 2^32
  [[nodiscard]] result<record> write(std::span<const std::byte> bytes) {
#ifdef ORBIS_HAS_POSIX_FILES
    if (file_ < 0)
      if (auto done = open(); !done) return fail(std::move(done.error()));
    const record to{ranges_.take(bytes.size()), static_cast<std::uint32_t>(bytes.size()), crc32c(bytes)};
    std::uint64_t at = to.start;
    while (!bytes.empty()) {
      const ::ssize_t n = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<::off_t>(at));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) {
        const int why = n < 0 ? errno : ENOSPC;
        erase(to);
        return fail(errc::write_failed, path_.string(), "cannot be written: " + std::generic_category().message(why));
      }
      bytes = bytes.subspan(static_cast<std::size_t>(n));
      at += static_cast<std::uint64_t>(n);
    }
    return to;
#else
    static_cast<void>(bytes);
    return fail(errc::unsupported, path_.string(),
                "spill files are not supported on this system; leave the path empty");
#endif
  }

  /// Reads a record. Errors: unreadable; malformed if the bytes differ from those written.
  [[nodiscard]] result<std::vector<std::byte>> read(const record& from) const {
#ifdef ORBIS_HAS_POSIX_FILES
    std::vector<std::byte> bytes(from.size);
    for (std::size_t done = 0; done != bytes.size();) {
      const ::ssize_t n =
          ::pread(file_, bytes.data() + done, bytes.size() - done, static_cast<::off_t>(from.start + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0)
        return fail(errc::unreadable, path_.string(), "cannot be read: " + std::generic_category().message(errno));
      if (n == 0) return fail(errc::malformed, path_.string(), "is shorter than the data written to it");
      done += static_cast<std::size_t>(n);
    }
    if (crc32c(bytes) != from.checksum)
      return fail(errc::malformed, path_.string(), "the checksum is wrong: the file is damaged");
    return bytes;
#else
    static_cast<void>(from);
    return fail(errc::unsupported, path_.string(),
                "spill files are not supported on this system; leave the path empty");
#endif
  }

  /// Frees a record. @pre the record is in the file
  void erase(const record& r) {
    const std::uint64_t end = ranges_.end();
    ranges_.give(r.start, r.size);
#ifdef ORBIS_HAS_POSIX_FILES
    // Return space to the file system; if that fails, later records reuse it.
    if (ranges_.end() < end) static_cast<void>(::ftruncate(file_, static_cast<::off_t>(ranges_.end())) == 0);
#else
    static_cast<void>(end);
#endif
  }

 private:
#ifdef ORBIS_HAS_POSIX_FILES
  [[nodiscard]] result<void> open() {
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (file_ < 0)
      return fail(errc::write_failed, path_.string(), "cannot be created: " + std::generic_category().message(errno));
    ::unlink(path_.c_str());  // the file exists until it is closed
    return {};
  }
  void close() noexcept {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }
#else
  void close() noexcept {}
#endif

  std::filesystem::path path_;
  free_ranges ranges_;
  int file_ = -1;
};
using spill_file = basic_spill_file<>;

}  // namespace orbis::mapping::detail
#undef ORBIS_HAS_POSIX_FILES
