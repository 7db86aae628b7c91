// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whole files in, whole files out: a reader of what we write never sees half a file.
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ios>
#include <ostream>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include <orbis/core/result.hpp>

namespace orbis {

/// The bytes of a file. Errors: not_found, unreadable.
[[nodiscard]] inline result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code ec;
  const auto status = std::filesystem::status(path, ec);
  if (status.type() == std::filesystem::file_type::none)  // no permission to look, or no name for a file
    return fail(errc::unreadable, path.string(), "cannot be looked up: " + ec.message());
  if (!std::filesystem::exists(status)) return fail(errc::not_found, path.string(), "no such file");
  if (std::filesystem::is_directory(status)) return fail(errc::unreadable, path.string(), "is a directory");
  std::ifstream in{path, std::ios::binary};
  if (!in) return fail(errc::unreadable, path.string(), "cannot be opened: " + std::generic_category().message(errno));
  std::string bytes;
  if (const auto size = std::filesystem::file_size(path, ec); !ec) bytes.reserve(static_cast<std::size_t>(size));
  char buffer[65536];
  while (in.read(buffer, sizeof buffer) || in.gcount() > 0) bytes.append(buffer, static_cast<std::size_t>(in.gcount()));
  if (in.bad())
    return fail(errc::unreadable, path.string(), "cannot be read: " + std::generic_category().message(errno));
  return bytes;
}

/// Calls `write(std::ostream&)` on a temporary file beside `path` and renames it to `path` when
/// everything, the closing included, succeeded; otherwise (an exception from `write` included)
/// removes it and leaves `path` as it was. What is there and no regular file (a device, a folder) is
/// not replaced; a symbolic link is, not what it points to. `write` may return `void`, or `result<void>` to give up.
/// Errors: write_failed, or `write`'s own.
template <class Write>
[[nodiscard]] result<void> write_file_atomically(const std::filesystem::path& path, Write&& write) {
  namespace fs = std::filesystem;
  struct temporary_file {
    fs::path path;
    bool in_place = false;
    ~temporary_file() {
      std::error_code ignored;
      if (!in_place) fs::remove(path, ignored);
    }
  };
  const auto reason = [] { return std::generic_category().message(errno != 0 ? errno : EIO); };

  std::error_code ec;
  if (const auto existing = fs::status(path, ec); fs::exists(existing) && !fs::is_regular_file(existing))
    return fail(errc::write_failed, path.string(), "is not a regular file, and is not replaced by one");
  fs::path beside = path;
  beside += ".part";
  errno = 0;
  std::ofstream out{beside, std::ios::binary | std::ios::trunc};
  if (!out) return fail(errc::write_failed, path.string(), "cannot be created: " + reason());
  temporary_file temporary{std::move(beside)};
  if constexpr (std::is_void_v<std::invoke_result_t<Write&, std::ostream&>>) {
    write(static_cast<std::ostream&>(out));
  } else {
    if (result<void> done = write(static_cast<std::ostream&>(out)); !done) return fail(std::move(done.error()));
  }
  out.close();
  if (!out) return fail(errc::write_failed, path.string(), "cannot be written: " + reason());
  fs::rename(temporary.path, path, ec);
  if (ec) return fail(errc::write_failed, path.string(), "cannot be put in place: " + ec.message());
  temporary.in_place = true;
  return {};
}

}  // namespace orbis
