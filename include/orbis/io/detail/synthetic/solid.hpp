// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The solids of a synthetic room, and their intersections with rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <orbis/io/detail/synthetic/arithmetic.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// Appearance of a surface.
enum class material : std::uint8_t { plain, wallpaper, brick, tile, wood, fabric, books, clutter };

enum class shape : std::uint8_t {
  box,       ///< half sizes along its own axes
  sphere,    ///< half.x is the radius
  cylinder,  ///< upright; half.x is the radius, half.z half the height
  capsule,   ///< a cylinder with hemispherical ends, which are part of the half height half.z; may be tilted
  room       ///< a box seen from inside: everything outside the box is solid
};

/// A solid, optionally rotated about the vertical axis; a capsule is first tilted about its own y axis. Each solid has
/// six faces, two for each of its own axes (2 * axis, plus one for the positive side); a point of a round solid belongs
/// to the face of its largest coordinate.
struct solid {
  shape kind = shape::box;
  triple centre;  ///< metres, world
  triple half;    ///< half sizes, metres
  double cos_yaw = 1.0, sin_yaw = 0.0;
  double cos_tilt = 1.0, sin_tilt = 0.0;  ///< tilt of a capsule: moves its upper end towards its own x axis
  material surface = material::plain;
  std::uint64_t seed = 0;  ///< seed of the texture

  [[nodiscard]] triple to_local_direction(triple d) const noexcept {
    const triple turned{cos_yaw * d.x + sin_yaw * d.y, cos_yaw * d.y - sin_yaw * d.x, d.z};
    if (kind != shape::capsule) return turned;
    return {cos_tilt * turned.x - sin_tilt * turned.z, turned.y, sin_tilt * turned.x + cos_tilt * turned.z};
  }
  [[nodiscard]] triple to_local(triple p) const noexcept { return to_local_direction(p - centre); }
  [[nodiscard]] triple to_world_direction(triple d) const noexcept {
    if (kind == shape::capsule) d = {cos_tilt * d.x + sin_tilt * d.z, d.y, cos_tilt * d.z - sin_tilt * d.x};
    return {cos_yaw * d.x - sin_yaw * d.y, sin_yaw * d.x + cos_yaw * d.y, d.z};
  }
  /// Half sizes of the axis-aligned bounding box in the world frame.
  [[nodiscard]] triple bounds() const noexcept {
    if (kind == shape::sphere || kind == shape::cylinder)
      return {half.x, half.x, kind == shape::sphere ? half.x : half.z};
    if (kind == shape::capsule) {
      const double core = half.z - half.x;  // half the length of the axis
      return {half.x + core * std::abs(sin_tilt * cos_yaw), half.x + core * std::abs(sin_tilt * sin_yaw),
              half.x + core * std::abs(cos_tilt)};
    }
    const double c = std::abs(cos_yaw), s = std::abs(sin_yaw);
    return {c * half.x + s * half.y, s * half.x + c * half.y, half.z};
  }

  /// The distance (metres) from a point to the surface, negative inside the solid.
  [[nodiscard]] double signed_distance(triple p_world) const noexcept {
    const triple p = to_local(p_world);
    switch (kind) {
      case shape::sphere: return length(p) - half.x;
      case shape::cylinder:
        return rounded_off({std::sqrt(p.x * p.x + p.y * p.y) - half.x, std::abs(p.z) - half.z, -1e30});
      case shape::capsule: return length(from_axis(p)) - half.x;
      case shape::box: break;
      case shape::room: break;
    }
    const double d = rounded_off({std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z});
    return kind == shape::room ? -d : d;
  }

  /// Vector from the nearest point on a capsule's axis to `p`, in the capsule's frame.
  [[nodiscard]] triple from_axis(triple p) const noexcept {
    const double core = half.z - half.x;
    return {p.x, p.y, p.z - std::clamp(p.z, -core, core)};
  }

 private:
  /// The distance to a box, given the distances `q` to its faces.
  [[nodiscard]] static double rounded_off(triple q) noexcept {
    const triple outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
  }
};

/// First intersection of a ray with a solid.
struct hit {
  double t = std::numeric_limits<double>::infinity();  ///< distance in multiples of the ray's direction vector
  int axis = 0;                                        ///< axis of the face; for cylinders 2 (a cap) or 0 (the side)
};

/// The first intersection with t > 0 of the ray `origin + t direction`, in the solid's own frame. A ray that starts
/// inside a solid hits it only if the solid is a room.
[[nodiscard]] inline hit intersect(const solid& s, triple origin, triple direction) noexcept {
  const auto inverse = [](double d) { return 1.0 / (d == 0.0 ? 1e-30 : d); };
  hit h;
  if (s.kind == shape::room) {
    const double tx = (std::copysign(s.half.x, direction.x) - origin.x) * inverse(direction.x);
    const double ty = (std::copysign(s.half.y, direction.y) - origin.y) * inverse(direction.y);
    const double tz = (std::copysign(s.half.z, direction.z) - origin.z) * inverse(direction.z);
    h.t = tx;
    if (ty < h.t) h.t = ty, h.axis = 1;
    if (tz < h.t) h.t = tz, h.axis = 2;
    return h;
  }
  if (s.kind == shape::box) {
    const double ix = inverse(direction.x), iy = inverse(direction.y), iz = inverse(direction.z);
    const double mx = -origin.x * ix, my = -origin.y * iy, mz = -origin.z * iz;
    const double rx = s.half.x * std::abs(ix), ry = s.half.y * std::abs(iy), rz = s.half.z * std::abs(iz);
    const double nx = mx - rx, ny = my - ry, nz = mz - rz;
    const double enter = std::max(nx, std::max(ny, nz));
    const double leave = std::min(mx + rx, std::min(my + ry, mz + rz));
    if (enter <= 0.0 || enter > leave) return h;
    h.t = enter;
    h.axis = enter == nx ? 0 : (enter == ny ? 1 : 2);
    return h;
  }
  if (s.kind == shape::sphere) {
    const double a = dot(direction, direction), b = dot(origin, direction);
    const double c = dot(origin, origin) - s.half.x * s.half.x;
    const double discriminant = b * b - a * c;
    if (discriminant < 0.0 || b >= 0.0) return h;
    const double t = c / (std::sqrt(discriminant) - b);  // the nearer root, without cancellation
    if (t > 0.0) h.t = t;
    return h;
  }
  if (s.kind == shape::capsule) {
    // The hit on the side is valid between the hemispheres.
    const double core = s.half.z - s.half.x;
    const auto enters = [&](double a, double b, double c) {
      const double discriminant = b * b - a * c;
      return discriminant < 0.0 || b >= 0.0 || c <= 0.0 ? -1.0 : c / (std::sqrt(discriminant) - b);
    };
    const double radius2 = s.half.x * s.half.x;
    const double t =
        enters(direction.x * direction.x + direction.y * direction.y, origin.x * direction.x + origin.y * direction.y,
               origin.x * origin.x + origin.y * origin.y - radius2);
    if (t > 0.0 && std::abs(origin.z + t * direction.z) <= core) {
      h.t = t;
      return h;
    }
    for (const double end : {-core, core}) {
      const triple from{origin.x, origin.y, origin.z - end};
      const double to_end = enters(dot(direction, direction), dot(from, direction), dot(from, from) - radius2);
      // A hemisphere: the other half of the sphere is inside the capsule.
      if (to_end > 0.0 && to_end < h.t && (from.z + to_end * direction.z) * end >= 0.0) h.t = to_end;
    }
    return h;
  }
  const double a = direction.x * direction.x + direction.y * direction.y;
  const double b = origin.x * direction.x + origin.y * direction.y;
  const double c = origin.x * origin.x + origin.y * origin.y - s.half.x * s.half.x;
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return h;
  if (c > 0.0 && b < 0.0) {
    const double t = c / (std::sqrt(discriminant) - b);
    if (std::abs(origin.z + t * direction.z) <= s.half.z) {
      h.t = t;
      return h;
    }
  }
  const double t = (-std::copysign(s.half.z, direction.z) - origin.z) * inverse(direction.z);
  if (t > 0.0 && square(origin.x + t * direction.x) + square(origin.y + t * direction.y) <= s.half.x * s.half.x) {
    h.t = t;
    h.axis = 2;
  }
  return h;
}

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
