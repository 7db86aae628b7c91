// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The direction that most normals lie along or across.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping::detail {

struct found_up {
  vec3 up;              ///< unit vector
  double fixing = 0.0;  ///< how many normals fix it, in the direction in which it is known least
  double along = 0.0;   ///< how many normals lie along it
};

/// How well a normal at an angle of sine `off` fits; 1 if exactly, 0 from `reach` on. (Tukey's biweight.)
[[nodiscard]] inline double fit_of(double off, double reach) noexcept {
  const double t = off / reach;
  const double u = 1.0 - t * t;
  return u > 0 ? u * u : 0.0;
}

/// What normals say about the direction `up`.
struct up_ballot {
  double along = 0.0, across = 0.0;  ///< weights
  mat3 spread = zeros<mat3>();        ///< of the normals across, minus that of the normals along it

  up_ballot(std::span<const vec3> normals, const vec3& up, double reach) {
    for (const vec3& n : normals) {
      const double c = dot(n, up);
      if (const double w = fit_of(c, reach); w > 0) {
        across += w;
        spread += w * n * transposed(n);
      } else if (const double v = fit_of(norm(cross(n, up)), reach); v > 0) {
        along += v;
        spread -= v * n * transposed(n);
      }
    }
  }
};

/// The direction within `max_tilt` radians of -y that most normals lie along or across; nothing where no normal does,
/// or where it cannot be told from a turned one. O(normals), for some thousand directions.
[[nodiscard]] inline std::optional<found_up> vote_for_up(std::span<const vec3> normals, double max_tilt) {
  constexpr double degree = std::numbers::pi / 180.0;
  const double wide = std::sin(10.0 * degree);
  const auto score = [&](const vec3& up, double reach) {
    double sum = 0.0;
    for (const vec3& n : normals) {
      const double c = dot(n, up), along = c * c;
      // Floors and tables are seen from above. Half for walls, which fit many directions.
      sum += 0.5 * fit_of(c, reach) + (c > 0 ? 1.0 : 0.5) * fit_of(std::sqrt(std::max(0.0, 1.0 - along)), reach);
    }
    return sum * up.y() * up.y();
  };

  std::optional<vec3> best;
  double best_score = 0.0;
  const double step = 2.5 * degree;
  const int rings = static_cast<int>(std::floor(std::min(max_tilt, 80.0 * degree) / step));
  for (int ring = 0; ring <= rings; ++ring) {
    const double tilt = ring * step;
    const int count = std::max(1, static_cast<int>(std::ceil(2.0 * std::numbers::pi * std::sin(tilt) / step)));
    for (int i = 0; i != count; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / count;
      const vec3 up(std::sin(tilt) * std::cos(turn), -std::cos(tilt), std::sin(tilt) * std::sin(turn));
      if (const double s = score(up, wide); s > best_score) {
        best_score = s;
        best = up;
      }
    }
  }
  if (!best) return std::nullopt;

  vec3 up = *best;
  for (const double reach : {10.0, 8.0, 6.0, 5.0, 5.0, 5.0, 5.0, 5.0}) {
    const symmetric_eigen<3> axes = eigen_of_symmetric<3>(up_ballot{normals, up, std::sin(reach * degree)}.spread);
    const vec3 refined = column_of(axes.vectors, 0);
    up = dot(refined, up) < 0 ? vec3(-refined) : refined;
  }
  if (std::acos(std::clamp(-up.y(), -1.0, 1.0)) > max_tilt + wide) return std::nullopt;
  const up_ballot last{normals, up, std::sin(5.0 * degree)};
  const symmetric_eigen<3> axes = eigen_of_symmetric<3>(last.spread);
  const double fixing = axes.values(1) - axes.values(0);
  if (!(fixing > 0)) return std::nullopt;
  return found_up{up, fixing, last.along};
}

}  // namespace orbis::mapping::detail
