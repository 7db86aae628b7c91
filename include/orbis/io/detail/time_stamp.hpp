// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Units of time stamps in files and file names, and frame numbers in place of times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// A unit of time: its name and its length in seconds.
struct time_unit {
  std::string_view name;
  double seconds = 1.0;
  [[nodiscard]] friend bool operator==(const time_unit& a, const time_unit& b) noexcept {
    return a.seconds == b.seconds;
  }
};

/// The units of time stamps, from coarse to fine; each is a thousandth of the one before.
inline constexpr time_unit time_units[] = {
    {"seconds", 1.0}, {"milliseconds", 1e-3}, {"microseconds", 1e-6}, {"nanoseconds", 1e-9}};

/// The unit of a time stamp, determined by the number of digits before its decimal point: times since 1970 have 10
/// digits in seconds, 13 in milliseconds, 16 in microseconds and 19 in nanoseconds (from 2001 to 2286). Seconds for any
/// other number of digits, and for leading zeros.
[[nodiscard]] constexpr time_unit detect_unit(std::string_view stamp) noexcept {
  const std::size_t digits = std::min(stamp.find_first_not_of("0123456789"), stamp.size());
  if (stamp.starts_with('0') || (digits != stamp.size() && stamp[digits] != '.'))  // a sign, or an exponent
    return time_units[0];
  switch (digits) {
    case 13: return time_units[1];
    case 16: return time_units[2];
    case 19: return time_units[3];
    default: return time_units[0];
  }
}

/// Parses a time stamp in `unit`, by default the unit that `detect_unit` returns. Returns seconds; empty if the time
/// stamp is not a finite number.
template <class = void>
[[nodiscard]] std::optional<double> parse_time_stamp(std::string_view stamp,
                                                     std::optional<time_unit> unit = {}) noexcept {
  double t = 0.0;
  if (!parse_number(stamp, t) || !std::isfinite(t)) return std::nullopt;
  return t * unit.value_or(detect_unit(stamp)).seconds;
}

/// Formats a time in seconds for messages, with at most 6 decimals.
template <class = void>
[[nodiscard]] std::string describe(double seconds) {
  char text[400];  // the largest double has 309 digits
  const int length = std::snprintf(text, sizeof text, "%.6f", seconds);
  std::string all(text, static_cast<std::size_t>(length));
  all.erase(all.find_last_not_of('0') + 1);
  if (all.ends_with('.')) all.pop_back();
  return all;
}

/// Formats the span of times for a message: "12.5 to 20". @pre !times.empty()
template <class = void>
[[nodiscard]] std::string describe_span(const std::vector<double>& times) {
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  return describe(*first) + " to " + describe(*last);
}

/// The median difference between consecutive times. @pre times ascend, times.size() >= 2
template <class = void>
[[nodiscard]] double median_interval(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

template <class = void>
[[nodiscard]] bool are_whole(const std::vector<double>& times) {
  return std::all_of(times.begin(), times.end(), [](double t) { return t == std::floor(t); });
}

/// Returns true if ascending times are frame numbers: whole numbers, mostly less than ten apart, and far smaller than
/// seconds since 1970.
template <class = void>
[[nodiscard]] bool are_frame_numbers(const std::vector<double>& times) {
  constexpr double most_apart = 10.0, highest = 1e8;
  return times.size() >= 2 && times.front() >= 0.0 && times.back() < highest && are_whole(times) &&
         median_interval(times) < most_apart;
}

/// A warning if the median interval of ascending times is more than 30 times longer or shorter than that of a camera
/// with `fps` frames per second; empty otherwise. The warning states the factor by which the times seem to be wrong.
template <class = void>
[[nodiscard]] std::string describe_interval(const std::vector<double>& times, double fps) {
  constexpr double tolerance = 30.0;
  if (times.size() < 3) return {};
  const double interval = median_interval(times), ratio = interval * fps;
  if (!(ratio > tolerance || ratio < 1.0 / tolerance)) return {};
  char text[240];
  std::snprintf(text, sizeof text,
                "the time between frames is %.3g s, but at %.3g frames per second it would be %.3g s", interval, fps,
                1.0 / fps);
  std::string warning = text;
  // A wrong unit results in a factor that is a power of 1000; other factors have other causes.
  const double power = std::clamp(std::round(std::log10(ratio) / 3.0), 1.0, 6.0);
  if (ratio > tolerance && std::abs(ratio / std::pow(1000.0, power) - 1.0) < 0.3) {
    std::snprintf(text, sizeof text, "; the time stamps seem to be %.0f times too large: write them in seconds",
                  std::pow(1000.0, power));
    return warning + text;
  }
  return warning + "; check the unit of the time stamps, which are seconds, and fps of the camera";
}

}  // namespace orbis::io::detail
