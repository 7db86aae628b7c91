// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Inner loops of `ray_evidence.hpp`. Every operation is rounded, so that results are bit-identical on all targets.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/camera/model.hpp>
#include <orbis/camera/project_lanes.hpp>
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/cloud/detail/rays/ray_view.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Projection of a block's points into a view.
struct seen_block {
  static constexpr std::size_t size = point_blocks::block_size;
  alignas(64) std::array<std::int32_t, size> pixel;  ///< y * width + x; negative: outside the image
  alignas(64) std::array<float, size> depth;         ///< depth of the point, metres; undefined outside the image
};

/// The evidence that a view provides about a block's points; bit i of word w is point 16 w + i.
struct block_verdict {
  static constexpr std::size_t words = point_blocks::block_size / 16;
  std::array<std::uint16_t, words> through;
  std::array<std::uint16_t, words> supported;
  /// Calls `f(i, supported)` for the points with evidence.
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

/// Coordinates of a block's points, axis by axis.
using block_axes = std::array<const float*, 3>;

/// Transforms a point into the camera frame.
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

/// Projects points into the image of any camera.
template <camera::camera_model Camera>
void locate_by(const Camera& camera, const ray_view& view, const block_axes& points, seen_block& seen) {
  using projection = camera::projection_kernel<Camera>;
  const auto project = simd::kernel<projection, typename projection::signature>();
  constexpr std::size_t size = seen_block::size;
  std::array<float, size> x, y;
  std::array<double, size> u, v;
  for (std::size_t i = 0; i != size; ++i) {
    const auto q = in_camera(view, points[0][i], points[1][i], points[2][i]);
    x[i] = q[0];
    y[i] = q[1];
    seen.depth[i] = q[2];
  }
  project(camera, {x.data(), y.data(), seen.depth.data()}, size, u.data(), v.data());
  for (std::size_t i = 0; i != size; ++i) {
    const double column = u[i] + 0.5, row = v[i] + 0.5;
    const bool inside = seen.depth[i] > view.min_depth && seen.depth[i] <= view.max_depth && column >= 0 &&
                        column < view.width && row >= 0 && row < view.height;
    seen.pixel[i] =
        inside ? static_cast<std::int32_t>(row) * view.width + static_cast<std::int32_t>(column) : std::int32_t{-1};
  }
}

/// Projects points into the image of a pinhole camera.
struct locate_in_pinhole {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const ray_view& view, const block_axes& points, seen_block& seen) {
    using lanes = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    for (std::size_t i = 0; i != seen_block::size; i += lanes::count) {
      lanes d[3], q[3];
      for (std::size_t a = 0; a != 3; ++a)
        d[a] = (lanes::load(points[a] + i) - lanes(view.origin[a])) - lanes(view.origin_rest[a]);
      for (std::size_t a = 0; a != 3; ++a) {
        const auto& row = view.rotation[a];
        q[a] = (lanes(row[0]) * d[0] + lanes(row[1]) * d[1]) + lanes(row[2]) * d[2];
      }
      const lanes u = lanes(view.fx) * (q[0] / q[2]) + lanes(view.cx);
      const lanes v = lanes(view.fy) * (q[1] / q[2]) + lanes(view.cy);
      const auto inside = (q[2] > lanes(view.min_depth)) & (q[2] <= lanes(view.max_depth)) & (u >= lanes(0.0F)) &
                          (u < lanes(static_cast<float>(view.width))) & (v >= lanes(0.0F)) &
                          (v < lanes(static_cast<float>(view.height)));
      const integers pixel = simd::convert<std::int32_t>(v) * integers(view.width) + simd::convert<std::int32_t>(u);
      q[2].store(seen.depth.data() + i);
      select(inside, pixel, integers(-1)).store(seen.pixel.data() + i);
    }
  }
};

/// Decides from the window around each point's pixel whether the point is supported or a ray passes through it.
struct judge_by_windows {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const ray_view& view, const seen_block& seen, block_verdict& verdict) {
    using lanes = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    const lanes nothing = depth_windows::none;
    for (std::size_t w = 0; w != block_verdict::words; ++w) {
      std::uint32_t through = 0;
      std::uint32_t supported = 0;
      for (std::size_t at = 0; at != 16; at += lanes::count) {
        const integers pixel = integers::load(seen.pixel.data() + 16 * w + at);
        const auto inside = pixel >= integers(0);
        if (simd::none(inside)) continue;
        const lanes z = lanes::load(seen.depth.data() + 16 * w + at);
        const lanes nearest = simd::gather(view.nearest, pixel, inside, nothing);
        const lanes margin = lanes(view.margin) + lanes(view.margin_growth) * (z * z);
        const auto near = [&](const lanes& depth) ORBIS_INLINE_LAMBDA { return simd::abs(depth - z) <= margin; };
        // The nearest depth usually decides, since rays do not pass through points near it.
        auto measured = inside & near(nearest);
        auto open = simd::and_not(inside, measured);
        if (simd::any(open)) {
          const lanes farthest = simd::gather(view.farthest, pixel, open, nothing);
          const auto beyond = open & (nearest - z > margin + lanes(view.slant) * (farthest - nearest));
          through |= simd::bits(beyond) << at;
          measured = measured | (open & near(farthest));
          open = simd::and_not(open, measured | beyond);
          if (simd::any(open)) measured = measured | (open & near(simd::gather(view.middle, pixel, open, nothing)));
        }
        supported |= simd::bits(measured) << at;
      }
      verdict.through[w] = static_cast<std::uint16_t>(through);
      verdict.supported[w] = static_cast<std::uint16_t>(supported);
    }
  }
};

/// Increments the counters of the points selected by the bits in `words`, up to the maximum value, or decrements them.
/// @pre to decrement, no selected counter is zero
template <bool Add>
struct count_points {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::array<std::uint16_t, block_verdict::words>& words,
                                      std::uint16_t* counters) {
    using lanes = simd::vec<std::uint16_t, 16, Target>;
    for (std::size_t w = 0; w != block_verdict::words; ++w) {
      const lanes one = select(lanes::mask_type::from_bits(words[w]), lanes(1), lanes(0));
      const lanes before = lanes::load(counters + 16 * w);
      if constexpr (Add)
        simd::add_saturated(before, one).store(counters + 16 * w);
      else
        (before - one).store(counters + 16 * w);
    }
  }
};

/// The loops, compiled for the best available instruction set.
template <class = void>
struct basic_ray_kernels {
  void (*locate)(const ray_view&, const block_axes&, seen_block&) =
      simd::kernel<locate_in_pinhole, void(const ray_view&, const block_axes&, seen_block&)>();
  void (*judge)(const ray_view&, const seen_block&, block_verdict&) =
      simd::kernel<judge_by_windows, void(const ray_view&, const seen_block&, block_verdict&)>();
  void (*count)(const std::array<std::uint16_t, block_verdict::words>&, std::uint16_t*) =
      simd::kernel<count_points<true>, void(const std::array<std::uint16_t, block_verdict::words>&, std::uint16_t*)>();
  void (*take_back)(const std::array<std::uint16_t, block_verdict::words>&, std::uint16_t*) =
      simd::kernel<count_points<false>, void(const std::array<std::uint16_t, block_verdict::words>&, std::uint16_t*)>();
};
using ray_kernels = basic_ray_kernels<>;

}  // namespace orbis::cloud::detail
