// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Numbers as they stand in the reasons of a choice.
#pragma once

#include <cstdio>
#include <string>

namespace orbis::cloud::detail {

[[nodiscard]] inline std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}
[[nodiscard]] inline std::string percent(double share) { return in_words(100 * share) + " %"; }

}  // namespace orbis::cloud::detail
