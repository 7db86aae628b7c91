// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Somebody who walks: a body of capsules whose arms and legs swing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// Two legs, two arms, two halves of the trunk, and a head.
using body_parts = std::array<solid, 7>;

/// A grown person, 1.75 m tall and 0.55 m wide, who stands on `foot` (metres, world) and looks along `(cos_yaw,
/// sin_yaw)`. `step`: how many double steps were made, whose fraction says how arms and legs are. The textures depend
/// on `seed` alone.
[[nodiscard]] inline body_parts walking_person(triple foot, double cos_yaw, double sin_yaw, double step,
                                               std::uint64_t seed) noexcept {
  body_parts parts;
  std::size_t i = 0;
  // `from`: of the upper end of its axis, from the foot along the view, to the left, and up.
  const auto add = [&](triple from, double radius, double height, double tilt, material surface) {
    solid& s = parts[i];
    s.kind = shape::capsule;
    s.half = {radius, radius, 0.5 * height};
    s.cos_yaw = cos_yaw;
    s.sin_yaw = sin_yaw;
    s.cos_tilt = cos_turns(tilt);
    s.sin_tilt = sin_turns(tilt);
    s.surface = surface;
    s.seed = noise_word(seed, 0x626f6479ULL, i);
    const triple upper{cos_yaw * from.x - sin_yaw * from.y, sin_yaw * from.x + cos_yaw * from.y, from.z};
    s.centre = foot + upper - s.to_world_direction({0.0, 0.0, 0.5 * height - radius});
    ++i;
  };
  const double swing = 0.07 * sin_turns(step);  // 25 degrees
  add({0.0, -0.1, 0.86}, 0.08, 0.93, swing, material::plain);
  add({0.0, 0.1, 0.86}, 0.08, 0.93, -swing, material::plain);
  add({0.0, -0.24, 1.4}, 0.05, 0.72, -0.8 * swing, material::wallpaper);
  add({0.0, 0.24, 1.4}, 0.05, 0.72, 0.8 * swing, material::wallpaper);
  add({0.0, -0.07, 1.3}, 0.15, 0.7, 0.0, material::wallpaper);
  add({0.0, 0.07, 1.3}, 0.15, 0.7, 0.0, material::wallpaper);
  add({0.0, 0.0, 1.65}, 0.1, 0.3, 0.0, material::fabric);
  return parts;
}

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
