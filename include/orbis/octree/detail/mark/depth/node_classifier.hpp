// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Certified classification of octree nodes against a depth image: no ray can touch the node, rays certainly cross
/// every voxel in it, or undecided.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/mark/depth/direction_index.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Parameters of the node tests for a frame. Positions are relative to the camera's centre.
///
/// The relevant rays are those from the centre to the world points, rounded to float; the tests use the rays of the
/// pixels and rounded node centres. With u = 2^-24 and c a node's centre:
/// - the sum that yields a world point p has an error of at most 10 u |p - t|_1 + u |t|_1 (t: the camera's centre);
///   at the node, the first part becomes 10 u |c|_1, because the deviation of a ray is proportional to the distance;
/// - rotating c with the rotation rounded to float has an error of 7 u |c|_1, in addition to the 2 u |c|_1 of c itself,
///   and each step down the octree adds u |c|_1: less than 25 u |c|_1 from a root of 16 levels;
/// - the direction of the traversal is a float vector: u |c|_1; the error of the sums in double is negligible;
/// - the ray of a pinhole's pixel may be computed as (pixel - c) / f in float: 5 u |c|_1.
/// The total is less than 45 u |c|_1 + 2 u |t|_1: `margin` is 64 u |c|_1 + 8 u |t|_1.
struct depth_scene {
  float3 x_axis{}, y_axis{}, z_axis{};               ///< axes of the camera, in the world frame
  float fx = 1, fy = 1, cx = 0, cy = 0;              ///< pixel = f * ray + c
  float per_fx = 1, per_fy = 1;                      ///< 1 / f
  float last_u = 0, last_v = 0;                      ///< last column and row
  float min_x = 0, max_x = 0, min_y = 0, max_y = 0;  ///< bounds of all rays
  float margin_0 = 0, margin_1 = 0;                  ///< `margin`: constant part in metres; part per metre of |c|_1
  float pixel_margin = 0.01F;                        ///< allowance for the rounding of pixel coordinates
  float near_z = 0;                                  ///< nodes that reach below this depth are not projected
  /// Maximum depth up to which the ray of at least one pixel certainly passes through a ball inside a voxel; elements 1
  /// and 2: the same for the rays of aligned tiles of 2x2 and 4x4 pixels. For pinholes; see dense().
  std::array<float, 3> dense_z{};
  float ball = 0, ball_slope = 0;        ///< the ball's radius exceeds `ball - ball_slope * z`
  float voxel = 0;                       ///< metres
  const direction_index* map = nullptr;  ///< for cameras other than pinholes
  const depth_pyramid* pyramid = nullptr;
  /// For tiles of 1, 2x2 and 4x4 pixels that contain the ray nearest to a direction: maximum distance of the tile's
  /// rays from the direction, in multiples of the ray spacing (at z = 1).
  std::array<float, 3> tiles{1.02F, 3.06F, 7.14F};

  /// Returns dense_z for the given ray spacing.
  [[nodiscard]] float dense(std::size_t kind, float spacing) const noexcept {
    return ball / (tiles[kind] * spacing + ball_slope);
  }
  [[nodiscard]] float margin(float l1) const noexcept { return margin_0 + margin_1 * l1; }
};

/// A box of pixels, including its last row and column.
struct pixel_box {
  std::int32_t u0, u1, v0, v1;
};

/// Offsets of a node's children from its centre.
struct child_offsets {
  alignas(32) std::array<float, 8> x{}, y{}, z{};                    ///< in the camera frame
  alignas(32) std::array<float, 8> world_x{}, world_y{}, world_z{};  ///< in the world frame
  float half = 0;                                                    ///< half a child's edge
  float half_z = 0;                                                  ///< half of a child's extent along z
  std::array<float, 4> half_side{};  ///< half of a child's extent perpendicular to each side of the view, unscaled

  child_offsets() = default;
  child_offsets(const depth_scene& s, float half_edge) : half{half_edge} {
    for (unsigned i = 0; i != 8; ++i) {
      const float wx = (i & 1U) != 0 ? half : -half, wy = (i & 2U) != 0 ? half : -half;
      const float wz = (i & 4U) != 0 ? half : -half;
      world_x[i] = wx;
      world_y[i] = wy;
      world_z[i] = wz;
      const auto along = [&](const float3& a) { return a[0] * wx + a[1] * wy + a[2] * wz; };
      x[i] = along(s.x_axis);
      y[i] = along(s.y_axis);
      z[i] = along(s.z_axis);
    }
    const auto reach = [&](const float3& a, float slope) {
      float sum = 0;
      for (std::size_t j = 0; j != 3; ++j) sum += std::fabs(a[j] - slope * s.z_axis[j]);
      return half * sum;
    };
    half_z = half * (std::fabs(s.z_axis[0]) + std::fabs(s.z_axis[1]) + std::fabs(s.z_axis[2]));
    half_side = {reach(s.x_axis, s.min_x), reach(s.x_axis, s.max_x), reach(s.y_axis, s.min_y),
                 reach(s.y_axis, s.max_y)};
  }
};

/// Classification of a node's eight children.
struct children {
  alignas(32) std::array<float, 8> x, y, z;                ///< centres in the camera frame
  alignas(32) std::array<std::int32_t, 8> u0, u1, v0, v1;  ///< pixels whose rays may touch the child
  alignas(32) std::array<float, 8> near_z;                 ///< rays that end before this depth do not touch the child
  unsigned live = 0;                                       ///< bit i: a ray may touch child i
  unsigned full = 0;    ///< bit i: every voxel of child i is certainly crossed by a ray
  unsigned inside = 0;  ///< bit i: child i projects into the image
};

/// a * b + c for bounds, see simd::approximate_multiply_add.
template <class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE V multiply_add(const std::type_identity_t<V>& a, const V& b,
                                                 const std::type_identity_t<V>& c) noexcept {
  return simd::approximate_multiply_add(a, b, c);
}

/// Classifies the children of the node whose centre is `c` in the camera frame. `inside`: the node projects into the
/// image. The result is correct on every target; targets may differ in the children that stay undecided.
struct classify_children_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const depth_scene& s, const child_offsets& o, const float3& c, bool inside,
                                      children& out) noexcept {
    using floats = simd::vec<float, 8, Target>;
    using integers = simd::vec<std::int32_t, 8, Target>;
    using mask = typename floats::mask_type;
    const floats x = c[0] + floats::load(o.x.data()), y = c[1] + floats::load(o.y.data());
    const floats z = c[2] + floats::load(o.z.data());
    x.store(out.x.data());
    y.store(out.y.data());
    z.store(out.z.data());
    const floats margin = multiply_add(s.margin_1, abs(x) + abs(y) + abs(z), s.margin_0);
    const floats reach = o.half_z + margin, near = z - reach, far = z + reach;
    near.store(out.near_z.data());
    mask live = far > 0.0F;
    if (!inside) {
      // Test against the four sides of the view; `off` is positive towards larger slopes.
      const auto side = [&](const floats& at, float sign, float slope, float half) ORBIS_INLINE_LAMBDA {
        const floats room = multiply_add(1.0F + std::fabs(slope), margin, half);
        const floats off = multiply_add(-slope, z, at);
        return multiply_add(sign, off, room) >= 0.0F;
      };
      live = live & side(x, 1.0F, s.min_x, o.half_side[0]) & side(x, -1.0F, s.max_x, o.half_side[1]) &
             side(y, 1.0F, s.min_y, o.half_side[2]) & side(y, -1.0F, s.max_y, o.half_side[3]);
    }
    out.live = out.full = out.inside = 0;
    if (none(live)) return;

    // Pixels to which a child may project: the pixel of its centre, plus or minus its extent across the centre's ray.
    const mask projects = near > s.near_z;
    const floats near_1 = select(projects, near, floats(1.0F)), z_1 = select(projects, z, floats(1.0F));
    const floats inverse = 1.0F / (near_1 * z_1), per_z = inverse * near_1, per_near = inverse * z_1;
    const floats u = x * per_z, v = y * per_z;
    const auto across = [&](const float3& axis, const floats& slope) ORBIS_INLINE_LAMBDA {
      const auto part = [&](std::size_t i)
                            ORBIS_INLINE_LAMBDA { return abs(multiply_add(-s.z_axis[i], slope, floats(axis[i]))); };
      const floats slack = multiply_add(margin, abs(slope), margin);
      return multiply_add(o.half, part(0) + part(1) + part(2), slack) * per_near;
    };
    const floats wide = across(s.x_axis, u), high = across(s.y_axis, v);
    const floats du = multiply_add(s.fx, wide, s.pixel_margin), dv = multiply_add(s.fy, high, s.pixel_margin);
    const floats cu = multiply_add(s.fx, u, s.cx), cv = multiply_add(s.fy, v, s.cy);
    floats u0 = cu - du, u1 = cu + du, v0 = cv - dv, v1 = cv + dv;
    std::array<floats, 3> dense_z{floats(s.dense_z[0]), floats(s.dense_z[1]), floats(s.dense_z[2])};
    if (s.map != nullptr) {
      const integers at = entry_offset(*s.map, u - wide, u + wide, v - high, v + high);
      const float* const entries = &s.map->entries()->least_u;
      u0 += simd::gather(entries, at);
      u1 += simd::gather(entries + 1, at);
      v0 += simd::gather(entries + 2, at);
      v1 += simd::gather(entries + 3, at);
      const floats spacing = simd::gather(entries + 4, at);
      for (std::size_t kind = 0; kind != 3; ++kind)
        dense_z[kind] = s.ball / multiply_add(s.tiles[kind], spacing, s.ball_slope);
    }
    u0 = select(projects, u0, floats(0.0F));
    v0 = select(projects, v0, floats(0.0F));
    u1 = select(projects, u1, floats(s.last_u));
    v1 = select(projects, v1, floats(s.last_v));
    const mask inner = projects & (u0 >= 0.0F) & (v0 >= 0.0F) & (u1 <= s.last_u) & (v1 <= s.last_v);
    // Round up and down; the results are >= -1.
    const auto first = [](const floats& p, float last) ORBIS_INLINE_LAMBDA {
      return -simd::convert<std::int32_t>(floor(-min(max(p, floats(0.0F)), floats(last + 1.0F))));
    };
    const auto last = [](const floats& p, float end) ORBIS_INLINE_LAMBDA {
      return simd::convert<std::int32_t>(floor(max(min(p, floats(end)), floats(-1.0F))));
    };
    integers a = first(u0, s.last_u), b = last(u1, s.last_u), d = first(v0, s.last_v), e = last(v1, s.last_v);
    live = and_not(live, (a > b) | (d > e));
    if (none(live)) return;
    const integers zero(0);
    a = select(live, a, zero);
    b = select(live, b, zero);
    d = select(live, d, zero);
    e = select(live, e, zero);
    a.store(out.u0.data());
    b.store(out.u1.data());
    d.store(out.v0.data());
    e.store(out.v1.data());

    // Level at which the box spans at most four cells: the logarithm of a third of its extent, rounded up.
    const depth_pyramid& pyramid = *s.pyramid;
    const floats third = simd::convert<float>(max(b - a, e - d)) * (1.0F / 3.0F);
    const integers level = min(max(log2_rounded_up(third), integers(1)), integers(pyramid.levels()));
    const auto of_level = [&](const std::int32_t* table) ORBIS_INLINE_LAMBDA {
      if (pyramid.levels() > 8) return simd::gather(table, level);
      return simd::look_up(integers::load(table + 1), level - integers(1));
    };
    const integers width = of_level(pyramid.width().data()), family(static_cast<std::int32_t>(pyramid.family()));
    integers begin = of_level(pyramid.begin().data());
    begin += select(far < dense_z[1], family, zero);
    begin += select(far < dense_z[2], family, zero);  // this condition implies the one above
    const integers i0 = a >> level, i1 = max(i0, (b >> level) - integers(1));
    const integers j0 = d >> level, j1 = max(j0, (e >> level) - integers(1));
    const integers row0 = begin + j0 * width, row1 = begin + j1 * width;
    const auto ends_at = [&](const integers& at) ORBIS_INLINE_LAMBDA {
      return simd::bits_as<std::uint32_t>(simd::gather(reinterpret_cast<const std::int32_t*>(pyramid.data()), at));
    };
    const auto ends = max_halves(max_halves(ends_at(row0 + i0), ends_at(row0 + i1)),
                                 max_halves(ends_at(row1 + i0), ends_at(row1 + i1)));
    const auto depth_of = [](const auto& half)
                              ORBIS_INLINE_LAMBDA { return simd::convert<float>(simd::bits_as<std::int32_t>(half)); };
    const floats farthest = depth_of(ends >> 16), nearest = depth_of((ends & 0xffffU) ^ 0xffffU);
    live = live & (farthest >= near * pyramid.scale()) & (farthest > 0.0F);
    const mask filled = (nearest > far * pyramid.scale()) & (far < dense_z[0]);
    out.live = simd::bits(live);
    // With a map, the spacing of its entries decides whether rays cover a whole child.
    const bool mapped = s.map != nullptr;
    out.inside = mapped ? 0 : out.live & simd::bits(inner);
    out.full = (mapped ? out.live & simd::bits(projects) : out.inside) & simd::bits(filled);
  }

 private:
  /// Logarithm to base 2 of numbers >= 0, rounded up; a large negative number for 0.
  template <class Floats>
  static ORBIS_ALWAYS_INLINE auto log2_rounded_up(const Floats& x) noexcept {
    return ((simd::bits_as<std::int32_t>(x) + 0x7fffff) >> 23) - 127;
  }
  /// Offset, in floats, of the map's entry for the rays that pass through a rectangle at z = 1.
  template <class Floats>
  static ORBIS_ALWAYS_INLINE auto entry_offset(const direction_index& map, const Floats& x0, const Floats& x1,
                                               const Floats& y0, const Floats& y1) noexcept {
    const auto cell = [](const Floats& at, float least, float per, std::int32_t count) ORBIS_INLINE_LAMBDA {
      return simd::convert<std::int32_t>(
          min(max((at - least) * per, Floats(0.0F)), Floats(static_cast<float>(count - 1))));
    };
    const auto i0 = cell(x0, map.min_x(), map.per_x(), map.width()[0]);
    const auto i1 = cell(x1, map.min_x(), map.per_x(), map.width()[0]);
    const auto j0 = cell(y0, map.min_y(), map.per_y(), map.height()[0]);
    const auto j1 = cell(y1, map.min_y(), map.per_y(), map.height()[0]);
    using integers = std::remove_const_t<decltype(i0)>;
    const integers k =
        min(max(log2_rounded_up(simd::convert<float>(max(i1 - i0, j1 - j0))), integers(0)), integers(map.levels()));
    return ((j0 >> k) * simd::gather(map.width().data(), k) + (i0 >> k) + simd::gather(map.begin().data(), k)) << 3;
  }
};

}  // namespace orbis::octree::detail
