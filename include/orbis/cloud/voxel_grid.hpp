// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One point for each occupied voxel.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/cloud/voxel_hash.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/point_cloud.hpp>

namespace orbis::cloud {

/// Gathers points into voxels as they come: memory follows the surface, not the number of points.
class voxel_accumulator {
 public:
  /// @pre size > 0, metres
  explicit voxel_accumulator(double size) : voxels_{size} {}

  /// Adds a point and returns the number of its voxel; empty for points that have none (see
  /// `voxel_hash::key_of`).
  template <point_like P>
  std::optional<std::uint32_t> add(const P& point, const rgb8& color = {}) {
    const auto key = voxels_.key_of(point);
    if (!key) return std::nullopt;
    const std::uint32_t number = voxels_.insert(*key);
    if (number == sums_.size()) sums_.emplace_back();
    sum& s = sums_[number];
    const auto p = coordinates<double>(point);
    for (std::size_t a = 0; a != 3; ++a) s.position[a] += p[a];
    s.color[0] += color.r;
    s.color[1] += color.g;
    s.color[2] += color.b;
    ++s.count;
    return number;
  }
  /// The number of the voxel a point lies in, if something was added there.
  template <point_like P>
  [[nodiscard]] std::optional<std::uint32_t> find(const P& point) const {
    const auto key = voxels_.key_of(point);
    return key ? voxels_.find(*key) : std::nullopt;
  }
  [[nodiscard]] std::size_t size() const noexcept { return sums_.size(); }
  /// How many points were added to a voxel. @pre number < size()
  [[nodiscard]] std::uint32_t count(std::uint32_t number) const { return sums_[number].count; }

  /// The centroids with their mean colours, by voxel number: in the order in which the voxels were
  /// first seen.
  [[nodiscard]] point_cloud centroids(bool with_colors = true) const {
    point_cloud out;
    out.points.reserve(sums_.size());
    if (with_colors) out.colors.reserve(sums_.size());
    for (const sum& s : sums_) {
      const double n = s.count;
      out.points.emplace_back(static_cast<float>(s.position[0] / n), static_cast<float>(s.position[1] / n),
                              static_cast<float>(s.position[2] / n));
      const auto channel = [&](std::size_t c) {
        return static_cast<std::uint8_t>((s.color[c] + s.count / 2) / s.count);  // rounded
      };
      if (with_colors) out.colors.push_back({channel(0), channel(1), channel(2)});
    }
    return out;
  }

 private:
  struct sum {
    std::array<double, 3> position{};
    std::array<std::uint64_t, 3> color{};
    std::uint32_t count = 0;
  };
  voxel_hash voxels_;
  std::vector<sum> sums_;
};

struct voxel_grid_options {
  double size = 0.01;  ///< edge of a voxel, metres; > 0
};

/// The centroid of the points in each occupied voxel, in the order in which the voxels are first
/// seen, with the mean of their colours where `colors` is not empty. Points that are not finite are
/// left out, as are those more than 2^31 voxels from the origin. O(n).
/// @pre size > 0; colors is empty or as long as points
template <point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Points& points, std::span<const rgb8> colors,
                                     const voxel_grid_options& options = {}) {
  assert(colors.empty() || colors.size() == std::ranges::size(points));
  voxel_accumulator voxels{options.size};
  std::size_t i = 0;
  for (const auto& p : points) {
    voxels.add(p, colors.empty() ? rgb8{} : colors[i]);
    ++i;
  }
  return voxels.centroids(!colors.empty());
}

/// The same for a cloud without colours.
template <point_range Points>
[[nodiscard]] point_cloud voxel_grid(const Points& points, const voxel_grid_options& options = {}) {
  return voxel_grid(points, {}, options);
}

/// The same for a cloud of our own, colours included.
[[nodiscard]] inline point_cloud voxel_grid(const point_cloud& cloud, const voxel_grid_options& options = {}) {
  return voxel_grid(cloud.points, cloud.colors, options);
}

}  // namespace orbis::cloud
