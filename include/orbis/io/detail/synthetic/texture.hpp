// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The surfaces' looks: painted once, then sampled with the right amount of detail.
///
/// Every face is painted with a base (tiles, bricks, wood, ...) under many patches with hard edges
/// whose sizes follow a power law, as in the "dead leaves" model of natural images: it has corners at
/// every scale, and no two places look alike (A. B. Lee, D. Mumford, J. Huang, "Occlusion models for
/// natural images", IJCV 2001). Sampling is trilinear in a pyramid (L. Williams, "Pyramidal
/// parametrics", SIGGRAPH 1983), so that corners do not flicker as the camera moves.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/canvas.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// All faces of some solids, painted and lit, in pyramids.
class texture_set {
 public:
  /// Paints every face with `texel` metres for each texel. O(surface / texel^2).
  template <execution_policy Policy>
  texture_set(const Policy& policy, const painted_solids& place, double texel) : faces_(6 * place.solids.size()) {
    for_each_index(policy, faces_.size(), 1, [&](std::size_t i) { paint(place, i, texel); });
  }

  /// The colour (red in the lowest byte) at (u, v) metres from the corner of face `face` of solid
  /// `of`, where a pixel covers `footprint` metres.
  [[nodiscard]] std::uint32_t sample(std::size_t of, int face, double u, double v, double footprint) const noexcept {
    const pyramid& p = faces_[6 * of + static_cast<std::size_t>(face)];
    // The logarithm to base 2, linear between powers of two, in 1/256.
    const auto relative = static_cast<float>(footprint * p.inverse_texel);
    const int detail = (std::bit_cast<std::int32_t>(relative) - 0x3f800000) >> 15;
    // In 1/256 texel of the finest level.
    const double scale = 256.0 * p.inverse_texel;
    const int a = static_cast<int>(u * scale), b = static_cast<int>(v * scale);
    if (detail <= 0) return pack(bilinear(p, 0, a, b));
    const int last = p.levels - 1;
    const int level = std::min(detail >> 8, last);
    const std::uint64_t fine = bilinear(p, level, a, b);
    if (level == last) return pack(fine);
    return pack(blend(fine, bilinear(p, level + 1, a, b), static_cast<std::uint64_t>(detail & 255)));
  }

 private:
  static constexpr int most_levels = 12;
  struct pyramid {
    std::vector<std::uint32_t> texels;
    std::array<std::uint32_t, most_levels> begin{};
    std::array<std::int32_t, most_levels> width{}, height{};
    int levels = 0;
    double inverse_texel = 1.0;  // of the finest level
  };

  // Three channels side by side in one word, 16 bits apart.
  [[nodiscard]] static std::uint64_t spread(std::uint32_t c) noexcept {
    return (c & 0xffU) | (std::uint64_t{c & 0xff00U} << 8U) | (std::uint64_t{c & 0xff0000U} << 16U);
  }
  [[nodiscard]] static std::uint32_t pack(std::uint64_t s) noexcept {
    return static_cast<std::uint32_t>((s & 0xffU) | ((s >> 8U) & 0xff00U) | ((s >> 16U) & 0xff0000U));
  }
  /// (a (256 - weight) + b weight) / 256, rounded, in each channel.
  [[nodiscard]] static std::uint64_t blend(std::uint64_t a, std::uint64_t b, std::uint64_t weight) noexcept {
    return ((a * (256 - weight) + b * weight + 0x0000008000800080ULL) >> 8U) & 0x000000ff00ff00ffULL;
  }

  /// Between the four texel centres of a level around (u, v), in 1/256 texel of the finest level.
  [[nodiscard]] static std::uint64_t bilinear(const pyramid& p, int level, int u, int v) noexcept {
    const auto l = static_cast<std::size_t>(level);
    const int w = p.width[l], h = p.height[l];
    const int x = std::clamp((u >> level) - 128, 0, (w - 1) * 256);
    const int y = std::clamp((v >> level) - 128, 0, (h - 1) * 256);
    const int i = x >> 8, j = y >> 8;
    const std::uint32_t* row = p.texels.data() + p.begin[l] + j * w + i;
    const int right = i + 1 < w ? 1 : 0, below = j + 1 < h ? w : 0;
    const auto f = static_cast<std::uint64_t>(x & 255), g = static_cast<std::uint64_t>(y & 255);
    const std::uint64_t top = blend(spread(row[0]), spread(row[right]), f);
    const std::uint64_t bottom = blend(spread(row[below]), spread(row[below + right]), f);
    return blend(top, bottom, g);
  }

  /// The light that falls on a surface: some from everywhere, some from a lamp, some through a window.
  [[nodiscard]] static float light(const painted_solids& place, triple p, triple normal) noexcept {
    double lamp = 0.0;
    for (const triple at : place.lamps) {
      const triple to_lamp = at - p;
      const double d = std::max(length(to_lamp), 0.3);
      const double facing = std::max(0.0, dot(normal, to_lamp) / d);
      lamp = std::max(lamp, 0.55 * facing / (0.6 + 0.15 * d * d));
    }
    const double window = std::max(0.0, 0.6 * normal.x + 0.48 * normal.y + 0.64 * normal.z);
    return static_cast<float>(0.46 + lamp + 0.16 * window);
  }

  void paint(const painted_solids& place, std::size_t index, double finest) {
    const std::size_t of = index / 6;
    const int face = static_cast<int>(index % 6);
    const solid& s = place.solids[of];
    const std::array<double, 3> half{s.half.x, s.half.y, s.half.z};
    const int axis = face / 2;
    const auto ua = static_cast<std::size_t>(axis == 0 ? 1 : 0), va = static_cast<std::size_t>(axis == 2 ? 1 : 2);
    const face_look& look = place.looks[of][static_cast<std::size_t>(face)];
    const double texel = finest * look.coarseness;
    const double across = 2.0 * half[ua], up = 2.0 * half[va];
    const bool repeats = look.period > 0.0;
    canvas c{repeats ? std::min(look.period, across) : across, repeats ? std::min(look.period, up) : up, texel};
    c.prime(look.surface, look.seed);
    c.scatter(look.patches, look.contrast, mix64(look.seed));

    pyramid& p = faces_[index];
    p.inverse_texel = 1.0 / texel;
    p.width[0] = repeats ? canvas::texels(across, texel) : c.width();
    p.height[0] = repeats ? canvas::texels(up, texel) : c.height();
    p.texels.reserve(static_cast<std::size_t>(p.width[0]) * static_cast<std::size_t>(p.height[0]) * 4 / 3 + 32);
    const bool round = s.kind == shape::sphere || s.kind == shape::cylinder;
    for (int y = 0; y != p.height[0]; ++y)
      for (int x = 0; x != p.width[0]; ++x) {
        std::array<double, 3> at{}, normal{};
        at[ua] = (x + 0.5) * texel - half[ua];
        at[va] = (y + 0.5) * texel - half[va];
        at[static_cast<std::size_t>(axis)] =
            (face & 1) != 0 ? half[static_cast<std::size_t>(axis)] : -half[static_cast<std::size_t>(axis)];
        triple n{};
        if (round && (s.kind == shape::sphere || axis != 2)) {
          n = {at[0], at[1], s.kind == shape::sphere ? at[2] : 0.0};
          n = (1.0 / length(n)) * n;
        } else {
          normal[static_cast<std::size_t>(axis)] = ((face & 1) != 0) != (s.kind == shape::room) ? 1.0 : -1.0;
          n = {normal[0], normal[1], normal[2]};
        }
        const float brightness =
            light(place, s.centre + s.to_world_direction({at[0], at[1], at[2]}), s.to_world_direction(n));
        const tint t = c(x % c.width(), y % c.height());
        const auto byte = [&](float v) {
          return static_cast<std::uint32_t>(std::clamp(v * brightness, 0.0F, 1.0F) * 255.0F + 0.5F);
        };
        p.texels.push_back(byte(t.r) | byte(t.g) << 8U | byte(t.b) << 16U);
      }
    p.levels = 1;
    while (p.levels < most_levels && (p.width[static_cast<std::size_t>(p.levels - 1)] > 1 ||
                                      p.height[static_cast<std::size_t>(p.levels - 1)] > 1))
      halve(p);
  }

  /// Appends the next level: means of two by two.
  static void halve(pyramid& p) {
    const auto l = static_cast<std::size_t>(p.levels);
    const int w = p.width[l - 1], h = p.height[l - 1];
    const std::size_t from = p.begin[l - 1];
    p.begin[l] = static_cast<std::uint32_t>(p.texels.size());
    p.width[l] = (w + 1) / 2;
    p.height[l] = (h + 1) / 2;
    const auto texel = [&](int x, int y) {
      return spread(p.texels[from + static_cast<std::size_t>(std::min(y, h - 1) * w + std::min(x, w - 1))]);
    };
    for (int y = 0; y != p.height[l]; ++y)
      for (int x = 0; x != p.width[l]; ++x) {
        const std::uint64_t sum =
            texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1);
        p.texels.push_back(pack(((sum + 0x0000000200020002ULL) >> 2U) & 0x000000ff00ff00ffULL));
      }
    ++p.levels;
  }

  std::vector<pyramid> faces_;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
