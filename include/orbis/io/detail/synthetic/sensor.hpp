// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Errors of a structured-light RGB-D camera, applied to exact images.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/exact_view.hpp>
#include <orbis/io/synthetic_options.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// The published standard deviation of the depth noise (metres) at depth `z` (metres).
[[nodiscard]] inline double axial_deviation(double z) noexcept { return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4); }

/// The sensor with the exposure time and noise that result from automatic exposure. `light`: illumination relative to
/// the illumination for which `exposure` is correct.
[[nodiscard]] inline synthetic_sensor_options exposed(synthetic_sensor_options sensor, double light) noexcept {
  const double longest = std::max(sensor.exposure, sensor.max_exposure), needed = sensor.exposure / light;
  if (needed > longest) sensor.colour_noise *= std::sqrt(needed / longest);
  sensor.exposure = std::min(needed, longest);
  return sensor;
}

/// Applies the errors of one frame, row by row; rows are independent of each other.
class sensor {
 public:
  /// `focal`: focal length of the registered image, pixels. `key`: different for each frame.
  sensor(const synthetic_sensor_options& options, double focal, double depth_scale, std::uint64_t seed,
         std::uint64_t key) noexcept
      : options_{options}, focal_{focal}, depth_scale_{depth_scale}, seed_{noise_word(seed, 0x73656e73ULL, key)} {
    if (options.grazing_angle > 0.0) {
      constexpr double turns_per_radian = 0.15915494309189535;
      lost_cosine_ = static_cast<float>(cos_turns(turns_per_radian * options.grazing_angle));
      safe_cosine_ = static_cast<float>(cos_turns(turns_per_radian * (options.grazing_angle - 0.15)));
    }
  }

  /// Measures the depth of row `y`, in units of 1 / depth_scale metres; 0: no depth.
  void measure_depth(const exact_view& exact, int y, std::span<std::uint16_t> out) const {
    const int width = exact.depth.width();
    const std::vector<bool> dark = options_.shadow ? projector_shadow(exact.depth.row(y)) : std::vector<bool>{};
    const std::uint64_t key = noise_word(seed_, 1, static_cast<std::uint64_t>(y)) << 16U;
    for (int x = 0; x != width; ++x) {
      const auto i = static_cast<std::size_t>(x);
      out[i] = 0;
      if (!dark.empty() && dark[i]) continue;
      const std::uint64_t chance = mix64(key + static_cast<std::uint64_t>(x));
      if (lower_fraction(chance) < options_.dropouts) continue;
      if (is_grazed(exact.cosine(x, y), upper_fraction(chance))) continue;
      const std::uint64_t word = mix64(chance);
      double z = perturbed(beside_edge(exact, x, y, word), word);
      if (options_.stray_depths > 0.0) {
        const std::uint64_t stray = mix64(word ^ 0x7374726179ULL);
        if (lower_fraction(stray) < options_.stray_depths)
          z = options_.min_depth + upper_fraction(stray) * std::max(0.0, z - options_.min_depth);
      }
      if (z < options_.min_depth || (options_.max_depth > 0.0 && z > options_.max_depth)) continue;
      const double stored = z * depth_scale_ + 0.5;
      if (stored < 65535.0) out[i] = static_cast<std::uint16_t>(stored);
    }
  }

  /// Applies the noise to the colours of row `y`.
  void measure_colour(std::span<rgb8> row, int y) const noexcept {
    if (options_.colour_noise == 0.0) return;
    const auto sigma = static_cast<float>(options_.colour_noise * 0.015625476858987186);  // factor for the sum below
    const std::uint64_t key = noise_word(seed_, 2, static_cast<std::uint64_t>(y)) << 16U;
    for (std::size_t x = 0; x != row.size(); ++x) {
      const std::uint64_t word = mix64(key + x);
      const auto channel = [&](std::uint8_t value, unsigned shift) {
        // The sum of three uniform 7-bit numbers: close enough to a normal distribution for colours.
        const std::uint64_t w = word >> shift;
        const auto sum = static_cast<float>(static_cast<int>((w & 127U) + ((w >> 7U) & 127U) + ((w >> 14U) & 127U)));
        const float v = static_cast<float>(value) + sigma * (sum - 190.5F);
        return static_cast<std::uint8_t>(std::clamp(v, 0.0F, 255.0F) + 0.5F);
      };
      rgb8& p = row[x];
      p = {channel(p.r, 0), channel(p.g, 21), channel(p.b, 42)};
    }
  }

 private:
  [[nodiscard]] bool is_grazed(float cosine, double chance) const noexcept {
    if (cosine >= safe_cosine_) return false;
    return cosine <= lost_cosine_ ||
           chance * static_cast<double>(safe_cosine_ - lost_cosine_) > static_cast<double>(cosine - lost_cosine_);
  }

  /// Marks pixels that the projector does not illuminate: those for which a pixel further to the right in the row
  /// appears further to the left when seen from the projector.
  [[nodiscard]] std::vector<bool> projector_shadow(std::span<const float> depth) const {
    std::vector<bool> dark(depth.size());
    const double shift = focal_ * options_.baseline;
    double leftmost = 1e30;
    for (std::size_t i = depth.size(); i-- != 0;) {
      const double seen_at = static_cast<double>(i) - shift / static_cast<double>(depth[i]);
      dark[i] = seen_at > leftmost;
      leftmost = std::min(leftmost, seen_at);
    }
    return dark;
  }

  /// Measured depth of the ray through (x, y): near a depth edge, it may be the depth of a neighbour, or a value
  /// between the two.
  [[nodiscard]] double beside_edge(const exact_view& exact, int x, int y, std::uint64_t word) const noexcept {
    const image<float>& depth = exact.depth;
    const float* here = depth.data() + std::ptrdiff_t{y} * depth.width() + x;
    const float z = *here;
    if (options_.lateral_noise == 0.0 && options_.flying_pixels == 0.0) return static_cast<double>(z);
    const float left = here[x > 0 ? -1 : 0], right = here[x + 1 < depth.width() ? 1 : 0];
    const float above = here[y > 0 ? -depth.width() : 0], below = here[y + 1 < depth.height() ? depth.width() : 0];
    const float lowest = std::min(std::min(left, right), std::min(above, below));
    const float highest = std::max(std::max(left, right), std::max(above, below));
    const float other = z - lowest > highest - z ? lowest : highest;
    if (std::abs(z - other) <= 0.03F + 0.02F * std::min(z, other)) return static_cast<double>(z);  // no edge
    const std::uint64_t fresh = mix64(word ^ 0x6564676573ULL);
    if (upper_fraction(fresh) < options_.flying_pixels) {
      // Interpolate in disparity, like a correlation window that covers both surfaces.
      const double f = lower_fraction(fresh);
      return 1.0 / ((1.0 - f) / static_cast<double>(z) + f / static_cast<double>(other));
    }
    const double sideways = options_.lateral_noise * gaussian_from(mix64(fresh));
    return static_cast<double>(std::abs(sideways) > 0.5 ? other : z);
  }

  /// Approximately Gaussian noise with mean 0 and standard deviation 1, accurate up to three sigma: the sum of four
  /// uniform numbers.
  [[nodiscard]] static double gaussian_from(std::uint64_t word) noexcept {
    const std::uint64_t sum = (word & 0xffffU) + ((word >> 16U) & 0xffffU) + ((word >> 32U) & 0xffffU) + (word >> 48U);
    return (static_cast<double>(sum) - 131070.0) * 2.6428997918226276e-05;  // sqrt(3) / 65536
  }

  [[nodiscard]] double perturbed(double z, std::uint64_t word) const noexcept {
    if (options_.axial_noise != 0.0) z += options_.axial_noise * axial_deviation(z) * gaussian_from(word);
    if (options_.disparity_step != 0.0 && z > 0.0) {
      const double fb = options_.infrared_focal * options_.baseline;
      const double steps = static_cast<double>(floor_to_int(fb / (z * options_.disparity_step) + 0.5));
      z = steps > 0.0 ? fb / (steps * options_.disparity_step) : 0.0;
    }
    return z;
  }

  synthetic_sensor_options options_;
  double focal_, depth_scale_;
  std::uint64_t seed_;
  float lost_cosine_ = -1.0F, safe_cosine_ = -1.0F;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
