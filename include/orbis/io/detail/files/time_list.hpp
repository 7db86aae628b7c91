// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Files with one time per line, such as KITTI's `times.txt`.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/io/detail/text.hpp>
#include <orbis/io/detail/time_stamp.hpp>

namespace orbis::io::detail {

/// Parses time stamps (`parse_time_stamp`), one per line. Errors: malformed, with the line number (not a number, or not
/// ascending).
template <class = void>
[[nodiscard]] result<std::vector<double>> parse_times(std::string_view text, const std::filesystem::path& where) {
  std::vector<double> times;
  std::size_t bad_line = 0;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    const auto t = parse_time_stamp(line);
    if (!t || (!times.empty() && !(*t > times.back()))) return bad_line = number, false;
    times.push_back(*t);
    return true;
  });
  if (bad_line != 0)
    return fail(errc::malformed, at_line(where, bad_line), "a line must have one time, later than the previous one");
  return times;
}

}  // namespace orbis::io::detail
