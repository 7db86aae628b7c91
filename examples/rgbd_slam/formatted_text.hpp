// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Text as printf makes it.
#pragma once

#include <cstdio>
#include <string>

namespace app {

/// At most 511 characters.
template <class... Args>
[[nodiscard]] std::string text(const char* format, Args... args) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

}  // namespace app
