// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RANSAC estimator of homographies between the rays of two cameras of any model, with errors in the unit of their
/// metric: usually pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>
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

/// Normal equations of transfer errors for D in (I + D) H, row by row; the last entry of D is 0. Only the lower
/// triangle of `h` is used. `cost` is the sum of squares.
struct homography_equations {
  matrix<9, 9> h = zeros<matrix<9, 9>>();
  matrix<9> g = zeros<matrix<9>>();
  double cost = 0.0;

  /// Adds the error `r` of a point. `by_point` is the derivative of `r` with respect to the point before projection; a
  /// small D moves that point by `by_d * D * moved`.
  void add(const vec2& r, const matrix<2, 3>& by_point, const mat3& by_d, const vec3& moved) {
    // The derivative with respect to entry (i, k) of D is column i of `a` times entry k of `moved`.
    const matrix<2, 3> a = by_point * by_d;
    const mat3 squares = transposed(a) * a, products = outer_product(moved, moved);
    const vec3 pull = transposed(a) * r;
    for (int i = 0; i != 3; ++i) {
      for (int j = 0; j <= i; ++j)
        for (int k = 0; k != 3; ++k)
          for (int l = 0; l != 3; ++l) h(3 * i + k, 3 * j + l) += squares(i, j) * products(k, l);
      for (int k = 0; k != 3; ++k) g[3 * i + k] += pull[i] * moved[k];
    }
    cost += squared_norm(r);
  }
  /// Returns I + D for a Gauss-Newton step; empty if the equations do not determine a step.
  [[nodiscard]] std::optional<mat3> step() const {
    small_cholesky<8> factors;
    if (!factors.set(block<8, 8>(h, 0, 0)) || !(factors.factor(1e-9) > 0.0)) return std::nullopt;
    const matrix<8> entries = -factors.solve(head<8>(g));
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

/// Returns the squared distance, in the unit of `metric_ray`, of a transferred ray from the observed one; infinite if
/// the transferred ray points behind the camera.
[[nodiscard]] inline double squared_transfer(const vec3& p, const metric_ray& seen) {
  if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();
  const double dx = p.x() / p.z() - seen.x, dy = p.y() / p.z() - seen.y;
  const double u = seen.xx * dx + seen.xy * dy, v = seen.yy * dy;
  return u * u + v * v;
}

/// Estimates a homography from matches of rays. For matches of pixels, the rays are centred and scaled pixels, with the
/// identity as their metric.
template <class = void>
class basic_homography_estimator {
 public:
  struct model {
    mat3 forward, backward;  ///< both matrices give positive z for rays that are transferred to the front of the camera
  };
  static constexpr std::size_t sample_size = 4;

  explicit basic_homography_estimator(const std::vector<image_match>& matches) : matches_{matches} {
    const std::size_t size = (matches.size() + consensus_block - 1) / consensus_block * consensus_block;
    for (auto& column : columns_) column.resize(size);
    for (std::size_t i = 0; i != matches.size(); ++i) {
      std::size_t next = 0;
      for (const metric_ray& r : {matches[i].first, matches[i].second})
        for (const double v : {r.x, r.y, r.xx, r.xy, r.yy}) columns_[next++][i] = static_cast<float>(v);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }

  [[nodiscard]] one_or_none<model> fit(const std::array<std::uint32_t, 4>& s) const {
    std::array<vec2, 4> first, second;
    for (std::size_t i = 0; i != 4; ++i) {
      const image_match& m = matches_[s[i]];
      first[i] = {m.first.x, m.first.y};
      second[i] = {m.second.x, m.second.y};
    }
    const auto h = homography_of_four(first, second);
    if (!h) return {};
    return {make_model(*h, matches_[s[0]].first.direction())};
  }

  /// Returns the mean of the squared errors of both transfers.
  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const image_match& x = matches_[i];
    return 0.5 * (squared_transfer(m.forward * x.first.direction(), x.second) +
                  squared_transfer(m.backward * x.second.direction(), x.first));
  }

  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    std::array<float, consensus_block> errors;
    add_transfers<false>(m.forward, first, columns_.data(), columns_.data() + 5, errors);
    add_transfers<true>(m.backward, first, columns_.data() + 5, columns_.data(), errors);
    std::copy(errors.begin(), errors.end(), out.begin());
  }

  /// Refines a homography by Gauss-Newton on the transfer errors in both images.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 4);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    if (inliers.empty()) return std::nullopt;
    const vec3 in_front = matches_[inliers.front()].first.direction();
    const auto step = [&](const model& m, const homography_equations& e) -> std::optional<model> {
      const auto d = e.step();
      if (!d) return std::nullopt;
      return make_model(*d * m.forward, in_front);
    };
    return descend(
        start, steps, [&](const model& m) { return sum_up(m, inliers); }, step);
  }

 private:
  using column = std::vector<float>;

  /// Creates a model from a homography; empty if the homography is singular.
  [[nodiscard]] static std::optional<model> make_model(const mat3& h, const vec3& in_front) {
    model m{h / norm(h), inverse(h)};
    if ((m.forward * in_front).z() < 0.0) m.forward = -m.forward;
    m.backward /= norm(m.backward);
    if ((m.backward * (m.forward * in_front)).z() < 0.0) m.backward = -m.backward;
    if (!all_finite(m.forward) || !all_finite(m.backward)) return std::nullopt;
    return m;
  }

  /// Sets `errors` to half the `squared_transfer` of a block of matches, or adds it. Rays that are transferred behind
  /// the camera are rare; they are only excluded from the inliers.
  template <bool Add>
  static void add_transfers(const mat3& h, std::size_t first, const column* from, const column* to,
                            std::array<float, consensus_block>& errors) {
    std::array<float, 9> m;
    for (int k = 0; k != 9; ++k) m[static_cast<std::size_t>(k)] = static_cast<float>(h(k / 3, k % 3));
    const float *const x = from[0].data() + first, *const y = from[1].data() + first;
    const float *const u = to[0].data() + first, *const v = to[1].data() + first;
    const float *const xx = to[2].data() + first, *const xy = to[3].data() + first, *const yy = to[4].data() + first;
    for (std::size_t i = 0; i != consensus_block; ++i) {
      const float inverse = 1.0F / (m[6] * x[i] + m[7] * y[i] + m[8]);
      const float dx = (m[0] * x[i] + m[1] * y[i] + m[2]) * inverse - u[i];
      const float dy = (m[3] * x[i] + m[4] * y[i] + m[5]) * inverse - v[i];
      const float a = xx[i] * dx + xy[i] * dy, b = yy[i] * dy;
      const float error = 0.5F * (a * a + b * b);
      errors[i] = Add ? errors[i] + error : error;
    }
  }

  [[nodiscard]] homography_equations sum_up(const model& m, std::span<const std::uint32_t> inliers) const {
    homography_equations e;
    for (const std::uint32_t i : inliers) {
      const image_match& x = matches_[i];
      const auto add = [&](const vec3& p, const metric_ray& seen, const mat3& by_d, const vec3& moved) {
        const double inverse = 1.0 / p.z();
        const vec2 xy = head<2>(p) * inverse;
        mat2 metric;
        metric << seen.xx, seen.xy, 0.0, seen.yy;
        const vec2 r = metric * vec2(xy.x() - seen.x, xy.y() - seen.y);
        e.add(r, metric * derivative_of_projection(xy, inverse), by_d, moved);
      };
      const vec3 p = m.forward * x.first.direction();
      add(p, x.second, identity<mat3>(), p);
      add(m.backward * x.second.direction(), x.first, -m.backward, x.second.direction());
    }
    return e;
  }

  const std::vector<image_match>& matches_;
  std::array<column, 10> columns_;  // x, y, xx, xy and yy of the first and of the second rays
};
using homography_estimator = basic_homography_estimator<>;

}  // namespace orbis::optimize::detail
