// SPDX-License-Identifier: BSD-3-Clause
//
// Clouds in geographic coordinates (UTM): the coordinates are too large for floats and octrees, so these clouds are
// read relative to an origin within them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
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

/// The median of the finite points along each axis, which is robust to outliers. Zero if there are no finite points.
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

/// Replaces points with a coordinate beyond `most` metres by NaN, because sums of squared distances might exceed the
/// range of float. Returns the number of these points.
inline std::size_t remove_distant(std::vector<orbis::vec3f>& points) {
  constexpr float most = 1e15F;
  std::size_t removed = 0;
  for (orbis::vec3f& p : points)
    if (orbis::is_finite(p) && !(p.cwiseAbs().maxCoeff() <= most)) {
      p.setConstant(std::numeric_limits<float>::quiet_NaN());
      ++removed;
    }
  return removed;
}

/// Returns true if more than half of the finite points are within 1e-12 metres of the origin, but not at it.
[[nodiscard]] inline bool is_too_small(const std::vector<orbis::vec3f>& points) {
  constexpr float least = 1e-12F;
  std::size_t finite = 0, near = 0;
  for (const orbis::vec3f& p : points) {
    if (!orbis::is_finite(p)) continue;
    const float largest = p.cwiseAbs().maxCoeff();
    ++finite;
    near += largest > 0.0F && largest < least ? 1 : 0;
  }
  return near > finite / 2;
}

struct cloud_near_origin {
  orbis::io::cloud_with_fields read;  ///< coordinates relative to `origin`
  orbis::vec3 origin;                 ///< in the coordinates of the file; zero if the coordinates are small
};

/// Reads a cloud, relative to its median if that is far from the origin. Errors: those of `io::read_cloud`; unsupported
/// (the unit of the coordinates cannot be the metre).
[[nodiscard]] inline orbis::result<cloud_near_origin> read_near_origin(const std::filesystem::path& path) {
  auto read = orbis::io::read_cloud_with_fields(path);
  if (!read) return orbis::fail(read.error());
  const orbis::vec3 origin = nearby_origin(median_point(read->cloud.points));
  if (!origin.isZero()) {
    read = orbis::io::read_cloud_with_fields(path, origin);
    if (!read) return orbis::fail(read.error());
  }
  if (const std::size_t distant = remove_distant(read->cloud.points); distant != 0)
    read->notes.push_back(std::to_string(distant) + " points are left out, because they are more than 1e15 m away");
  if (is_too_small(read->cloud.points))
    return orbis::fail(orbis::errc::unsupported, path.string(),
                       "most points are less than 1e-12 m from the origin: the coordinates must be in metres");
  return cloud_near_origin{*std::move(read), origin};
}

}  // namespace examples
