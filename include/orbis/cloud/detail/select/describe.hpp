// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Formatting of numbers and text for the reason of a choice.
#pragma once

#include <cstdio>
#include <initializer_list>
#include <string>
#include <string_view>

namespace orbis::cloud::detail {

[[nodiscard]] inline std::string describe(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}
/// Concatenates parts of a sentence. Chained string additions are slow to compile.
[[nodiscard]] inline std::string joined(std::initializer_list<std::string_view> parts) {
  std::string out;
  for (const std::string_view part : parts) out += part;
  return out;
}
[[nodiscard]] inline std::string percent(double share) { return describe(100 * share) + " %"; }

}  // namespace orbis::cloud::detail
