// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// printf-style formatting to strings.
#pragma once

#include <cstdio>
#include <string>

namespace app {

/// Formats a text of at most 511 characters.
template <class... Args>
[[nodiscard]] std::string text(const char* format, Args... args) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

}  // namespace app
