// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of `ray_evidence.hpp`: what they do, and how without any particular instructions.
/// Every kernel rounds every operation, so that all of them give the same bits.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/cloud/detail/rays/ray_view.hpp>
#include <orbis/core/rounded.hpp>

namespace orbis::cloud::detail {

/// Where a block's points lie in a view.
struct seen_block {
  static constexpr std::size_t size = point_blocks::block_size;
  alignas(64) std::array<std::int32_t, size> pixel;  ///< y * width + x; negative: not in the image
  alignas(64) std::array<float, size> depth;         ///< of the point, metres; undefined outside the image
};

/// What a view says of a block's points; bit i of word w is point 16 w + i.
struct block_verdict {
  static constexpr std::size_t words = point_blocks::block_size / 16;
  std::array<std::uint16_t, words> through;
  std::array<std::uint16_t, words> supported;
  /// `f(i, supported)` for the points of which the view says something.
  template <class F>
  void for_each(F&& f) const {
    for (std::size_t w = 0; w != words; ++w) {
      for (std::uint32_t left = through[w] | supported[w]; left != 0; left &= left - 1) {
        const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
        f(16 * w + bit, (supported[w] >> bit & 1U) != 0);
      }
    }
  }
};

/// A block's points, axis by axis.
using block_axes = std::array<const float*, 3>;

/// One set of inner loops.
struct ray_kernels {
  /// Where the points lie in a pinhole's image.
  void (*locate)(const ray_view& view, const block_axes& points, seen_block& seen);
  /// What the windows around their pixels say of them.
  void (*judge)(const ray_view& view, const seen_block& seen, block_verdict& verdict);
  /// Adds one to the counters of the points with a bit in `words`, up to their largest number.
  void (*count)(const std::array<std::uint16_t, block_verdict::words>& words, std::uint16_t* counters);
};

/// A point in the camera frame.
[[nodiscard]] inline std::array<float, 3> in_camera(const ray_view& view, float x, float y, float z) noexcept {
  const std::array<float, 3> d{(x - view.origin[0]) - view.origin_rest[0], (y - view.origin[1]) - view.origin_rest[1],
                               (z - view.origin[2]) - view.origin_rest[2]};
  std::array<float, 3> out;
  for (std::size_t a = 0; a != 3; ++a) {
    const auto& row = view.rotation[a];
    out[a] = (rounded_product(row[0], d[0]) + rounded_product(row[1], d[1])) + rounded_product(row[2], d[2]);
  }
  return out;
}

inline void locate_portable(const ray_view& view, const block_axes& points, seen_block& seen) {
  const auto width = static_cast<float>(view.width);
  const auto height = static_cast<float>(view.height);
  for (std::size_t i = 0; i != seen_block::size; ++i) {
    const auto q = in_camera(view, points[0][i], points[1][i], points[2][i]);
    const float u = rounded_product(view.fx, q[0] / q[2]) + view.cx;
    const float v = rounded_product(view.fy, q[1] / q[2]) + view.cy;
    const bool inside =
        q[2] > view.min_depth && q[2] <= view.max_depth && u >= 0.0F && u < width && v >= 0.0F && v < height;
    seen.depth[i] = q[2];
    seen.pixel[i] = inside ? static_cast<std::int32_t>(v) * view.width + static_cast<std::int32_t>(u) : -1;
  }
}

/// The same for any camera.
template <camera::camera_model Camera>
void locate_by(const Camera& camera, const ray_view& view, const block_axes& points, seen_block& seen) {
  for (std::size_t i = 0; i != seen_block::size; ++i) {
    const auto q = in_camera(view, points[0][i], points[1][i], points[2][i]);
    seen.depth[i] = q[2];
    seen.pixel[i] = -1;
    if (!(q[2] > view.min_depth && q[2] <= view.max_depth)) continue;
    const auto pixel = camera.project(vec3{q[0], q[1], q[2]});
    if (!pixel) continue;
    const double u = pixel->x() + 0.5;
    const double v = pixel->y() + 0.5;
    if (u >= 0 && u < view.width && v >= 0 && v < view.height)
      seen.pixel[i] = static_cast<std::int32_t>(v) * view.width + static_cast<std::int32_t>(u);
  }
}

inline void judge_portable(const ray_view& view, const seen_block& seen, block_verdict& verdict) {
  for (std::size_t w = 0; w != block_verdict::words; ++w) {
    std::uint32_t through = 0;
    std::uint32_t supported = 0;
    for (std::uint32_t lane = 0; lane != 16; ++lane) {
      const std::size_t i = 16 * w + lane;
      if (seen.pixel[i] < 0) continue;
      const float z = seen.depth[i];
      const float nearest = view.nearest[seen.pixel[i]];
      const float farthest = view.farthest[seen.pixel[i]];
      const float margin = view.margin + rounded_product(view.margin_growth, rounded_product(z, z));
      const auto near = [&](float depth) { return std::abs(depth - z) <= margin; };
      if (nearest - z > margin + rounded_product(view.slant, farthest - nearest)) through |= 1U << lane;
      if (near(nearest) || near(farthest) || near(view.middle[seen.pixel[i]])) supported |= 1U << lane;
    }
    verdict.through[w] = static_cast<std::uint16_t>(through);
    verdict.supported[w] = static_cast<std::uint16_t>(supported);
  }
}

inline void count_portable(const std::array<std::uint16_t, block_verdict::words>& words, std::uint16_t* counters) {
  for (std::size_t i = 0; i != point_blocks::block_size; ++i) {
    const std::uint32_t more = words[i / 16] >> (i % 16) & 1U;
    counters[i] = static_cast<std::uint16_t>(
        std::min<std::uint32_t>(counters[i] + more, std::numeric_limits<std::uint16_t>::max()));
  }
}

}  // namespace orbis::cloud::detail
