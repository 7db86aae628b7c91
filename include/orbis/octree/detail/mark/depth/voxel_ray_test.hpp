// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Classification of the rays of a depth image with respect to a voxel: a ray certainly crosses it, certainly does not
/// cross it, or is undecided.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_image.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/node_classifier.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Returns true if traverse_ray visits `voxel` on its way to `end`.
[[nodiscard]] inline bool crosses(const depth_sensor& sensor, const ray_endpoint& end,
                                  const voxel_key& voxel) noexcept {
  const voxel_key& from = *sensor.key;
  if (from == end.key) return false;
  if (voxel == from) return true;
  auto cursor = ray_traversal::between(sensor.grid, from, sensor.pose.centre, end.point);
  if (!cursor) return false;
  const std::array<std::uint32_t, 3> wanted{voxel.x, voxel.y, voxel.z};
  for (;;) {
    const std::size_t axis = cursor->axis();
    if (cursor->at[axis] == wanted[axis] || !cursor->can_step(axis)) return false;  // a ray never turns back
    cursor->advance(axis);
    if (cursor->key() == end.key) return false;
    if (std::min(std::min(cursor->next[0], cursor->next[1]), cursor->next[2]) > cursor->reach) return false;
    if (cursor->key() == voxel) return true;
  }
}

/// A voxel prepared for tests against rays.
///
/// A line in direction g crosses a cube with centre c and half edge h if no cross product of g and an edge is a
/// separating axis: |c x g|_i <= h (|g_j| + |g_k|) for all i (S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree", SIGGRAPH
/// 1996). A ray that ends at z g has left the cube if that point is beyond a far face, and has not reached it if the
/// point is before a near face. No division is needed.
///
/// Directions have a relative error of at most margin / |c| (see depth_scene). `slack` covers this error; in addition,
/// the tests change h by twice the margin. The axes are flipped so that c has no negative coordinate.
struct voxel_test {
  float3 centre{}, x_axis{}, y_axis{}, z_axis{};  ///< relative to the camera's centre; flipped
  float half = 0, inner_half = 0, outer_half = 0, slack = 0, margin = 0, margin_1 = 0;
  float3 before{};  ///< how far before the centre, along each axis, a ray that crosses the voxel can end

  voxel_test(const depth_scene& s, const float3& c, float half_edge) noexcept
      : half{half_edge}, margin{s.margin(std::fabs(c[0]) + std::fabs(c[1]) + std::fabs(c[2]))}, margin_1{s.margin_1} {
    float l1 = 0;
    for (std::size_t i = 0; i != 3; ++i) {
      centre[i] = std::fabs(c[i]);
      x_axis[i] = std::copysign(1.0F, c[i]) * s.x_axis[i];
      y_axis[i] = std::copysign(1.0F, c[i]) * s.y_axis[i];
      z_axis[i] = std::copysign(1.0F, c[i]) * s.z_axis[i];
      // There is no near face if the voxel is in the camera's slab along this axis.
      before[i] = centre[i] < half + 2.0F * margin ? std::numeric_limits<float>::infinity() : half;
      l1 += centre[i];
    }
    inner_half = half - 2.0F * margin;
    outer_half = half + 2.0F * margin;
    slack = 4.0F * half * margin / std::max(l1, half);
  }

  /// Returns true if a ray of a tile of directions may cross the voxel.
  [[nodiscard]] bool may_cross(float x0, float x1, float y0, float y1) const noexcept {
    const float x = 0.5F * (x0 + x1), y = 0.5F * (y0 + y1), dx = 0.501F * (x1 - x0), dy = 0.501F * (y1 - y0);
    float3 g, e;
    for (std::size_t i = 0; i != 3; ++i) {
      g[i] = x_axis[i] * x + (y_axis[i] * y + z_axis[i]);
      e[i] = std::fabs(x_axis[i]) * dx + std::fabs(y_axis[i]) * dy;
    }
    const float length = std::fabs(g[0]) + std::fabs(g[1]) + std::fabs(g[2]) + e[0] + e[1] + e[2];
    bool may = true;
    for (std::size_t i = 0; i != 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const float off = std::fabs(centre[j] * g[k] - centre[k] * g[j]) - (centre[j] * e[k] + centre[k] * e[j]);
      const float width = std::fabs(g[j]) + e[j] + std::fabs(g[k]) + e[k];
      may = may && off <= width * outer_half + slack * length;
    }
    return may;
  }
};

/// Terms that decide the crossing of a ray and a cube, see voxel_test; for several rays, several cubes, or both.
template <class V>
struct ray_and_cube {
  std::array<V, 3> direction;  ///< direction g of the ray
  std::array<V, 3> size;       ///< absolute value of g along each axis
  V length;                    ///< sum of the sizes

  ORBIS_ALWAYS_INLINE ray_and_cube(const float3& x_axis, const float3& y_axis, const float3& z_axis, const V& x,
                                   const V& y) noexcept {
    for (std::size_t i = 0; i != 3; ++i) {
      direction[i] = multiply_add(x_axis[i], x, multiply_add(y_axis[i], y, z_axis[i]));
      size[i] = abs(direction[i]);
    }
    length = size[0] + size[1] + size[2];
  }
  /// |centre x direction| along axis `i`.
  [[nodiscard]] ORBIS_ALWAYS_INLINE V off(std::size_t i, const std::array<V, 3>& centre) const noexcept {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    return abs(multiply_add(centre[j], direction[k], -(centre[k] * direction[j])));
  }
  /// Size across axis `i`.
  [[nodiscard]] ORBIS_ALWAYS_INLINE V width(std::size_t i) const noexcept {
    return size[(i + 1) % 3] + size[(i + 2) % 3];
  }
};

/// Masks of the rays that may cross a voxel, and of those that certainly do.
template <class V>
struct voxel_crossing {
  typename V::mask_type may, sure;
};

/// Tests the rays in the mask `of`, which pass through (x, y, 1) and end at depth `z` > 0, against a voxel. Correct on
/// every target; targets may differ in the rays that stay undecided.
template <class V>
[[nodiscard]] ORBIS_ALWAYS_INLINE voxel_crossing<V> test_rays(const voxel_test& t, const V& x, const V& y, const V& z,
                                                              const typename V::mask_type& of) noexcept {
  voxel_crossing<V> out{of, V::mask_type::first(0)};
  auto& may = out.may;
  const std::array<V, 3> centre{V(t.centre[0]), V(t.centre[1]), V(t.centre[2])};
  const ray_and_cube<V> ray{t.x_axis, t.y_axis, t.z_axis, x, y};
  const V loose = t.slack * ray.length;
  const std::array<V, 3> off{ray.off(0, centre), ray.off(1, centre), ray.off(2, centre)};
  for (std::size_t i = 0; i != 3; ++i) may = may & (off[i] <= multiply_add(t.outer_half, ray.width(i), loose));
  if (none(may)) return out;
  const V close = multiply_add(t.margin_1, z * ray.length, t.margin);
  V beyond(0.0F);
  for (std::size_t i = 0; i != 3; ++i) {
    const V d = multiply_add(z, ray.direction[i], -centre[i]);
    may = may & (d + close + t.before[i] >= 0.0F);
    beyond = max(beyond, abs(d));
  }
  may = may & (beyond >= t.half - close);
  if (none(may)) return out;
  out.sure = may & (beyond > t.half + close);
  for (std::size_t i = 0; i != 3; ++i)
    out.sure = out.sure & (off[i] < multiply_add(t.inner_half, ray.width(i), -loose));
  return out;
}

/// Returns true if a ray of the box certainly crosses the voxel. Otherwise appends to `unsure` the indices of the
/// pixels whose rays may cross it, see endpoint_image::number. Skips rays that end before `near_z`.
struct test_pixels_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool run(const endpoint_image& ends, const voxel_test& t, const pixel_box& box,
                                      float near_z, std::vector<std::uint32_t>& unsure) {
    using floats = simd::native_vec<float, Target>;
    constexpr auto n = static_cast<std::int32_t>(floats::count);
    const float least_z = std::max(near_z, std::numeric_limits<float>::min());
    const pixel_rays& rays = ends.rays();
    for (std::int32_t v = box.v0; v <= box.v1; ++v) {
      const float* const row_z = ends.z(v);
      const float* const row_x = rays.x(v);
      const float* const row_y = rays.y(v);
      for (std::int32_t u = box.u0; u <= box.u1; u += n) {
        const floats z = floats::load(row_z + u);
        const auto reaches = z >= least_z;
        if (none(reaches)) continue;
        const floats y = rays.separable() ? floats(*row_y) : floats::load(row_y + u);
        const auto [may, sure] = test_rays(t, floats::load(row_x + u), y, z, reaches);
        if (none(may)) continue;
        if (any(sure)) return true;
        for (std::uint64_t left = simd::bits(may); left != 0; left &= left - 1)
          unsure.push_back(ends.number(u + std::countr_zero(left), v));
      }
    }
    return false;
  }
};

/// Positions in a voxel's projection at which rays are sampled, and their distance from the centre in voxel edges.
inline constexpr std::array<std::array<float, 2>, 5> sample_places{{{0, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
inline constexpr float sample_spread = 0.3F;

/// For each child, the deepest of a few pixels close to its centre. z < 0: the child was not requested
template <class Floats, class Integers>
struct sampled_pixels {
  Floats z{-1.0F};
  Integers u{0}, v{0};

  /// `depth_at(u, v)`: depths of pixels.
  template <class Depth>
  ORBIS_ALWAYS_INLINE sampled_pixels(const depth_scene& s, const children& c, unsigned wanted,
                                     const Depth& depth_at) noexcept {
    using mask = typename Floats::mask_type;
    const mask asked = mask::from_bits(wanted), projects = Floats::load(c.near_z.data()) > s.near_z;
    const mask at_middle = s.map != nullptr ? mask::first(8) : !projects;  // middle of pixels that may see the child
    const Floats per_z = select(projects, 1.0F / Floats::load(c.z.data()), Floats(0.0F));
    const Integers u0 = Integers::load(c.u0.data()), u1 = Integers::load(c.u1.data());
    const Integers v0 = Integers::load(c.v0.data()), v1 = Integers::load(c.v1.data());
    const auto middle = [&](const float* p, float f, float centre, const Integers& first, const Integers& last)
                            ORBIS_INLINE_LAMBDA {
                              const Floats at = multiply_add(f, Floats::load(p) * per_z, centre);
                              return select(at_middle, 0.5F * simd::convert<float>(first + last), at);
                            };
    const auto nearest = [&](const Floats& at, const Integers& first, const Integers& last) ORBIS_INLINE_LAMBDA {
      return select(asked, min(max(simd::convert<std::int32_t>(at + 0.5F), first), last), Integers(0));
    };
    const Floats mid_u = middle(c.x.data(), s.fx, s.cx, u0, u1), mid_v = middle(c.y.data(), s.fy, s.cy, v0, v1);
    const Floats spread = s.voxel * sample_spread * per_z, spread_u = spread * s.fx, spread_v = spread * s.fy;
    for (const auto& [du, dv] : sample_places) {
      const Integers at_u = nearest(multiply_add(du, spread_u, mid_u), u0, u1);
      const Integers at_v = nearest(multiply_add(dv, spread_v, mid_v), v0, v1);
      const Floats at_z = depth_at(at_u, at_v);
      const mask deeper = at_z > z;
      z = select(deeper, at_z, z);
      u = select(deeper, at_u, u);
      v = select(deeper, at_v, v);
    }
  }
};

/// Returns the children that are certainly crossed by their rays: each child has a ray through (x, y, 1) to depth `z`,
/// or none if z <= 0. `world`: the parent's centre relative to the camera's.
template <class Floats>
[[nodiscard]] ORBIS_ALWAYS_INLINE auto children_crossed(const depth_scene& s, const child_offsets& o,
                                                        const float3& world, const Floats& x, const Floats& y,
                                                        const Floats& z) noexcept {
  const std::array<Floats, 3> centre{world[0] + Floats::load(o.world_x.data()),
                                     world[1] + Floats::load(o.world_y.data()),
                                     world[2] + Floats::load(o.world_z.data())};
  const ray_and_cube<Floats> ray{s.x_axis, s.y_axis, s.z_axis, x, y};
  const Floats l1 = abs(centre[0]) + abs(centre[1]) + abs(centre[2]);
  const Floats margin = multiply_add(s.margin_1, l1, s.margin_0), twice = margin + margin;
  const Floats loose = 4.0F * o.half * margin / max(l1, Floats(o.half)) * ray.length, inner = o.half - twice;
  const Floats close = multiply_add(s.margin_1, z * ray.length, margin), room = o.half + close;
  auto sure = z > 0.0F;
  Floats beyond(0.0F);
  for (std::size_t i = 0; i != 3; ++i) {
    const Floats d = multiply_add(z, ray.direction[i], -centre[i]);
    const Floats forward = select(centre[i] < 0.0F, -d, d);  // away from the camera
    sure = sure & (ray.off(i, centre) < multiply_add(inner, ray.width(i), -loose)) &
           ((forward + room >= 0.0F) | (abs(centre[i]) < o.half + twice));
    beyond = max(beyond, abs(d));
  }
  return sure & (beyond > room);
}

/// Finds the children that are certainly crossed by the deepest of a few rays close to their centres. `world`: the
/// parent's centre relative to the camera's.
struct sample_children_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE unsigned run(const depth_scene& s, const endpoint_image& ends, const child_offsets& o,
                                          const float3& world, const children& c, unsigned wanted) noexcept {
    using floats = simd::vec<float, 8, Target>;
    using integers = simd::vec<std::int32_t, 8, Target>;
    const integers row_size(static_cast<std::int32_t>(ends.stride()));
    const sampled_pixels<floats, integers> at{s, c, wanted,
                                              [&](const integers& u, const integers& v) ORBIS_INLINE_LAMBDA {
                                                return simd::gather(ends.z(0), v * row_size + u);
                                              }};
    const pixel_rays& rays = ends.rays();
    floats x, y;
    if (rays.separable()) {
      x = (simd::convert<float>(at.u) - s.cx) * s.per_fx;
      y = (simd::convert<float>(at.v) - s.cy) * s.per_fy;
    } else {
      const integers i = at.v * integers(static_cast<std::int32_t>(rays.x(1) - rays.x(0))) + at.u;
      x = simd::gather(rays.x(0), i);
      y = simd::gather(rays.y(0), i);
    }
    return simd::bits(children_crossed(s, o, world, x, y, at.z)) & wanted;
  }
};

}  // namespace orbis::octree::detail
