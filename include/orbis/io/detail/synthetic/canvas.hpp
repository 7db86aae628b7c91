// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Paints one face of a solid: a base (tiles, bricks, wood, ...) under many patches with hard edges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// A colour with channels from 0 to about 1.
struct tint {
  float r = 0.0F, g = 0.0F, b = 0.0F;
  [[nodiscard]] friend tint operator*(float s, tint c) noexcept { return {s * c.r, s * c.g, s * c.b}; }
};

/// One face being painted.
class canvas {
 public:
  /// Sizes in metres; texels have an edge of `texel` metres.
  canvas(double width, double height, double texel)
      : texel_{texel},
        width_{texels(width, texel)},
        height_{texels(height, texel)},
        texels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

  /// Number of texels with an edge of `texel` metres that cover `length` metres.
  [[nodiscard]] static int texels(double length, double texel) noexcept {
    return std::max(1, static_cast<int>(length / texel + 0.999));
  }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] tint& operator()(int x, int y) noexcept {
    return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }

  /// Paints the base, texel by texel.
  void prime(material m, std::uint64_t seed) {
    random_bits bits{seed};
    const tint base = base_colour(m, bits);
    const bool quiet = m == material::plain;
    for (int y = 0; y != height_; ++y)
      for (int x = 0; x != width_; ++x) {
        const double u = (x + 0.5) * texel_, v = (y + 0.5) * texel_;
        (*this)(x, y) = shade(m, seed, u, v, quiet) * base;
      }
  }

  /// Paints `per_square_metre` patches per square metre, large ones first.
  void scatter(double per_square_metre, double contrast, std::uint64_t seed) {
    random_bits bits{seed};
    const double w = width_ * texel_, h = height_ * texel_;
    const int count = static_cast<int>(per_square_metre * w * h + bits.uniform());
    for (int i = 0; i < count; ++i) {
      // The i-th largest of `count` radii with N(> r) ~ r^-2.
      const double rank = (i + bits.uniform()) / count;
      const double r = std::min(smallest_patch / std::sqrt(rank + 1e-9), largest_patch);
      const double u = between(bits, 0.0, w), v = between(bits, 0.0, h);
      stamp(u, v, r, patch_colour(contrast, bits), bits);
    }
  }

 private:
  static constexpr double smallest_patch = 0.009;  // metres
  static constexpr double largest_patch = 0.22;

  [[nodiscard]] static tint base_colour(material m, random_bits& bits) {
    const auto around = [&](double r, double g, double b) {
      const double gain = between(bits, 0.85, 1.15);
      const double dr = between(bits, -0.06, 0.06), dg = between(bits, -0.04, 0.04), db = between(bits, -0.06, 0.06);
      return tint{static_cast<float>(gain * (r + dr)), static_cast<float>(gain * (g + dg)),
                  static_cast<float>(gain * (b + db))};
    };
    switch (m) {
      case material::plain: return around(0.80, 0.78, 0.72);
      case material::wallpaper: return around(0.72, 0.68, 0.56);
      case material::brick: return around(0.62, 0.36, 0.28);
      case material::tile: return around(0.60, 0.62, 0.62);
      case material::wood: return around(0.58, 0.40, 0.24);
      case material::fabric: return around(0.34, 0.42, 0.60);
      case material::books: return around(0.55, 0.50, 0.45);
      case material::clutter: return around(0.62, 0.60, 0.50);
    }
    return {};
  }

  [[nodiscard]] static tint patch_colour(double contrast, random_bits& bits) {
    // Patches are bright or dark, rarely of medium brightness; a third of them are coloured.
    const double level = bits.uniform() < 0.5 ? between(bits, 0.05, 0.40) : between(bits, 0.60, 1.0);
    const double mixed = 0.55 + contrast * (level - 0.55);
    const double colourful = bits.uniform() < 0.35 ? 0.45 : 0.08;
    const double dr = between(bits, -colourful, colourful), dg = between(bits, -colourful, colourful),
                 db = between(bits, -colourful, colourful);
    return {static_cast<float>(std::clamp(mixed + dr, 0.0, 1.0)), static_cast<float>(std::clamp(mixed + dg, 0.0, 1.0)),
            static_cast<float>(std::clamp(mixed + db, 0.0, 1.0))};
  }

  [[nodiscard]] static float cell_noise(std::uint64_t seed, std::int64_t i, std::int64_t j) noexcept {
    return static_cast<float>(
        upper_fraction(noise_word(seed, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(j))));
  }
  /// Noise in [-1, 1]: interpolates bilinearly between random values at integer `u` and `v`.
  [[nodiscard]] static float value_noise(std::uint64_t seed, double u, double v) noexcept {
    const std::int64_t i = floor_to_int(u), j = floor_to_int(v);
    const auto f = static_cast<float>(u - static_cast<double>(i)), g = static_cast<float>(v - static_cast<double>(j));
    const float a = cell_noise(seed, i, j), b = cell_noise(seed, i + 1, j);
    const float c = cell_noise(seed, i, j + 1), d = cell_noise(seed, i + 1, j + 1);
    const float top = a + f * (b - a), bottom = c + f * (d - c);
    return 2.0F * (top + g * (bottom - top)) - 1.0F;
  }

  [[nodiscard]] static tint shade_grey(float s) noexcept { return {s, s, s}; }
  struct factor {
    tint f;
    [[nodiscard]] friend tint operator*(factor a, tint c) noexcept { return {a.f.r * c.r, a.f.g * c.g, a.f.b * c.b}; }
  };
  /// Colour factors of the base at (u, v) metres.
  [[nodiscard]] static factor shade(material m, std::uint64_t seed, double u, double v, bool quiet) noexcept {
    const float slow = value_noise(seed, 1.7 * u, 1.7 * v);
    if (quiet) return {shade_grey(1.0F + 0.03F * slow)};
    float s = 1.0F + 0.10F * slow;
    switch (m) {
      case material::brick: {
        const std::int64_t row = floor_to_int(v / 0.08);
        const double shifted = u / 0.24 + ((row & 1) != 0 ? 0.5 : 0.0);
        const std::int64_t column = floor_to_int(shifted);
        const double a = shifted - static_cast<double>(column), b = v / 0.08 - static_cast<double>(row);
        if (a < 0.04 || b < 0.12) return {tint{1.25F, 1.9F, 2.2F}};
        s *= 0.7F + 0.6F * cell_noise(seed + 1, column, row);
        break;
      }
      case material::tile: {
        const std::int64_t i = floor_to_int(u / 0.25), j = floor_to_int(v / 0.25);
        const double a = u / 0.25 - static_cast<double>(i), b = v / 0.25 - static_cast<double>(j);
        if (a < 0.03 || b < 0.03) return {shade_grey(0.45F)};
        s *= (((i + j) & 1) != 0 ? 0.78F : 1.1F) + 0.25F * cell_noise(seed + 1, i, j);
        break;
      }
      case material::wood: s *= 1.0F + 0.22F * value_noise(seed + 1, 2.0 * u, 45.0 * v); break;
      case material::fabric: s *= 1.0F + 0.25F * value_noise(seed + 1, 60.0 * u, 60.0 * v); break;
      case material::books: {
        const double spine = u / 0.035;
        const std::int64_t i = floor_to_int(spine);
        const double a = spine - static_cast<double>(i);
        if (a < 0.08) return {shade_grey(0.2F)};
        const float red = 0.3F + 1.3F * cell_noise(seed + 1, i, 0), green = 0.3F + 1.3F * cell_noise(seed + 2, i, 0),
                    blue = 0.3F + 1.3F * cell_noise(seed + 3, i, 0);
        return {tint{s * red, s * green, s * blue}};
      }
      case material::plain:
      case material::wallpaper:
      case material::clutter: s *= 1.0F + 0.08F * value_noise(seed + 1, 9.0 * u, 9.0 * v); break;
    }
    return {shade_grey(s)};
  }

  /// Paints one patch: a disc, or a convex polygon with three or four corners.
  void stamp(double u, double v, double r, tint colour, random_bits& bits) {
    const int x0 = std::max(0, static_cast<int>((u - r) / texel_)),
              x1 = std::min(width_ - 1, static_cast<int>((u + r) / texel_));
    const int y0 = std::max(0, static_cast<int>((v - r) / texel_)),
              y1 = std::min(height_ - 1, static_cast<int>((v + r) / texel_));
    const int corners = 2 + static_cast<int>(bits.below(3));  // 2: a disc
    const double at = bits.uniform();
    std::array<triple, 4> sides{};  // n.x x + n.y y <= n.z
    for (int k = 0; k != corners; ++k) {
      const double angle = at + (k + 0.3 * bits.uniform()) / corners;
      sides[static_cast<std::size_t>(k)] = {cos_turns(angle), sin_turns(angle), r * between(bits, 0.35, 0.75)};
    }
    for (int y = y0; y <= y1; ++y) {
      const double b = (y + 0.5) * texel_ - v;
      for (int x = x0; x <= x1; ++x) {
        const double a = (x + 0.5) * texel_ - u;
        if (a * a + b * b > r * r) continue;
        bool inside = true;
        if (corners > 2)
          for (int k = 0; k != corners; ++k) {
            const triple& n = sides[static_cast<std::size_t>(k)];
            inside = inside && n.x * a + n.y * b <= n.z;
          }
        if (inside) (*this)(x, y) = colour;
      }
    }
  }

  double texel_;
  int width_, height_;
  std::vector<tint> texels_;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
