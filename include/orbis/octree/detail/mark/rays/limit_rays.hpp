// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays to points, limited to a maximum range, computed in batches.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Limits the ray from `origin` to a point at `distance` metres to `limit` metres. @pre distance > limit >= 0
[[nodiscard]] inline float3 cut_off(const float3& origin, const float3& ray, double distance, double limit) noexcept {
  const auto scale = static_cast<float>(distance), range = static_cast<float>(limit);
  float3 end;
  for (std::size_t i = 0; i != 3; ++i) end[i] = origin[i] + rounded_product(ray[i] / scale, range);
  return end;
}

/// A batch of rays: their ends, and the offsets of the ends' voxels from the origin's voxel along each axis.
struct ray_batch {
  static constexpr std::size_t capacity = point_batch::capacity;
  static constexpr std::size_t lanes = 8;
  using bits = std::array<std::uint64_t, capacity / 64>;

  alignas(64) std::array<std::array<float, capacity>, 3> end{};
  alignas(64) std::array<std::array<std::int32_t, capacity>, 3> way{};
  bits hit{};  ///< bit i: ray i ends at a point
  bits cut{};  ///< bit i: ray i is limited; if bit i is set in neither mask, there is no ray i

  void set(std::size_t i, const float3& to, const std::array<std::int32_t, 3>& cells, bool is_hit) noexcept {
    for (std::size_t axis = 0; axis != 3; ++axis) {
      end[axis][i] = to[axis];
      way[axis][i] = cells[axis];
    }
    (is_hit ? hit : cut)[i >> 6U] |= std::uint64_t{1} << (i & 63U);
  }
  void clear() noexcept { hit = cut = {}; }
  /// Removes all rays except those in `left`.
  void keep(const bits& left) noexcept {
    for (std::size_t w = 0; w != left.size(); ++w) {
      hit[w] &= left[w];
      cut[w] &= left[w];
    }
  }
  /// Returns eight bits of `b`, starting at bit i. @pre i is a multiple of eight
  [[nodiscard]] static std::uint32_t eight(const bits& b, std::size_t i) noexcept {
    return static_cast<std::uint32_t>(b[i >> 6U] >> (i & 63U)) & 0xffU;
  }
  [[nodiscard]] static std::size_t count(const bits& b) noexcept {
    std::size_t n = 0;
    for (const std::uint64_t word : b) n += static_cast<std::size_t>(std::popcount(word));
    return n;
  }
};

/// One vector of consecutive rays of a batch, starting at ray `i`. @pre i is a multiple of the vector size
template <simd::target Target>
struct ray_lanes {
  using floats = simd::native_vec<float, Target>;
  using integers = simd::native_vec<std::int32_t, Target>;
  using mask = typename floats::mask_type;
  std::array<floats, 3> ray;  ///< from the origin to the end
  mask leaves;                ///< rays that end outside the origin's voxel; the other rays visit no voxel

  ORBIS_ALWAYS_INLINE ray_lanes(const ray_batch& rays, const float3& origin, std::size_t i) noexcept {
    for (std::size_t axis = 0; axis != 3; ++axis)
      ray[axis] = floats::load(rays.end[axis].data() + i) - floats(origin[axis]);
    const auto way = [&](std::size_t axis) ORBIS_INLINE_LAMBDA { return integers::load(rays.way[axis].data() + i); };
    const std::uint64_t there = (rays.hit[i >> 6U] | rays.cut[i >> 6U]) >> (i & 63U);
    leaves = mask::from_bits(there & ((std::uint64_t{1} << floats::count) - 1)) &
             simd::mask_as<4>((way(0) | way(1) | way(2)) != integers(0));
  }
  /// Components of the rays along axis `a`, up to rounding.
  [[nodiscard]] ORBIS_ALWAYS_INLINE floats along(const float3& a) const noexcept {
    return simd::approximate_multiply_add(floats(a[0]), ray[0],
                                          simd::approximate_multiply_add(floats(a[1]), ray[1], floats(a[2]) * ray[2]));
  }
};

/// The grid, and the origin of the rays.
struct ray_frame {
  const voxel_grid& grid;
  float3 origin;
  voxel_key from;  ///< voxel of the origin, to which offsets of voxels are relative
};

struct limit_rays_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const ray_frame& f, const point_batch& points, double max_range,
                                      std::size_t count, ray_batch& rays) noexcept {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    constexpr std::size_t n = floats::count;
    using doubles = simd::vec<double, n, Target>;
    using mask = typename floats::mask_type;
    rays.clear();
    const std::array<const float*, 3> at{points.x.data(), points.y.data(), points.z.data()};
    const std::array<std::uint32_t, 3> from{f.from.x, f.from.y, f.from.z};
    const double per_metre = 1.0 / f.grid.resolution(), half = 0.5 * f.grid.cells();
    const auto per_metre_f = static_cast<float>(per_metre), half_f = static_cast<float>(half);
    const doubles limit(max_range);
    constexpr double less = 1.0 - 0x1p-50;  // less than 1 by more than the rounding errors of a square and a root
    for (std::size_t i = 0; i < count; i += n) {
      const auto along = [&](std::size_t axis)
                             ORBIS_INLINE_LAMBDA { return floats::load(at[axis] + i) - floats(f.origin[axis]); };
      const std::array<floats, 3> ray{along(0), along(1), along(2)};
      const floats square = ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2];
      mask inside = mask::first(count - i), is_cut = mask::first(0);
      mask is_hit = simd::mask_as<4>((simd::convert<double>(square) <= limit * limit * less) & (limit >= 0.0));
      std::array<floats, 3> end{floats::load(at[0] + i), floats::load(at[1] + i), floats::load(at[2] + i)};
      if (any(and_not(inside, is_hit))) {
        const doubles distance = sqrt(simd::convert<double>(square));
        is_hit = simd::mask_as<4>(distance <= limit);
        const floats scale = simd::convert<float>(distance), range = simd::convert<float>(limit);
        for (std::size_t axis = 0; axis != 3; ++axis)
          end[axis] = select(is_hit, end[axis], f.origin[axis] + ray[axis] / scale * range);
        is_cut = and_not(simd::mask_as<4>(limit >= 0.0) & (scale <= floats(std::numeric_limits<float>::max())), is_hit);
      }
      mask sure = inside;
      std::array<integers, 3> cell;
      for (std::size_t axis = 0; axis != 3; ++axis) cell[axis] = likely_keys(end[axis], per_metre_f, half_f, sure);
      if (any(and_not(inside, sure)))
        for (std::size_t axis = 0; axis != 3; ++axis)
          cell[axis] = cells_along(end[axis], per_metre, half, inside) + static_cast<std::int32_t>(half);
      for (std::size_t axis = 0; axis != 3; ++axis) {
        end[axis].store(rays.end[axis].data() + i);
        (cell[axis] - static_cast<std::int32_t>(from[axis])).store(rays.way[axis].data() + i);
      }
      rays.hit[i >> 6U] |= std::uint64_t{simd::bits(inside & is_hit)} << (i & 63U);
      rays.cut[i >> 6U] |= std::uint64_t{simd::bits(inside & is_cut)} << (i & 63U);
    }
  }
};

/// Finds those hits of a batch whose voxel differs from that of the previous ray; neighbouring points are mostly in the
/// same voxel.
struct fresh_hits_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const ray_batch& rays, std::size_t count, ray_batch::bits& fresh) noexcept {
    using integers = simd::native_vec<std::int32_t, Target>;
    constexpr std::size_t n = integers::count;
    fresh = {};
    for (std::size_t i = 0; i < count; i += n) {
      const auto differs = [&](std::size_t axis) ORBIS_INLINE_LAMBDA {
        const std::int32_t* const way = rays.way[axis].data() + i;
        return integers::load(way) ^ integers::load(way - 1);
      };
      std::uint64_t changed = (std::uint64_t{1} << n) - 1;  // the first rays have no predecessor
      if (i != 0) changed = simd::bits((differs(0) | differs(1) | differs(2)) != integers(0));
      fresh[i >> 6U] |= changed << (i & 63U);
    }
    // A hit that follows a ray without a hit counts as well.
    std::uint64_t before = 0;
    for (std::size_t w = 0; w != fresh.size(); ++w) {
      const std::uint64_t follows = rays.hit[w] << 1U | before;
      before = rays.hit[w] >> 63U;
      fresh[w] = rays.hit[w] & (fresh[w] | ~follows);
    }
  }
};

using fresh_kernel = void(const ray_batch&, std::size_t, ray_batch::bits&);
template <class = void>
[[nodiscard]] inline fresh_kernel* find_fresh_hits() noexcept {
  return simd::kernel<fresh_hits_kernel, fresh_kernel>();
}

using limit_kernel = void(const ray_frame&, const point_batch&, double, std::size_t, ray_batch&);

/// Computes the rays to `count` points, limited to a length in metres. There is no ray to an end outside the grid.
/// @pre points are readable up to the next multiple of 16; the limit is not negative
template <class = void>
[[nodiscard]] inline limit_kernel* limit_rays() noexcept {
  return simd::kernel<limit_rays_kernel, limit_kernel>();
}

}  // namespace orbis::octree::detail
