// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// PCL point clouds. Every algorithm accepts a `pcl::PointCloud` directly as a range of points. Filters return indices
/// into the cloud; `extract` copies the selected points with all their fields:
///
/// @code
///   const auto keep = orbis::cloud::statistical_inliers(orbis::par, cloud);   // cloud: pcl::PointCloud<P>
///   const pcl::PointCloud<P> clean = orbis::interop::extract(cloud, keep);
/// @endcode
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>

namespace orbis::interop {

/// A PCL point type with a colour.
template <class P>
concept colored_pcl_point = point_like<P> && requires(P& p, const P& constant) {
  { constant.r } -> std::convertible_to<std::uint8_t>;
  { constant.g } -> std::convertible_to<std::uint8_t>;
  { constant.b } -> std::convertible_to<std::uint8_t>;
  p.r = p.g = p.b = std::uint8_t{};
};

/// The colour of a point.
template <colored_pcl_point P>
[[nodiscard]] constexpr rgb8 color_of(const P& point) noexcept {
  return {point.r, point.g, point.b};
}

/// Position from which the cloud's points were observed, in metres in the frame of the cloud: `sensor_origin_`. PCL
/// uses zeros for an unknown origin. Zeros count as the actual origin for an organised cloud, because a single sensor
/// measured it, and as unknown for other clouds.
template <point_like P>
[[nodiscard]] std::optional<vec3> sensor_origin(const pcl::PointCloud<P>& cloud) {
  const vec3 origin = cloud.sensor_origin_.template head<3>().template cast<double>();
  if (!origin.allFinite() || (origin.isZero(0) && !cloud.isOrganized())) return std::nullopt;
  return origin;
}

/// A view of the points of an organised cloud as an image. Errors: unsupported, if the cloud is not organised. An empty
/// cloud gives an empty view.
template <point_like P>
[[nodiscard]] result<image_view<const P>> as_image(const pcl::PointCloud<P>& cloud) {
  if (cloud.empty()) return image_view<const P>{};
  if (!cloud.isOrganized() || cloud.size() != std::size_t{cloud.width} * cloud.height)
    return fail(errc::unsupported, "pcl::PointCloud",
                "is not organised: " + std::to_string(cloud.size()) + " points, " + std::to_string(cloud.width) + "x" +
                    std::to_string(cloud.height));
  return image_view<const P>{cloud.points.data(), static_cast<int>(cloud.width), static_cast<int>(cloud.height)};
}
template <point_like P>
[[deprecated("use as_image")]] [[nodiscard]] result<image_view<const P>> image_of(const pcl::PointCloud<P>& cloud) {
  return as_image(cloud);
}

/// The points with the given indices, in the order of the indices, with all their fields; the header and sensor pose
/// are copied from the cloud. @pre every index < cloud.size()
template <point_like P>
[[nodiscard]] pcl::PointCloud<P> extract(const pcl::PointCloud<P>& cloud, std::span<const std::uint32_t> indices) {
  pcl::PointCloud<P> out;
  out.header = cloud.header;
  out.sensor_origin_ = cloud.sensor_origin_;
  out.sensor_orientation_ = cloud.sensor_orientation_;
  out.reserve(indices.size());
  for (const std::uint32_t i : indices) {
    assert(i < cloud.size());
    out.points.push_back(cloud.points[i]);
  }
  out.width = static_cast<std::uint32_t>(indices.size());
  out.height = 1;
  out.is_dense = true;
  for (const P& p : out.points) out.is_dense = out.is_dense && is_finite(p);
  return out;
}

/// Copies the points, with their colours if they have any.
template <point_like P>
[[nodiscard]] point_cloud from_pcl(const pcl::PointCloud<P>& cloud) {
  point_cloud out;
  out.points.reserve(cloud.size());
  for (const P& p : cloud.points) {
    const auto c = coordinates<float>(p);
    out.points.emplace_back(c[0], c[1], c[2]);
  }
  if constexpr (colored_pcl_point<P>) {
    out.colors.reserve(cloud.size());
    for (const P& p : cloud.points) out.colors.push_back(color_of(p));
  }
  return out;
}

/// Copies the points to a PCL cloud, with colours if the cloud and `P` have them; all other fields have PCL's defaults.
template <point_like P = pcl::PointXYZRGB>
[[nodiscard]] pcl::PointCloud<P> to_pcl(const point_cloud& cloud) {
  pcl::PointCloud<P> out;
  out.points.resize(cloud.size());
  out.width = static_cast<std::uint32_t>(cloud.size());
  out.height = 1;
  out.is_dense = true;
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    P& p = out.points[i];
    p.x = cloud.points[i].x();
    p.y = cloud.points[i].y();
    p.z = cloud.points[i].z();
    out.is_dense = out.is_dense && is_finite(cloud.points[i]);
    if constexpr (colored_pcl_point<P>) {
      if (!cloud.has_colors()) continue;
      p.r = cloud.colors[i].r;
      p.g = cloud.colors[i].g;
      p.b = cloud.colors[i].b;
    }
  }
  return out;
}

}  // namespace orbis::interop

/// The sensor origin of a PCL cloud, for filters that need ranges.
template <orbis::point_like P>
struct orbis::cloud::cloud_traits<pcl::PointCloud<P>> {
  [[nodiscard]] static std::optional<vec3> sensor_origin(const pcl::PointCloud<P>& cloud) {
    return interop::sensor_origin(cloud);
  }
};
