// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RANSAC estimator of homographies.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize::detail {

/// Returns the homography that maps four points to four others, computed from projective bases and normalised to norm
/// 1. Empty if three points are collinear, or if some points would be behind a camera.
[[nodiscard]] inline std::optional<mat3> homography_of_four(const std::array<vec2, 4>& first,
                                                            const std::array<vec2, 4>& second) {
  mat3 bases[2];
  vec3 weights[2];
  for (int k = 0; k != 2; ++k) {
    const std::array<vec2, 4>& p = k == 0 ? first : second;
    const auto cross = [&](std::size_t a, std::size_t b, std::size_t c) {
      return (p[b].x() - p[a].x()) * (p[c].y() - p[a].y()) - (p[b].y() - p[a].y()) * (p[c].x() - p[a].x());
    };
    // Express the fourth point as a combination of the other three by triangle areas.
    weights[k] = vec3(cross(3, 1, 2), cross(0, 3, 2), cross(0, 1, 3));
    const double area = cross(0, 1, 2);
    const double extent = squared_norm(p[1] - p[0]) + squared_norm(p[2] - p[0]) + squared_norm(p[3] - p[0]);
    if (!(std::min(std::fabs(area), min_entry(magnitudes(weights[k]))) > 1e-6 * extent)) return std::nullopt;
    weights[k] /= area;
    for (int i = 0; i != 3; ++i) set_column(bases[k], i, weights[k][i] * homogeneous(p[static_cast<std::size_t>(i)]));
  }
  for (int i = 0; i != 3; ++i)
    if (!(weights[1][i] / weights[0][i] > 0.0)) return std::nullopt;  // some points are behind a camera
  mat3 out = bases[1] * inverse(bases[0]);
  out /= norm(out);
  if (!all_finite(out)) return std::nullopt;
  return out;
}

/// Normal equations of transfer errors for D in (I + D) H, where the last entry of D is 0. Only the lower triangle of
/// `h` is used. `cost` is the sum of squares.
struct homography_equations {
  matrix<8, 8> h = zeros<matrix<8, 8>>();
  matrix<8> g = zeros<matrix<8>>();
  double cost = 0.0;

  /// Adds the error `r` of a point. `by_point` is the derivative of `r` with respect to the point before projection; a
  /// small D moves that point by `by_d * D * moved`.
  void add(const vec2& r, const matrix<2, 3>& by_point, const mat3& by_d, const vec3& moved) {
    const matrix<2, 3> a = by_point * by_d;
    matrix<2, 8> j;
    for (int k = 0; k != 8; ++k) set_column(j, k, column_of(a, k / 3) * moved[k % 3]);
    for (int k = 0; k != 8; ++k) {
      for (int l = k; l != 8; ++l) h(l, k) += j(0, l) * j(0, k) + j(1, l) * j(1, k);
      g[k] += j(0, k) * r[0] + j(1, k) * r[1];
    }
    cost += squared_norm(r);
  }
  /// Returns I + D for a Gauss-Newton step; empty if the equations do not determine a step.
  [[nodiscard]] std::optional<mat3> step() const {
    small_cholesky<8> factors;
    if (!factors.set(h) || !(factors.factor(1e-9) > 0.0)) return std::nullopt;
    const matrix<8> entries = -factors.solve(g);
    if (!all_finite(entries)) return std::nullopt;
    mat3 d = identity<mat3>();
    for (int j = 0; j != 8; ++j) d(j / 3, j % 3) += entries[j];
    return d;
  }
};

/// Returns the derivative of `xy`, the projection of a point to z = 1, with respect to the point.
[[nodiscard]] inline matrix<2, 3> derivative_of_projection(const vec2& xy, double inverse_z) {
  matrix<2, 3> projection;
  projection << inverse_z, 0.0, -xy.x() * inverse_z, 0.0, inverse_z, -xy.y() * inverse_z;
  return projection;
}

class homography_estimator {
 public:
  struct model {
    mat3 forward, backward;
  };
  static constexpr std::size_t sample_size = 4;

  struct match {
    vec2 first, second;
    std::uint32_t original;
  };

  explicit homography_estimator(const std::vector<match>& matches) : matches_{matches} {
    for (const match& m : matches) {
      const std::array values{m.first.x(), m.first.y(), m.second.x(), m.second.y()};
      for (std::size_t k = 0; k != 4; ++k) columns_[k].push_back(static_cast<float>(values[k]));
    }
    for (auto& column : columns_)
      column.resize((matches.size() + consensus_block - 1) / consensus_block * consensus_block);
  }

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }

  [[nodiscard]] one_or_none<model> fit(const std::array<std::uint32_t, 4>& s) const {
    const auto h = homography_of_four(
        {matches_[s[0]].first, matches_[s[1]].first, matches_[s[2]].first, matches_[s[3]].first},
        {matches_[s[0]].second, matches_[s[1]].second, matches_[s[2]].second, matches_[s[3]].second});
    if (!h) return {};
    return {make_model(*h)};
  }

  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const match& x = matches_[i];
    const vec3 p = m.forward * homogeneous(x.first), q = m.backward * homogeneous(x.second);
    return 0.5 * (squared_norm(head<2>(p) / p.z() - x.second) + squared_norm(head<2>(q) / q.z() - x.first));
  }

  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    std::array<float, 9> f, b;
    for (int k = 0; k != 9; ++k) {
      f[static_cast<std::size_t>(k)] = static_cast<float>(m.forward(k / 3, k % 3));
      b[static_cast<std::size_t>(k)] = static_cast<float>(m.backward(k / 3, k % 3));
    }
    std::array<float, consensus_block> errors;
    const float* const x = columns_[0].data() + first;
    const float* const y = columns_[1].data() + first;
    const float* const u = columns_[2].data() + first;
    const float* const v = columns_[3].data() + first;
    for (std::size_t i = 0; i != consensus_block; ++i) {
      const float pz = 1.0F / (f[6] * x[i] + f[7] * y[i] + f[8]), qz = 1.0F / (b[6] * u[i] + b[7] * v[i] + b[8]);
      const float px = (f[0] * x[i] + f[1] * y[i] + f[2]) * pz - u[i];
      const float py = (f[3] * x[i] + f[4] * y[i] + f[5]) * pz - v[i];
      const float qx = (b[0] * u[i] + b[1] * v[i] + b[2]) * qz - x[i];
      const float qy = (b[3] * u[i] + b[4] * v[i] + b[5]) * qz - y[i];
      errors[i] = 0.5F * ((px * px + py * py) + (qx * qx + qy * qy));
    }
    std::copy(errors.begin(), errors.end(), out.begin());
  }

  /// Refines a homography by Gauss-Newton on the transfer errors in both images.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 4);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    const auto step = [](const model& m, const homography_equations& e) -> std::optional<model> {
      const auto d = e.step();
      if (!d) return std::nullopt;
      return make_model(*d * m.forward);
    };
    return descend(
        start, steps, [&](const model& m) { return sum_up(m, inliers); }, step);
  }

 private:
  [[nodiscard]] static model make_model(const mat3& h) {
    model m{h / norm(h), inverse(h)};
    m.backward /= norm(m.backward);
    return m;
  }

  [[nodiscard]] homography_equations sum_up(const model& m, std::span<const std::uint32_t> inliers) const {
    homography_equations e;
    for (const std::uint32_t i : inliers) {
      const match& x = matches_[i];
      const auto add = [&](const vec3& p, const vec2& seen, const mat3& by_d, const vec3& moved) {
        const double inverse = 1.0 / p.z();
        const vec2 xy = head<2>(p) * inverse;
        e.add(xy - seen, derivative_of_projection(xy, inverse), by_d, moved);
      };
      const vec3 p = m.forward * homogeneous(x.first);
      add(p, x.second, identity<mat3>(), p);
      add(m.backward * homogeneous(x.second), x.first, -m.backward, homogeneous(x.second));
    }
    return e;
  }

  const std::vector<match>& matches_;
  std::array<std::vector<float>, 4> columns_;
};

}  // namespace orbis::optimize::detail
