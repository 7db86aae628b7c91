// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RANSAC estimator of poses: samples of three matches, reprojection errors, refinement.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/detail/minimal/p3p_equations.hpp>
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
#include <orbis/optimize/detail/unroll.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize::detail {

// The two loops of PnP over the matches: reprojection errors and normal equations. Every instruction set gives the same
// bits.

/// Computes the squared errors of 32 matches. `columns` are the lists of coordinates, `stride` apart; `pose` is the
/// rotation row by row, with the translation as a fourth column.
using match_errors = void(const float* columns, std::size_t stride, const float* pose, float* out);

/// Computes the normal equations of `groups` groups of four matches: the lower triangle of H row by row (21 values), g
/// (6) and the sum of squared errors, as four partial sums each.
using match_equations = void(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                             double* out);
inline constexpr int equation_sums = 28;

/// Returns the product of row `row` of the pose and the point.
template <class V, class S>
[[nodiscard]] ORBIS_ALWAYS_INLINE V moved(const S* row, const V& x, const V& y, const V& z) noexcept {
  return ((row[3] + row[0] * x) + row[1] * y) + row[2] * z;
}

struct match_errors_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* columns, std::size_t stride, const float* pose, float* out) {
    using V = simd::vec<float, Target::bytes / sizeof(float), Target>;
    for (std::size_t i = 0; i != 32; i += V::count) {
      const auto at = [&](std::size_t k) ORBIS_INLINE_LAMBDA { return V::load(columns + k * stride + i); };
      const V px = at(0), py = at(1), pz = at(2);
      const V z = moved(pose + 8, px, py, pz), x = moved(pose, px, py, pz), y = moved(pose + 4, px, py, pz);
      const V inverse = 1.0F / z;
      const V dx = x * inverse - at(3), dy = y * inverse - at(4);
      const V u = at(5) * dx + at(6) * dy, v = at(7) * dy;
      select(V(0.0F) < z, u * u + v * v, V(std::numeric_limits<float>::infinity())).store(out + i);
    }
  }
};

struct match_equations_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* columns, std::size_t stride, std::size_t groups, const double* pose,
                                      double* out) {
    using V = simd::vec<double, 4, Target>;
    V sums[equation_sums];
    unroll<equation_sums>([&](auto k) ORBIS_INLINE_LAMBDA { sums[k] = 0.0; });
    for (std::size_t group = 0; group != groups; ++group) {
      const auto at = [&](std::size_t k) ORBIS_INLINE_LAMBDA { return V::load(columns + k * stride + 4 * group); };
      const V px = at(0), py = at(1), pz = at(2);
      const V p0 = moved(pose, px, py, pz), p1 = moved(pose + 4, px, py, pz), p2 = moved(pose + 8, px, py, pz);
      const V inverse = 1.0 / p2, xx = at(5), xy = at(6), yy = at(7);
      const V x = p0 * inverse, y = p1 * inverse;
      const V dx = x - at(3), dy = y - at(4);
      const V u = xx * dx + xy * dy, v = yy * dy;
      // The derivatives of u and v with respect to the point, then to a motion of the point: rho + phi x p.
      V a[6], b[6];
      a[0] = xx * inverse;
      a[1] = xy * inverse;
      a[2] = -(a[0] * x + a[1] * y);
      a[3] = p1 * a[2] - p2 * a[1];
      a[4] = p2 * a[0] - p0 * a[2];
      a[5] = p0 * a[1] - p1 * a[0];
      b[1] = yy * inverse;
      b[2] = -(b[1] * y);
      b[3] = p1 * b[2] - p2 * b[1];
      b[4] = -(p0 * b[2]);
      b[5] = p0 * b[1];
      unroll<6>([&](auto r) ORBIS_INLINE_LAMBDA {
        unroll<r + 1>([&](auto c) ORBIS_INLINE_LAMBDA {
          constexpr int k = r * (r + 1) / 2 + c;
          sums[k] += a[r] * a[c];
          if constexpr (c != 0) sums[k] += b[r] * b[c];
        });
        sums[21 + r] += a[r] * u;
        if constexpr (r != 0) sums[21 + r] += b[r] * v;
      });
      sums[27] += u * u;
      sums[27] += v * v;
    }
    unroll<equation_sums>([&](auto k) ORBIS_INLINE_LAMBDA { sums[k].store(out + 4 * k); });
  }
};

/// Pointers to the loops for this processor's instruction set.
template <class = void>
struct match_kernels {
  match_errors* errors = simd::kernel<match_errors_kernel, match_errors>();
  match_equations* equations = simd::kernel<match_equations_kernel, match_equations>();
};

/// The normal equations of half the sum of squares, for a motion applied on the left of the pose; `cost` is the sum of
/// squares.
struct pose_equations {
  mat6 h;
  vec6 g;
  double cost;
};

/// Refines a pose by Gauss-Newton; `sum_up(pose, equations)` computes the equations.
template <class SumUp>
[[nodiscard]] std::optional<centred_pose> descend_pose(const centred_pose& start, int steps, const SumUp& sum_up) {
  struct state {
    so3 rotation;
    centred_pose pose;
  };
  // Rotations from samples are orthonormal only to slightly more than the rounding error.
  const so3 rotation(start.rotation);
  const auto equations = [&](const state& s) {
    pose_equations e;
    sum_up(s.pose, e);
    return e;
  };
  const auto step = [](const state& s, const pose_equations& e) -> std::optional<state> {
    // A very small damping leaves the pose unchanged in directions that the matches do not determine.
    mat6 damped = e.h;
    change_diagonal(damped, 1.0 + 1e-9, 1e-12 * max_entry(diagonal(e.h)));
    small_cholesky<6> factors;
    if (!factors.set(damped) || !(factors.factor(0.0) > 0.0)) return std::nullopt;
    const vec6 d = -factors.solve(e.g);
    if (!(norm(tail<3>(d)) < 1.0)) return std::nullopt;  // also rejects NaN
    const se3 motion = se3::exp(d);
    const so3 turned = motion.rotation() * s.rotation;
    return state{turned, {turned.rotation_matrix(), motion * s.pose.translation}};
  };
  const auto found = descend(state{rotation, {rotation.rotation_matrix(), start.translation}}, steps, equations, step);
  if (!found) return std::nullopt;
  return found->pose;
}

/// The RANSAC estimator for P3P, with reprojection errors in pixels.
template <class Matches>
class pnp_estimator {
 public:
  struct model {
    centred_pose pose;
    std::array<float, 12> rows{};  ///< the pose as read by the loops over the matches
  };
  static constexpr std::size_t sample_size = 3;

  /// Up to four candidate models.
  struct candidates {
    std::array<model, 4> models;
    std::size_t size = 0;
    [[nodiscard]] const model* begin() const noexcept { return models.data(); }
    [[nodiscard]] const model* end() const noexcept { return models.data() + size; }
  };

  explicit pnp_estimator(Matches& matches) : matches_{matches} {}

  [[nodiscard]] std::size_t size() const noexcept { return matches_.size(); }

  [[nodiscard]] candidates fit(const std::array<std::uint32_t, 3>& s) const {
    candidates all;
    for_each_p3p({matches_.points[s[0]], matches_.points[s[1]], matches_.points[s[2]]},
                 {matches_.rays[s[0]], matches_.rays[s[1]], matches_.rays[s[2]]},
                 [&](const mat3& rotation, const vec3& translation) {
                   if (all.size != 4) all.models[all.size++] = make_model({rotation, translation});
                 });
    return all;
  }

  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    kernels_.errors(matches_.float_columns.data() + first, matches_.stride, m.rows.data(), out.data());
  }

  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const vec3 p = m.pose.rotation * matches_.points[i] + m.pose.translation;
    if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();
    const double* const c = matches_.columns.data() + i;
    const std::size_t s = matches_.stride;
    const double dx = p.x() / p.z() - c[3 * s], dy = p.y() / p.z() - c[4 * s];
    const double u = c[5 * s] * dx + c[6 * s] * dy, v = c[7 * s] * dy;
    return u * u + v * v;
  }

  /// Refines a model by a few Gauss-Newton steps.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 3);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    const std::size_t groups = gather(inliers);
    const auto pose =
        descend_pose(start.pose, steps, [&](const centred_pose& at, pose_equations& e) { sum_up(groups, at, e); });
    if (!pose) return std::nullopt;
    return make_model(*pose);
  }

  [[nodiscard]] static model make_model(const centred_pose& pose) {
    model m{pose, {}};
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column)
        m.rows[static_cast<std::size_t>(4 * row + column)] = static_cast<float>(pose.rotation(row, column));
      m.rows[static_cast<std::size_t>(4 * row + 3)] = static_cast<float>(pose.translation[row]);
    }
    return m;
  }

 private:
  /// Copies the given matches to contiguous memory, padded with matches of zero weight; returns the number of groups of
  /// four.
  [[nodiscard]] std::size_t gather(std::span<const std::uint32_t> inliers) const {
    const std::size_t groups = (inliers.size() + 3) / 4;
    auto& g = matches_.gathered;
    g.resize(match_coordinates * matches_.stride);
    for (std::size_t k = 0; k != match_coordinates; ++k) {
      const double* const from = matches_.columns.data() + k * matches_.stride;
      double* const to = g.data() + k * matches_.stride;
      for (std::size_t i = 0; i != inliers.size(); ++i) to[i] = from[inliers[i]];
      for (std::size_t i = inliers.size(); i != 4 * groups; ++i) to[i] = k < 5 ? from[inliers[0]] : 0.0;
    }
    return groups;
  }

  void sum_up(std::size_t groups, const centred_pose& pose, pose_equations& e) const {
    std::array<double, 12> rows;
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column)
        rows[static_cast<std::size_t>(4 * row + column)] = pose.rotation(row, column);
      rows[static_cast<std::size_t>(4 * row + 3)] = pose.translation[row];
    }
    std::array<double, std::size_t{4} * equation_sums> sums;
    kernels_.equations(matches_.gathered.data(), matches_.stride, groups, rows.data(), sums.data());
    const auto total = [&](std::size_t k) {
      return (sums[4 * k] + sums[4 * k + 2]) + (sums[4 * k + 1] + sums[4 * k + 3]);
    };
    std::size_t at = 0;
    for (int a = 0; a != 6; ++a)
      for (int b = 0; b <= a; ++b) e.h(a, b) = e.h(b, a) = total(at++);
    for (int a = 0; a != 6; ++a) e.g[a] = total(at++);
    e.cost = total(at);
  }

  Matches& matches_;
  match_kernels<> kernels_{};
};

/// Returns the reason why the points do not determine a pose; empty if they do.
[[nodiscard]] inline std::string pnp_degeneracy(const pnp_matches& matches) {
  mat3 covariance = zeros<mat3>();
  for (const vec3& p : matches.points) covariance += p * transposed(p);
  const vec3 spread = eigen_of_symmetric<3>(covariance).values;
  // Relative to the rounding error of the points, which depends on their distance from the world origin.
  const double rounding = 1e-30 * squared_norm(matches.centre) * static_cast<double>(matches.size());
  if (!(spread[2] > rounding)) return "all points coincide";
  if (!(spread[1] > 1e-12 * spread[2])) return "all points are collinear";
  return {};
}

}  // namespace orbis::optimize::detail
