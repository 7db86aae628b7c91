// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arithmetic for synthetic pixels: bit-identical on every machine.
///
/// Uses only integers and the operations that IEEE 754 defines exactly (+ - * / sqrt, conversions); sine and cosine are
/// those of core/rounded.hpp. A compiler may still fuse a product and a sum into one rounding if the target supports it
/// (`-march=native`), so every header whose arithmetic affects a pixel disables this for its own functions, between
/// ORBIS_BEGIN_UNFUSED and ORBIS_END_UNFUSED. Functions between these macros are not templates, because templates would
/// be compiled elsewhere, with other options.
#pragma once

#include <cmath>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/types.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// Three numbers, with arithmetic independent of Eigen (whose kernels depend on the target).
struct triple {
  double x = 0.0, y = 0.0, z = 0.0;

  [[nodiscard]] friend triple operator+(triple a, triple b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  [[nodiscard]] friend triple operator-(triple a, triple b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  [[nodiscard]] friend triple operator*(double s, triple a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
};

[[nodiscard]] inline double dot(triple a, triple b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[nodiscard]] inline triple cross(triple a, triple b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[nodiscard]] inline double length(triple a) noexcept { return std::sqrt(dot(a, a)); }
[[nodiscard]] inline double square(double a) noexcept { return a * a; }
[[nodiscard]] inline triple to_triple(const vec3& v) noexcept { return {v.x(), v.y(), v.z()}; }
[[nodiscard]] inline vec3 to_vec3(triple v) noexcept { return {v.x, v.y, v.z}; }

/// Returns a pseudorandom word that depends only on the three arguments.
[[nodiscard]] inline std::uint64_t noise_word(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept {
  return mix64(seed ^ mix64(index * 0x100000001b3ULL + stream));
}

/// The upper half of a word as a multiple of 2^-32, in [0, 1).
[[nodiscard]] inline double upper_fraction(std::uint64_t word) noexcept {
  return static_cast<double>(word >> 32U) * 0x1.0p-32;
}
/// The lower half of a word as a multiple of 2^-32, in [0, 1).
[[nodiscard]] inline double lower_fraction(std::uint64_t word) noexcept {
  return static_cast<double>(word & 0xffffffffU) * 0x1.0p-32;
}

/// A uniformly distributed random number in [lo, hi).
[[nodiscard]] inline double between(random_bits& bits, double lo, double hi) noexcept {
  return lo + (hi - lo) * bits.uniform();
}

/// The largest integer <= `v`, for |v| < 2^31.
[[nodiscard]] inline std::int64_t floor_to_int(double v) noexcept {
  const auto i = static_cast<std::int64_t>(v);
  return static_cast<double>(i) > v ? i - 1 : i;
}

/// Smooth one-dimensional noise in [-1, 1]: interpolates between random values at integer `t`.
[[nodiscard]] inline double smooth_noise(std::uint64_t seed, std::uint64_t stream, double t) noexcept {
  const std::int64_t cell = floor_to_int(t);
  const double f = t - static_cast<double>(cell);
  const auto knot = [&](std::int64_t k) {
    return 2.0 * upper_fraction(noise_word(seed, stream, static_cast<std::uint64_t>(k))) - 1.0;
  };
  const double w = f * f * f * (10.0 + f * (6.0 * f - 15.0));  // twice differentiable at the knots
  const double a = knot(cell), b = knot(cell + 1);
  return a + w * (b - a);
}

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
