// SPDX-License-Identifier: BSD-3-Clause
//
// Checks of output files before the work begins.
#pragma once

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

#include <unistd.h>

#include <orbis/core/quote.hpp>

namespace examples {

/// Returns true if both names refer to the same existing file, directly or through links.
[[nodiscard]] inline bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

/// The error message for an `output` that is the same file as `input`.
[[nodiscard]] inline std::string overwrite_message(const std::string& output, const std::string& input) {
  return orbis::shortened_path(output) + ": is an input (" + orbis::shortened_path(input) +
         ") and would be overwritten: choose another name for the result";
}

/// The error message if the file `output` definitely cannot be created or replaced; otherwise empty.
[[nodiscard]] inline std::string unwritable_message(const std::string& output) {
  const std::filesystem::path path{output}, folder = path.has_parent_path() ? path.parent_path() : ".";
  const std::string where = orbis::shortened_path(output);
  std::error_code ignored;
  const auto there = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
    return where + ": is not a regular file and cannot be replaced";
  if (!std::filesystem::is_directory(folder, ignored)) return where + ": its folder does not exist";
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return where + ": cannot be created: " + std::generic_category().message(errno);
}

}  // namespace examples
