// SPDX-License-Identifier: BSD-3-Clause
//
// Detects that a program would overwrite its input.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include <orbis/core/quote.hpp>

namespace examples {

/// Returns true if both names refer to the same existing file, directly or by links.
[[nodiscard]] inline bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

/// The error message for an `output` that is the same file as `input`.
[[nodiscard]] inline std::string overwrite_message(const std::string& output, const std::string& input) {
  return orbis::shortened_path(output) + ": is an input (" + orbis::shortened_path(input) +
         ") and would be overwritten: choose another name for the result";
}

}  // namespace examples
