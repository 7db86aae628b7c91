// SPDX-License-Identifier: BSD-3-Clause
//
// Clouds in geographic coordinates (UTM): the numbers are too large for floats and octrees, so that such a cloud is
// read relative to an origin within it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/cloud_file.hpp>

namespace examples {

/// `place` rounded to metres, or zero if it is within 1 km of the origin along each axis.
[[nodiscard]] inline orbis::vec3 nearby_origin(const orbis::vec3& place) {
  constexpr double far = 1000.0;
  if (!place.allFinite() || place.cwiseAbs().maxCoeff() < far) return orbis::vec3::Zero();
  return place.array().round();
}

/// The median of the finite points along each axis, which outliers do not move. Zero if there are none.
[[nodiscard]] inline orbis::vec3 median_point(const std::vector<orbis::vec3f>& points) {
  orbis::vec3 middle = orbis::vec3::Zero();
  std::vector<float> along;
  for (const int axis : {0, 1, 2}) {
    along.clear();
    for (const orbis::vec3f& p : points)
      if (orbis::is_finite(p)) along.push_back(p[axis]);
    if (along.empty()) break;
    const auto half = along.begin() + static_cast<std::ptrdiff_t>(along.size() / 2);
    std::nth_element(along.begin(), half, along.end());
    middle[axis] = *half;
  }
  return middle;
}

struct cloud_near_origin {
  orbis::io::cloud_with_fields read;  ///< coordinates relative to `origin`
  orbis::vec3 origin;                 ///< in the coordinates of the file; zero if these are small
};

/// Reads a cloud, relative to its median if that is far from the origin. Errors: those of `io::read_cloud`.
[[nodiscard]] inline orbis::result<cloud_near_origin> read_near_origin(const std::filesystem::path& path) {
  auto read = orbis::io::read_cloud_with_fields(path);
  if (!read) return orbis::fail(read.error());
  const orbis::vec3 origin = nearby_origin(median_point(read->cloud.points));
  if (!origin.isZero()) {
    read = orbis::io::read_cloud_with_fields(path, origin);
    if (!read) return orbis::fail(read.error());
  }
  return cloud_near_origin{*std::move(read), origin};
}

}  // namespace examples
