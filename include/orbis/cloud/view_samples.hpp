// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Samples of the measurements of each view, used to compare views with each other.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

namespace detail {

/// Depths of the eight pixels around a pixel, 0 outside the image; opposite pixels have the indices i and 7 - i.
template <camera::depth_source Depth>
[[nodiscard]] std::array<float, 8> depths_around(const Depth& depth, int x, int y) {
  std::array<float, 8> out{};
  std::size_t n = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      const int u = x + dx;
      const int v = y + dy;
      out[n++] = u >= 0 && v >= 0 && u < depth.width() && v < depth.height() ? depth(u, v) : 0.0F;
    }
  }
  return out;
}

/// Returns true if at least two of the surrounding pixels agree with depth `z`, or if the mean of two opposite ones
/// does. The mean is needed because on a surface seen at a grazing angle no two pixels have the same depth.
[[nodiscard]] inline bool agrees_with_neighbors(float z, const std::array<float, 8>& around, float margin) noexcept {
  int agree = 0;
  for (const float other : around) agree += other > 0 && std::abs(other - z) <= margin ? 1 : 0;
  if (agree >= 2) return true;
  constexpr float widest = 0.15F;  // fraction of z; opposite pixels further apart are on different surfaces
  for (std::size_t i = 0; i != 4; ++i) {
    const float a = around[i];
    const float b = around[7 - i];
    if (a > 0 && b > 0 && std::abs(a - b) <= widest * z && std::abs(0.5F * (a + b) - z) <= margin) return true;
  }
  return false;
}

}  // namespace detail

/// World points measured in the views, sampled on a grid over each image, excluding stray pixels. Callers that already
/// iterate over the views before they filter a cloud can draw the samples in the same pass, see
/// select_options::samples. Memory: 16 bytes per sample, at most `across * across` samples per view.
class view_samples {
 public:
  static constexpr std::uint32_t tiles = 4;  ///< number of tiles along each axis of an image

  /// Two depths agree if they differ by at most `margin + margin_growth z^2` (see ray_evidence_options).
  /// @pre across > 0
  explicit view_samples(const ray_evidence_options& evidence = {}, int across = 20)
      : margin_{evidence.margin}, margin_growth_{evidence.margin_growth}, across_{across} {
    assert(across > 0);
  }
  /// Draws the samples of the next view; none if its pose is not finite. O(across^2).
  /// @pre the image has the camera's size
  template <camera::camera_model Camera, posed_depth View>
  void add(const Camera& camera, const View& view) {
    assert(view.depth.width() == camera.width() && view.depth.height() == camera.height());
    const std::uint32_t first_tile = views_++ * tiles * tiles;
    const se3 pose = view.T_world_camera;
    if (!all_finite(pose.to_matrix())) return;
    for (int j = 0; j != across_; ++j) {
      for (int i = 0; i != across_; ++i) {
        const int x = (2 * i + 1) * camera.width() / (2 * across_);
        const int y = (2 * j + 1) * camera.height() / (2 * across_);
        const float z = view.depth(x, y);
        if (!(z > 0) || !detail::agrees_with_neighbors(z, detail::depths_around(view.depth, x, y),
                                                       margin_ + margin_growth_ * z * z))
          continue;
        const auto ray = camera.unproject({x, y});
        if (!ray) continue;
        points_.push_back((pose * (double{z} * *ray)).template cast<float>());
        tile_.push_back(first_tile + tile_at(j) * tiles + tile_at(i));
      }
    }
  }
  /// Adds a view but draws no samples.
  void skip() noexcept { ++views_; }

  /// Number of views that were added or skipped.
  [[nodiscard]] std::uint32_t views() const noexcept { return views_; }
  /// Sampled points in the world frame, metres, in the order of the views.
  [[nodiscard]] const std::vector<vec3f>& points() const noexcept { return points_; }
  /// For each point, the index of its view times tiles^2, plus the index of the tile in the image.
  [[nodiscard]] std::span<const std::uint32_t> tiles_by_point() const noexcept { return tile_; }
  [[deprecated("use tiles_by_point")]] [[nodiscard]] std::span<const std::uint32_t> tile_of() const noexcept {
    return tile_;
  }

 private:
  [[nodiscard]] std::uint32_t tile_at(int i) const noexcept {
    return static_cast<std::uint32_t>(i) * tiles / static_cast<std::uint32_t>(across_);
  }
  float margin_, margin_growth_;
  int across_;
  std::uint32_t views_ = 0;
  std::vector<vec3f> points_;
  std::vector<std::uint32_t> tile_;
};

}  // namespace orbis::cloud
