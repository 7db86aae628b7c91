// SPDX-License-Identifier: BSD-3-Clause
//
// Formats counts for people.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace examples {

/// Formats a number with separators: "1,234,567".
[[nodiscard]] inline std::string count_text(std::uintmax_t n) {
  std::string digits = std::to_string(n);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
  return digits;
}

}  // namespace examples
