// SPDX-License-Identifier: BSD-3-Clause
//
// Prints the errors of the programs on one line.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>

namespace examples {

/// The text on one line: control characters are removed and words of more than 200 characters shortened, because input
/// files and arguments may contain both.
[[nodiscard]] inline std::string one_line(std::string_view text) {
  constexpr std::size_t longest = 200;
  std::string all;
  std::size_t length = 0;
  while (!text.empty()) {
    const std::size_t control = orbis::control_bytes(text);
    const char c = control == 0 ? text.front() : ' ';
    length = c == ' ' ? 0 : length + 1;
    if (length <= longest)
      all += c;
    else if (length == longest + 1)
      all += "...";
    text.remove_prefix(control == 0 ? 1 : control);
  }
  return all;
}

/// Returns "where: message", with only the end of a long path.
[[nodiscard]] inline std::string describe(const orbis::error& e) {
  return orbis::error{e.code, orbis::shortened_path(e.where), e.message}.to_string();
}

/// Prints "PROGRAM: why" on standard error. Returns `code`.
inline int report_error(const char* program, int code, std::string_view why) {
  std::fprintf(stderr, "%s: %s\n", program, one_line(why).c_str());
  return code;
}

}  // namespace examples
