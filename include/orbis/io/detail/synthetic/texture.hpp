// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Textures of the surfaces: painted once, then sampled at the appropriate level of detail.
///
/// Every face is painted with a base (tiles, bricks, wood, ...) under many patches with hard edges whose sizes follow a
/// power law, as in the "dead leaves" model of natural images: it has corners at every scale, and no two regions look
/// the same (A. B. Lee, D. Mumford, J. Huang, "Occlusion models for natural images", IJCV 2001). Sampling is trilinear
/// in a pyramid (L. Williams, "Pyramidal parametrics", SIGGRAPH 1983), so that corners do not flicker when the camera
/// moves.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/canvas.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// The painted and lit faces of all solids, as image pyramids. A face is painted when it is first sampled, because no
/// camera sees all of them. Thread-safe. Memory: four bytes for each texel of the faces sampled so far, and twelve more
/// for each texel of the face that is being painted.
class texture_set {
 public:
  /// `texel`: edge length of a texel in metres.
  texture_set(painted_solids place, double texel)
      : place_{std::move(place)}, texel_{texel}, faces_(6 * place_.solids.size()) {}

  /// The colour (red in the lowest byte) at (u, v) metres from the corner of face `face` of solid `of`, for a pixel
  /// that covers `footprint` metres.
  [[nodiscard]] std::uint32_t sample(std::size_t of, int face, double u, double v, double footprint) const {
    const pyramid& p = painted(6 * of + static_cast<std::size_t>(face));
    // The logarithm to base 2, linear between powers of two, in units of 1/256.
    const auto relative = static_cast<float>(footprint * p.inverse_texel);
    const int detail = (std::bit_cast<std::int32_t>(relative) - 0x3f800000) >> 15;
    // Coordinates in units of 1/256 texel of the finest level.
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
  static constexpr std::size_t channels = 3;
  struct pyramid {
    std::vector<unsigned char> texels;  // red, green, blue
    std::array<std::uint32_t, most_levels> begin{};
    std::array<std::int32_t, most_levels> width{}, height{};
    int levels = 0;
    double inverse_texel = 1.0;  // texels per metre at the finest level
  };

  struct lazy_face {
    pyramid picture;
    std::atomic<bool> is_painted{false};
    std::mutex painting;
  };

  [[nodiscard]] const pyramid& painted(std::size_t index) const {
    lazy_face& f = faces_[index];
    if (!f.is_painted.load(std::memory_order_acquire)) {
      const std::lock_guard lock{f.painting};
      if (!f.is_painted.load(std::memory_order_relaxed)) {
        paint(index, f.picture);
        f.is_painted.store(true, std::memory_order_release);
      }
    }
    return f.picture;
  }

  // Spreads three channels into one word, 16 bits apart.
  [[nodiscard]] static std::uint64_t spread(const unsigned char* texel) noexcept {
    return texel[0] | std::uint64_t{texel[1]} << 16U | std::uint64_t{texel[2]} << 32U;
  }
  [[nodiscard]] static std::uint32_t pack(std::uint64_t s) noexcept {
    return static_cast<std::uint32_t>((s & 0xffU) | ((s >> 8U) & 0xff00U) | ((s >> 16U) & 0xff0000U));
  }
  /// Blends each channel: (a (256 - weight) + b weight) / 256, rounded.
  [[nodiscard]] static std::uint64_t blend(std::uint64_t a, std::uint64_t b, std::uint64_t weight) noexcept {
    return ((a * (256 - weight) + b * weight + 0x0000008000800080ULL) >> 8U) & 0x000000ff00ff00ffULL;
  }

  /// Interpolates between the four texel centres around (u, v) on a level; u and v in 1/256 texel of the finest level.
  [[nodiscard]] static std::uint64_t bilinear(const pyramid& p, int level, int u, int v) noexcept {
    const auto l = static_cast<std::size_t>(level);
    const int w = p.width[l], h = p.height[l];
    const int x = std::clamp((u >> level) - 128, 0, (w - 1) * 256);
    const int y = std::clamp((v >> level) - 128, 0, (h - 1) * 256);
    const int i = x >> 8, j = y >> 8;
    const unsigned char* const at = p.texels.data() + channels * (p.begin[l] + static_cast<std::size_t>(j * w + i));
    const std::size_t right = i + 1 < w ? channels : 0, below = j + 1 < h ? channels * static_cast<std::size_t>(w) : 0;
    const auto f = static_cast<std::uint64_t>(x & 255), g = static_cast<std::uint64_t>(y & 255);
    const std::uint64_t top = blend(spread(at), spread(at + right), f);
    const std::uint64_t bottom = blend(spread(at + below), spread(at + below + right), f);
    return blend(top, bottom, g);
  }

  /// Light on a surface: ambient light, and light from a lamp and a window.
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

  void paint(std::size_t index, pyramid& p) const {
    const std::size_t of = index / 6;
    const int face = static_cast<int>(index % 6);
    const solid& s = place_.solids[of];
    const std::array<double, 3> half{s.half.x, s.half.y, s.half.z};
    const int axis = face / 2;
    const auto ua = static_cast<std::size_t>(axis == 0 ? 1 : 0), va = static_cast<std::size_t>(axis == 2 ? 1 : 2);
    const face_look& look = place_.looks[of][static_cast<std::size_t>(face)];
    const double texel = texel_ * look.coarseness;
    const double across = 2.0 * half[ua], up = 2.0 * half[va];
    const bool repeats = look.period > 0.0;
    canvas c{repeats ? std::min(look.period, across) : across, repeats ? std::min(look.period, up) : up, texel};
    c.prime(look.surface, look.seed);
    c.scatter(look.patches, look.contrast, mix64(look.seed));

    p.inverse_texel = 1.0 / texel;
    p.width[0] = repeats ? canvas::texels(across, texel) : c.width();
    p.height[0] = repeats ? canvas::texels(up, texel) : c.height();
    p.texels.clear();  // an earlier attempt to paint the face may have failed
    p.texels.reserve(channels * texel_count(p.width[0], p.height[0]));
    const bool round = s.kind == shape::sphere || s.kind == shape::cylinder || s.kind == shape::capsule;
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
            light(place_, s.centre + s.to_world_direction({at[0], at[1], at[2]}), s.to_world_direction(n));
        const tint t = c(x % c.width(), y % c.height());
        const auto byte = [&](float v) {
          return static_cast<unsigned char>(std::clamp(v * brightness, 0.0F, 1.0F) * 255.0F + 0.5F);
        };
        for (const float v : {t.r, t.g, t.b}) p.texels.push_back(byte(v));
      }
    p.levels = 1;
    while (p.levels < most_levels && (p.width[static_cast<std::size_t>(p.levels - 1)] > 1 ||
                                      p.height[static_cast<std::size_t>(p.levels - 1)] > 1))
      halve(p);
  }

  /// Number of texels in a pyramid.
  [[nodiscard]] static std::size_t texel_count(int width, int height) noexcept {
    std::size_t all = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    for (int level = 1; level != most_levels && (width > 1 || height > 1); ++level) {
      width = (width + 1) / 2;
      height = (height + 1) / 2;
      all += static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    return all;
  }

  /// Appends the next level: averages of 2 x 2 texels.
  static void halve(pyramid& p) {
    const auto l = static_cast<std::size_t>(p.levels);
    const int w = p.width[l - 1], h = p.height[l - 1];
    const std::size_t from = p.begin[l - 1];
    p.begin[l] = static_cast<std::uint32_t>(p.texels.size() / channels);
    p.width[l] = (w + 1) / 2;
    p.height[l] = (h + 1) / 2;
    const auto texel = [&](int x, int y) {
      return spread(p.texels.data() +
                    channels * (from + static_cast<std::size_t>(std::min(y, h - 1) * w + std::min(x, w - 1))));
    };
    for (int y = 0; y != p.height[l]; ++y)
      for (int x = 0; x != p.width[l]; ++x) {
        const std::uint64_t sum =
            texel(2 * x, 2 * y) + texel(2 * x + 1, 2 * y) + texel(2 * x, 2 * y + 1) + texel(2 * x + 1, 2 * y + 1);
        const std::uint32_t mean = pack(((sum + 0x0000000200020002ULL) >> 2U) & 0x000000ff00ff00ffULL);
        for (std::size_t c = 0; c != channels; ++c) p.texels.push_back(static_cast<unsigned char>(mean >> (8 * c)));
      }
    ++p.levels;
  }

  painted_solids place_;
  double texel_;
  mutable std::vector<lazy_face> faces_;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
