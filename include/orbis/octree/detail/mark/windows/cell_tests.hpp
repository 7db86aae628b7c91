// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tests of rays, sorted into cells by direction, against a voxel.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/node_classifier.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/mark/windows/binned_rays.hpp>

namespace orbis::octree::detail {

/// Like sample_children_kernel, with a cell's deepest ray as its representative.
struct sample_cells_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE unsigned run(const depth_scene& s, const window_rays& w, const child_offsets& o,
                                          const float3& world, const children& c, unsigned wanted) noexcept {
    using floats = simd::vec<float, 8, Target>;
    using integers = simd::vec<std::int32_t, 8, Target>;
    const integers stride(w.stride);
    const sampled_pixels<floats, integers> at{s, c, wanted,
                                              [&](const integers& u, const integers& v)
                                                  ORBIS_INLINE_LAMBDA { return simd::gather(w.z, v * stride + u); }};
    const integers ray = simd::gather(w.deepest, at.v * stride + at.u) << 2;
    const float* const rays = &w.rays->x;
    const floats x = simd::gather(rays, ray), y = simd::gather(rays + 1, ray);
    return simd::bits(children_crossed(s, o, world, x, y, at.z)) & wanted;
  }
};

/// Like test_pixels_kernel, for the rays of a box of cells. Appends ray indices to `unsure`.
struct test_cells_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool run(const depth_scene& s, const window_rays& w, const voxel_test& t,
                                      const pixel_box& box, float near_z, std::vector<std::uint32_t>& unsure) {
    using floats = simd::native_vec<float, Target>;
    constexpr std::size_t n = floats::count;
    const float least_z = std::max(near_z, std::numeric_limits<float>::min());
    // Tests `count` rays, starting at `from`.
    const auto is_crossed = [&](const binned_ray* from, std::size_t count) ORBIS_INLINE_LAMBDA {
      const float* const p = &from->x;
      const floats a = floats::load(p), b = floats::load(p + n), c = floats::load(p + 2 * n);
      const floats d = floats::load(p + 3 * n);
      const floats xz_low = unzip_even(a, b), xz_high = unzip_even(c, d);
      const floats z = unzip_odd(xz_low, xz_high);
      const auto reaches = (z >= least_z) & floats::mask_type::first(count);
      if (none(reaches)) return false;
      const floats x = unzip_even(xz_low, xz_high), y = unzip_even(unzip_odd(a, b), unzip_odd(c, d));
      const auto [may, sure] = test_rays(t, x, y, z, reaches);
      if (none(may)) return false;
      if (any(sure)) return true;
      for (std::uint64_t left = simd::bits(may); left != 0; left &= left - 1)
        unsure.push_back(from[std::countr_zero(left)].number);
      return false;
    };
    const auto copy = [](const binned_ray* from, binned_ray* to) ORBIS_INLINE_LAMBDA {  // copies n rays
      const float* const p = &from->x;
      float* const q = &to->x;
      const floats a = floats::load(p), b = floats::load(p + n), c = floats::load(p + 2 * n);
      const floats d = floats::load(p + 3 * n);
      a.store(q), b.store(q + n), c.store(q + 2 * n), d.store(q + 3 * n);
    };
    const tile_test cells{s, t};
    alignas(64) std::array<float, n> steps;
    for (std::size_t i = 0; i != n; ++i) steps[i] = static_cast<float>(i) * s.per_fx;
    const floats x_steps = floats::load(steps.data());
    // Rays of sparse cells are buffered until a full vector is available.
    alignas(64) std::array<binned_ray, 2 * n> some;
    std::size_t waiting = 0;
    for (std::int32_t v = box.v0; v <= box.v1; ++v) {
      const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * w.stride;
      const floats y((static_cast<float>(v) - s.cy) * s.per_fy);
      for (std::int32_t u = box.u0; u <= box.u1; u += static_cast<std::int32_t>(n)) {
        const floats z = floats::load(w.z + row + u);
        const auto wanted = (z >= least_z) & floats::mask_type::first(static_cast<std::size_t>(box.u1 + 1 - u));
        if (none(wanted)) continue;
        const floats x = x_steps + (static_cast<float>(u) - s.cx) * s.per_fx;
        std::uint64_t may = simd::bits(wanted & cells.may_cross(x, y, z));
        while (may != 0) {  // handles contiguous cells together
          const auto first = static_cast<std::ptrdiff_t>(std::countr_zero(may));
          const auto after = first + static_cast<std::ptrdiff_t>(std::countr_one(may >> first));
          may &= ~std::uint64_t{0} << (after & 63) & (after == 64 ? 0 : ~std::uint64_t{0});
          const std::uint32_t* const begin = w.begin + row + u;
          const binned_ray* from = w.sorted + begin[first];
          std::size_t left = begin[after] - begin[first];
          for (; left >= n; left -= n, from += n)
            if (is_crossed(from, n)) return true;
          copy(from, some.data() + waiting);
          waiting += left;
          if (waiting < n) continue;
          if (is_crossed(some.data(), n)) return true;
          waiting -= n;
          copy(some.data() + n, some.data());
        }
      }
    }
    return waiting != 0 && is_crossed(some.data(), waiting);
  }

 private:
  /// Finds the cells that may contain rays that cross the voxel, see voxel_test::may_cross and test_rays. (x, y):
  /// centre of a cell, z: depth of its deepest ray.
  struct tile_test {
    const voxel_test& t;
    float3 spread{}, reach{}, width{};
    float length = 0;

    tile_test(const depth_scene& s, const voxel_test& test) noexcept : t{test} {
      const float half = s.pixel_margin;  // half the edge of a cell, in cells, with an allowance for rounding
      for (std::size_t i = 0; i != 3; ++i)
        spread[i] = half * (std::fabs(t.x_axis[i]) * s.per_fx + std::fabs(t.y_axis[i]) * s.per_fy);
      length = spread[0] + spread[1] + spread[2];
      for (std::size_t i = 0; i != 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        width[i] = (spread[j] + spread[k]) * t.outer_half + t.slack * length +
                   (t.centre[j] * spread[k] + t.centre[k] * spread[j]) * 1.001F;
      }
    }
    template <class V>
    [[nodiscard]] ORBIS_ALWAYS_INLINE typename V::mask_type may_cross(const V& x, const V& y,
                                                                      const V& z) const noexcept {
      const ray_and_cube<V> ray{t.x_axis, t.y_axis, t.z_axis, x, y};
      const std::array<V, 3> centre{V(t.centre[0]), V(t.centre[1]), V(t.centre[2])};
      const V loose = t.slack * ray.length;
      const V close = multiply_add(t.margin_1, z * (ray.length + length), t.margin);
      auto may = V::mask_type::first(V::count);
      for (std::size_t i = 0; i != 3; ++i) {
        may = may & (ray.off(i, centre) <= multiply_add(t.outer_half, ray.width(i), loose + width[i]));
        // At least one ray must not end before the voxel.
        may = may & (multiply_add(z, ray.direction[i] + spread[i], close - centre[i]) + t.before[i] >= 0.0F);
      }
      return may;
    }
  };
};

}  // namespace orbis::octree::detail
