// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Synthetic textures with the statistics of natural images.
///
/// The dead-leaves model: A. B. Lee, D. Mumford, J. Huang, "Occlusion models for natural images", IJCV 2001. Training
/// on such images transfers to real ones: M. Baradad, J. Wulff, T. Wang, P. Isola, A. Torralba, "Learning to see by
/// looking at noise", NeurIPS 2021.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/rounded.hpp>

namespace textures {

using orbis::cos_turns;
using orbis::random_bits;
using orbis::sin_turns;

/// A uniformly distributed random number in [lo, hi).
[[nodiscard]] inline double between(random_bits& bits, double lo, double hi) noexcept { return bits.uniform(lo, hi); }

/// A texture that is being painted; brightness ranges from about 0 to 1.
class picture {
 public:
  picture(int width, int height, std::uint64_t seed)
      : width_{width},
        height_{height},
        bits_{orbis::mix64(seed)},
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  [[nodiscard]] orbis::image<std::uint8_t> paint() {
    wash();
    fall();
    const int signs = static_cast<int>(bits_.below(5));
    for (int i = 0; i < signs; ++i) write();
    light();
    for (int blurs = static_cast<int>(bits_.below(5)); blurs > 0; --blurs) blur();
    return expose();
  }

 private:
  /// Position and rotation of a leaf.
  struct frame {
    double x, y, cos, sin;
    [[nodiscard]] double u(double px, double py) const noexcept { return cos * (px - x) + sin * (py - y); }
    [[nodiscard]] double v(double px, double py) const noexcept { return cos * (py - y) - sin * (px - x); }
  };
  enum class fill { flat, slope, stripes, checks, dots, cloud };

  [[nodiscard]] float& at(int x, int y) noexcept {
    return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }

  /// Smooth noise in [-1, 1] with a period of about one unit.
  [[nodiscard]] static double noise(std::uint64_t seed, double u, double v) noexcept {
    const double fu = std::floor(u), fv = std::floor(v);
    const auto cell = [&](double i, double j) {
      const auto a = static_cast<std::uint64_t>(static_cast<std::int64_t>(fu + i));
      const auto b = static_cast<std::uint64_t>(static_cast<std::int64_t>(fv + j));
      return static_cast<double>(orbis::mix64(seed ^ orbis::mix64(a * 0x9e3779b97f4a7c15ULL + b)) >> 11U) * 0x1.0p-52 -
             1.0;
    };
    const double s = u - fu, t = v - fv;
    const double top = cell(0, 0) + s * (cell(1, 0) - cell(0, 0));
    const double bottom = cell(0, 1) + s * (cell(1, 1) - cell(0, 1));
    return top + t * (bottom - top);
  }
  /// A sum of octaves of noise whose amplitudes are proportional to their periods.
  [[nodiscard]] static double cloud(std::uint64_t seed, double u, double v) noexcept {
    return 0.53 * noise(seed, u, v) + 0.27 * noise(seed + 1, 2 * u, 2 * v) + 0.13 * noise(seed + 2, 4 * u, 4 * v) +
           0.07 * noise(seed + 3, 8 * u, 8 * v);
  }

  void wash() {
    const std::uint64_t seed = bits_();
    const double base = between(bits_, 0.2, 0.8), swing = between(bits_, 0.02, 0.5), size = between(bits_, 10.0, 200.0);
    for (int y = 0; y != height_; ++y)
      for (int x = 0; x != width_; ++x) at(x, y) = static_cast<float>(base + swing * cloud(seed, x / size, y / size));
  }

  /// Paints leaves, large ones first; the number of leaves larger than r is proportional to r^-2.
  void fall() {
    const double smallest = between(bits_, 2.5, 7.0), largest = between(bits_, 60.0, 240.0);
    const double contrast = between(bits_, 0.25, 1.0), middle = between(bits_, 0.35, 0.65);
    const double cover = between(bits_, 0.3, 2.5);  // coverage of the image by the smallest leaves only
    const int count = static_cast<int>(cover * width_ * height_ / (30.0 * smallest * smallest)) + 10;
    const bool upright = bits_.below(3) == 0;  // like most man-made objects
    for (int i = 0; i < count; ++i) {
      const double rank = (i + bits_.uniform()) / count;
      const double r = std::min(smallest / std::sqrt(rank + 1e-9), largest);
      const double level = middle + contrast * between(bits_, -0.5, 0.5);
      // Not as arguments of `leaf`, because their order of evaluation is unspecified.
      const double x = between(bits_, 0.0, width_), y = between(bits_, 0.0, height_);
      leaf(x, y, r, level, contrast, upright);
    }
  }

  void leaf(double x, double y, double r, double level, double contrast, bool upright) {
    double turn = upright ? 0.25 * bits_.below(4) : bits_.uniform();
    if (upright) turn += between(bits_, -0.01, 0.01);
    const frame f{x, y, cos_turns(turn), sin_turns(turn)};
    const int shape = static_cast<int>(bits_.below(7));  // 0 disc, 1 ellipse, 2, 3 rectangle, 4 stroke, 5, 6 polygon
    const double slim = shape == 0 ? 1.0 : shape == 4 ? between(bits_, 0.03, 0.15) : between(bits_, 0.3, 1.0);
    const int corners = 3 + static_cast<int>(bits_.below(4));
    std::array<std::array<double, 3>, 6> sides{};
    for (int k = 0; k != corners; ++k) {
      const double angle = (k + between(bits_, 0.0, 0.4)) / corners;
      sides[static_cast<std::size_t>(k)] = {cos_turns(angle), sin_turns(angle), r * between(bits_, 0.35, 0.8)};
    }
    const auto inside = [&](double u, double v) {
      if (shape < 2) return u * u + v * v / (slim * slim) <= r * r;
      if (shape < 5) return std::abs(u) <= r && std::abs(v) <= slim * r;
      for (int k = 0; k != corners; ++k) {
        const auto& s = sides[static_cast<std::size_t>(k)];
        if (s[0] * u + s[1] * v > s[2]) return false;
      }
      return true;
    };

    const fill look = r < 8.0 || bits_.below(3) == 0 ? fill::flat : static_cast<fill>(bits_.below(6));
    const double swing = contrast * between(bits_, 0.05, 0.5), period = between(bits_, 4.0, std::max(6.0, 0.7 * r));
    const std::uint64_t seed = bits_();
    const bool edged = bits_.below(4) == 0;
    const double edge = level + (level > 0.5 ? -0.4 : 0.4) * contrast;
    const auto shade = [&](double u, double v) {
      const double a = u / period, b = v / period;
      switch (look) {
        case fill::flat: return level;
        case fill::slope: return level + swing * (u / r);
        case fill::stripes: return level + (a - std::floor(a) < 0.5 ? swing : -swing);
        case fill::checks: {
          const bool odd =
              (static_cast<std::int64_t>(std::floor(a)) + static_cast<std::int64_t>(std::floor(b))) % 2 != 0;
          return level + (odd ? swing : -swing);
        }
        case fill::dots: {
          const double s = a - std::floor(a) - 0.5, t = b - std::floor(b) - 0.5;
          return level + (s * s + t * t < 0.09 ? swing : -0.2 * swing);
        }
        case fill::cloud: return level + 1.5 * swing * cloud(seed, a, b);
      }
      return level;
    };
    const double reach = r + 2.0;
    const int x0 = std::max(0, static_cast<int>(x - reach)), x1 = std::min(width_ - 1, static_cast<int>(x + reach));
    const int y0 = std::max(0, static_cast<int>(y - reach)), y1 = std::min(height_ - 1, static_cast<int>(y + reach));
    for (int py = y0; py <= y1; ++py)
      for (int px = x0; px <= x1; ++px) {
        const double u = f.u(px, py), v = f.v(px, py);
        if (!inside(u, v)) continue;
        const bool rim = edged && r > 8.0 && !inside(1.15 * u, 1.15 * v);
        at(px, py) = static_cast<float>(rim ? edge : shade(u, v));
      }
  }

  /// Paints a block of signs that resemble writing: short strokes on a grid.
  void write() {
    const double size = between(bits_, 5.0, 28.0),
                 turn = bits_.below(2) == 0 ? bits_.uniform() : between(bits_, -0.02, 0.02);
    const int rows = 1 + static_cast<int>(bits_.below(8)), columns = 3 + static_cast<int>(bits_.below(20));
    const frame f{between(bits_, 0.0, width_), between(bits_, 0.0, height_), cos_turns(turn), sin_turns(turn)};
    const double ink = bits_.below(2) == 0 ? between(bits_, 0.0, 0.2) : between(bits_, 0.8, 1.0);
    const double paper = ink < 0.5 ? between(bits_, 0.6, 1.0) : between(bits_, 0.0, 0.4);
    const bool on_paper = bits_.below(2) == 0;
    const std::uint64_t seed = bits_();
    const double thick = between(bits_, 0.1, 0.22);
    const double reach = size * (columns + 1.6 * rows + 2);
    const int x0 = std::max(0, static_cast<int>(f.x - reach)), x1 = std::min(width_ - 1, static_cast<int>(f.x + reach));
    const int y0 = std::max(0, static_cast<int>(f.y - reach)),
              y1 = std::min(height_ - 1, static_cast<int>(f.y + reach));
    for (int py = y0; py <= y1; ++py)
      for (int px = x0; px <= x1; ++px) {
        const double u = f.u(px, py) / size, v = f.v(px, py) / (1.6 * size);
        if (u < -0.3 || v < -0.3 || u > columns + 0.3 || v > rows + 0.3) continue;
        if (on_paper) at(px, py) = static_cast<float>(paper);
        if (u < 0.0 || v < 0.0 || u >= columns || v >= rows) continue;
        const double cu = std::floor(u), cv = std::floor(v);
        const std::uint64_t sign = orbis::mix64(seed ^ orbis::mix64(static_cast<std::uint64_t>(cu + 64.0 * cv)));
        if (sign % 7 == 0) continue;  // gap between words
        if (stroke(sign, u - cu, v - cv, thick)) at(px, py) = static_cast<float>(ink);
      }
  }
  /// Returns true if a point in the unit square is on a stroke of a sign, which has up to eight strokes: horizontal,
  /// vertical and diagonal ones.
  [[nodiscard]] static bool stroke(std::uint64_t sign, double u, double v, double thick) noexcept {
    if (u < 0.1 || u > 0.85 || v < 0.15 || v > 0.85) return false;
    const double s = (u - 0.1) / 0.75, t = (v - 0.15) / 0.7;
    const auto has = [&](unsigned bit) { return ((sign >> (8 + bit)) & 1U) != 0; };
    return (has(0) && t < thick) || (has(1) && std::abs(t - 0.5) < 0.5 * thick) || (has(2) && t > 1 - thick) ||
           (has(3) && s < thick) || (has(4) && s > 1 - thick) || (has(5) && std::abs(s - 0.5) < 0.5 * thick) ||
           (has(6) && has(8) && std::abs(s - t) < 0.6 * thick) ||
           (has(7) && has(9) && std::abs(s + t - 1) < 0.6 * thick);
  }

  /// Applies uneven light and a shadow.
  void light() {
    const double gx = between(bits_, -0.4, 0.4) / width_, gy = between(bits_, -0.4, 0.4) / height_;
    const double turn = bits_.uniform(), nx = cos_turns(turn), ny = sin_turns(turn);
    const double offset = between(bits_, -0.3, 0.3) * width_,
                 dark = bits_.below(2) == 0 ? between(bits_, 0.5, 0.9) : 1.0;
    for (int y = 0; y != height_; ++y)
      for (int x = 0; x != width_; ++x) {
        const double px = x - 0.5 * width_, py = y - 0.5 * height_;
        at(x, y) *= static_cast<float>((1.0 + gx * px + gy * py) * (nx * px + ny * py > offset ? dark : 1.0));
      }
  }

  /// Applies a binomial filter, (1 2 1) / 4, in both directions.
  void blur() {
    std::vector<float> line(static_cast<std::size_t>(std::max(width_, height_)));
    const auto smooth = [&](int n, auto&& pixel) {
      for (int i = 0; i != n; ++i) line[static_cast<std::size_t>(i)] = pixel(i);
      for (int i = 0; i != n; ++i) {
        const float before = line[static_cast<std::size_t>(std::max(i - 1, 0))];
        const float after = line[static_cast<std::size_t>(std::min(i + 1, n - 1))];
        pixel(i) = 0.25F * (before + after) + 0.5F * line[static_cast<std::size_t>(i)];
      }
    };
    for (int y = 0; y != height_; ++y) smooth(width_, [&](int x) -> float& { return at(x, y); });
    for (int x = 0; x != width_; ++x) smooth(height_, [&](int y) -> float& { return at(x, y); });
  }

  [[nodiscard]] orbis::image<std::uint8_t> expose() {
    orbis::image<std::uint8_t> out(width_, height_);
    const double gain = between(bits_, 140.0, 250.0), grain = between(bits_, 0.0, 4.0);
    for (std::size_t i = 0; i != pixels_.size(); ++i) {
      const double value = gain * static_cast<double>(pixels_[i]) + grain * bits_.normal();
      out.pixels()[i] = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
    }
    return out;
  }

  int width_, height_;
  random_bits bits_;
  std::vector<float> pixels_;
};

/// Paints the texture with the seed `seed`.
[[nodiscard]] inline orbis::image<std::uint8_t> paint(int width, int height, std::uint64_t seed) {
  return picture{width, height, seed}.paint();
}

}  // namespace textures
