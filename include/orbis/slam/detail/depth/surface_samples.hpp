// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth points of a frame, spread over the image and over the surface normals.
///
/// Source: S. Rusinkiewicz, M. Levoy, "Efficient variants of the ICP algorithm", 3DIM 2001 (sampling of normals).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/slam/detail/depth/surface.hpp>

namespace orbis::slam::detail {

/// A measured point and its surface normal, in the camera frame at the read-out time of the point.
struct surface_sample {
  vec3 point;
  vec3 normal;
  double row = 0.0;  ///< row in the depth image, pixels
};

/// Selects points on surfaces. Reuses its memory.
template <class = void>
class basic_surface_sampler {
 public:
  /// Selects at most `count` cells of a surface: the same number for every direction of normals (all cells of a
  /// direction if it has fewer), evenly spread over the image. O(cells).
  void choose(const surface& from, std::size_t count, std::vector<surface_sample>& to) {
    for (auto& bin : bins_) bin.clear();
    for (std::size_t i = 0; i != from.cells.size(); ++i)
      if (const surface_cell& c = from.cells[i]; c.is_there())
        bins_[bin_of(c)].push_back(static_cast<std::uint32_t>(i));
    std::array<std::uint8_t, bin_count> order;
    for (std::size_t b = 0; b != bin_count; ++b) order[b] = static_cast<std::uint8_t>(b);
    std::sort(order.begin(), order.end(), [&](std::uint8_t a, std::uint8_t b) {
      return bins_[a].size() != bins_[b].size() ? bins_[a].size() < bins_[b].size() : a < b;
    });
    to.clear();
    std::size_t left = count;
    for (std::size_t k = 0; k != bin_count; ++k) {  // the smallest bin first: larger bins use the rest of its share
      const auto& bin = bins_[order[k]];
      const std::size_t take = std::min(bin.size(), left / (bin_count - k));
      left -= take;
      for (std::size_t i = 0; i != take; ++i) {
        const std::size_t cell = bin[(2 * i + 1) * bin.size() / (2 * take)];
        const surface_cell& c = from.cells[cell];
        to.push_back({c.measured_point(), c.normal(), from.pixel_row(cell)});
      }
    }
  }

 private:
  static constexpr std::size_t across = 5, bin_count = across * across;

  /// Returns the bin of a normal. Normals point towards the camera, so x and y are sufficient.
  [[nodiscard]] static std::size_t bin_of(const surface_cell& c) noexcept {
    const auto part = [](float x) {
      const auto i = static_cast<int>((x + 1.0F) * 0.5F * static_cast<float>(across));
      return static_cast<std::size_t>(std::clamp(i, 0, static_cast<int>(across) - 1));
    };
    return part(c.nx) * across + part(c.ny);
  }

  std::array<std::vector<std::uint32_t>, bin_count> bins_;
};
using surface_sampler = basic_surface_sampler<>;

}  // namespace orbis::slam::detail
