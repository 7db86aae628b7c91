// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Appearance of the faces of solids, and the lamps that light them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>
#include <orbis/io/synthetic_options.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// Appearance of one face of a solid.
struct face_look {
  material surface = material::plain;  ///< the base
  double patches = 0.0;                ///< number of patches per square metre
  double contrast = 0.8;               ///< contrast of the patches
  std::uint64_t seed = 0;              ///< the same seed and size give the same picture
  double period = 0.0;                 ///< metres; if above 0, the picture repeats with this period along both axes
  double coarseness = 1.0;             ///< size of the face's texels relative to those of other faces
};
/// Appearance of the six faces of a solid, indexed by 2 * axis, plus one for the positive side.
using face_looks = std::array<face_look, 6>;

/// Number of patches per square metre for a material: books and clutter have many corners, a plain surface has few.
[[nodiscard]] inline double usual_patches(material m) noexcept {
  switch (m) {
    case material::plain: return 6.0;
    case material::wallpaper: return 160.0;
    case material::brick: return 120.0;
    case material::tile: return 120.0;
    case material::wood: return 160.0;
    case material::fabric: return 300.0;
    case material::books: return 250.0;
    case material::clutter: return 700.0;
  }
  return 0.0;
}

/// Appearance of face `face` of a solid made of `m`; the patches differ between faces and between seeds.
[[nodiscard]] inline face_look usual_look(material m, std::uint64_t seed, int face, double density = 1.0) noexcept {
  return {.surface = m,
          .patches = density * usual_patches(m),
          .contrast = m == material::clutter ? 1.0 : 0.8,
          .seed = noise_word(seed, 7, static_cast<std::uint64_t>(face))};
}
/// Appearance of the six faces of a solid, according to its material and seed.
[[nodiscard]] inline face_looks usual_looks(const solid& s, double density = 1.0) noexcept {
  face_looks looks;
  for (int face = 0; face != 6; ++face)
    looks[static_cast<std::size_t>(face)] = usual_look(s.surface, s.seed, face, density);
  return looks;
}

/// Solids, the appearance of their faces, and the lamps that light them: the input for painting textures.
struct painted_solids {
  std::vector<solid> solids;
  std::vector<face_looks> looks;  ///< one per solid
  std::vector<triple> lamps;      ///< metres, world; each point is lit by the lamp that appears brightest at that point
};

/// Appearance of the walls, floor and ceiling of a furnished room.
[[nodiscard]] inline face_looks looks_of_walls(const scene& room) noexcept {
  const solid& walls = room.solids().front();
  const synthetic_scene_options& o = room.options();
  face_looks looks;
  for (int face = 0; face != 6; ++face) {
    material m = walls.surface;
    if (face == 4) m = material::tile;   // floor
    if (face == 5) m = material::plain;  // ceiling
    if (face == 1) m = material::brick;
    if (face < 4 && o.wall_period > 0.0) m = walls.surface;
    if (room.is_poor_wall(face)) m = material::plain;
    face_look& look = looks[static_cast<std::size_t>(face)];
    look = usual_look(m, walls.seed, face, o.texture_density);
    if (m == material::plain) look.patches = (face == 5 ? 60.0 : 10.0) * o.texture_density;
    if (face < 4 && o.wall_period > 0.0) {
      look.period = o.wall_period;
      look.seed = noise_word(walls.seed, 7, 0);
    }
  }
  return looks;
}

/// A furnished room, ready to be painted. The light on the person is computed for the person's initial position.
[[nodiscard]] inline painted_solids painted(const scene& room) {
  painted_solids all{room.solids(), {}, {{0.0, 0.0, room.options().height - 0.5}}};
  for (const solid& s : all.solids)
    all.looks.push_back(all.looks.empty() ? looks_of_walls(room) : usual_looks(s, room.options().texture_density));
  return all;
}

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
