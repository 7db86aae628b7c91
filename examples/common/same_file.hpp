// SPDX-License-Identifier: BSD-3-Clause
//
// Whether a program would write its result over what it reads.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace examples {

/// Whether both names lead to one file that exists, by links as well.
[[nodiscard]] inline bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}

/// What to say of `output` if it is `input`.
[[nodiscard]] inline std::string would_be_lost(const std::string& output, const std::string& input) {
  return output + ": is an input (" + input + ") and would be written over: give another name for the result";
}

}  // namespace examples
