// SPDX-License-Identifier: BSD-3-Clause
//
// Clouds in coordinates as of maps of a country (UTM): floats and octrees do not do for numbers so large, so such a
// cloud is taken relative to a place within it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/cloud_file.hpp>

namespace examples {

/// `place` in whole metres, or zero where it is so near to the origin that floats and octrees do for it.
[[nodiscard]] inline orbis::vec3 nearby_origin(const orbis::vec3& place) {
  constexpr double far = 1000.0;
  if (!place.allFinite() || place.cwiseAbs().maxCoeff() < far) return orbis::vec3::Zero();
  return place.array().round();
}

/// A point with half of the finite points on either side, along each axis: a few stray ones do not move it. Zero where
/// there are none.
[[nodiscard]] inline orbis::vec3 middle_of(const std::vector<orbis::vec3f>& points) {
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
  orbis::point_cloud cloud;  ///< relative to `origin`
  orbis::vec3 origin;        ///< in the coordinates of the file; zero where these are small
};

/// Reads a cloud; one far away relative to its middle. Errors: those of `io::read_cloud`.
[[nodiscard]] inline orbis::result<cloud_near_origin> read_near_origin(const std::filesystem::path& path) {
  auto cloud = orbis::io::read_cloud(path);
  if (!cloud) return orbis::fail(cloud.error());
  const orbis::vec3 origin = nearby_origin(middle_of(cloud->points));
  if (!origin.isZero()) {
    cloud = orbis::io::read_cloud(path, origin);
    if (!cloud) return orbis::fail(cloud.error());
  }
  return cloud_near_origin{*std::move(cloud), origin};
}

}  // namespace examples
