// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Poses as 4x4 matrices in text form, and poses of frames in which the camera was lost.
#pragma once

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include <orbis/core/file.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/quote.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/text.hpp>

namespace orbis::io::detail {

/// Parses the pose `T_world_camera` from a text with a 4x4 matrix. Its upper left part may deviate from a rotation by a
/// few parts in a thousand, as in 7-Scenes: the result has the nearest rotation. Errors: malformed, with the line
/// number (not 16 numbers, NaN or infinity, a matrix that deviates from a rigid transform by more than 5 %).
template <class = void>
[[nodiscard]] result<se3> parse_pose_matrix(std::string_view text, const std::filesystem::path& path) {
  double m[16];
  std::size_t count = 0, last_line = 0;
  std::string problem;
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    last_line = number;
    for (std::string_view field = next_field(line); !field.empty(); field = next_field(line)) {
      if (count == 16)
        problem = "more than 16 numbers in a pose";
      else if (!parse_number(field, m[count]))
        problem = in_quotes(field) + " is not a number";
      else if (!std::isfinite(m[count++]))
        problem = "a pose with NaN or infinity";
      if (!problem.empty()) return false;
    }
    return true;
  });
  if (!problem.empty()) return fail(errc::malformed, at_line(path, last_line), problem);
  if (count != 16) return fail(errc::malformed, path.string(), "a pose must be a 4x4 matrix of 16 numbers");

  mat3 r;
  for (int y = 0; y != 3; ++y)
    for (int x = 0; x != 3; ++x) r(y, x) = m[static_cast<std::size_t>(4 * y + x)];
  const bool last_row =
      std::abs(m[12]) < 1e-3 && std::abs(m[13]) < 1e-3 && std::abs(m[14]) < 1e-3 && std::abs(m[15] - 1.0) < 1e-3;
  if (!last_row || determinant(r) < 0.0 || largest_magnitude(mat3(transposed(r) * r - identity<mat3>())) > 0.05)
    return fail(errc::malformed, path.string(), "the matrix is not a rigid transform");
  const auto rotation = nearest_rotation(r);
  if (!rotation) return fail(errc::malformed, path.string(), rotation.error().message);
  return se3(*rotation, vec3(m[3], m[7], m[11]));
}

/// Reads a pose; see `parse_pose_matrix`. Errors: not_found, unreadable, malformed.
template <class = void>
[[nodiscard]] result<se3> read_pose_matrix(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return fail(text.error());
  return parse_pose_matrix(*text, path);
}

/// Returns true if a number in the text is NaN or infinite, or if the text is a matrix (at least 3x4, row by row) whose
/// rotation is zero: data sets mark the poses of lost frames in these ways.
template <class = void>
[[nodiscard]] bool is_lost_pose(std::string_view text) {
  bool lost = false, is_zero = true;
  std::size_t count = 0;
  for_each_line(text, [&](std::string_view line, std::size_t) {
    double value = 0.0;
    for (std::string_view field = next_field(line); !lost && !field.empty(); field = next_field(line)) {
      if (!parse_number(field, value)) is_zero = false;
      lost = !std::isfinite(value);
      const bool of_rotation = count < 12 && count % 4 != 3;
      is_zero = is_zero && !(of_rotation && value != 0.0);
      ++count;
    }
    return !lost;
  });
  return lost || (is_zero && count >= 12);
}

/// A warning about frames without a pose.
template <class = void>
[[nodiscard]] std::string lost_frames_note(std::size_t lost, std::size_t frames) {
  return std::to_string(lost) + " of " + std::to_string(frames) + " frames have no pose: tracking was lost";
}

}  // namespace orbis::io::detail
