// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The estimator of RANSAC for poses: samples of three matches, reprojection errors, refinement.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/detail/minimal/p3p_equations.hpp>
#include <orbis/optimize/detail/minimal/pnp_kernels.hpp>
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize::detail {

/// The normal equations of half the sum of squares for a motion on the left of the pose; `cost` is the sum of squares.
struct pose_equations {
  mat6 h;
  vec6 g;
  double cost;
};

/// Gauss-Newton on a pose; `sum_up(pose, equations)` fills in the equations.
template <class SumUp>
[[nodiscard]] std::optional<centred_pose> descend_pose(const centred_pose& start, int steps, const SumUp& sum_up) {
  struct state {
    so3 rotation;
    centred_pose pose;
  };
  const so3 rotation(start.rotation);  // those of samples are orthonormal only up to rounding and a little more
  const auto equations = [&](const state& s) {
    pose_equations e;
    sum_up(s.pose, e);
    return e;
  };
  const auto step = [](const state& s, const pose_equations& e) -> std::optional<state> {
    // A very small damping, so that directions stay that the matches do not determine.
    mat6 damped = e.h;
    change_diagonal(damped, 1.0 + 1e-9, 1e-12 * largest_of(diagonal_of(e.h)));
    small_cholesky<6> factors;
    if (!factors.set(damped) || !(factors.factor(0.0) > 0.0)) return std::nullopt;
    const vec6 d = -factors.solve(e.g);
    if (!(norm(tail<3>(d)) < 1.0)) return std::nullopt;  // also where it is not a number
    const se3 motion = se3::exp(d);
    const so3 turned = motion.rotation() * s.rotation;
    return state{turned, {turned.rotation_matrix(), motion * s.pose.translation}};
  };
  const auto found = descend(state{rotation, {rotation.rotation_matrix(), start.translation}}, steps, equations, step);
  if (!found) return std::nullopt;
  return found->pose;
}

/// P3P with reprojection errors in pixels.
template <class Matches>
class pnp_estimator {
 public:
  struct model {
    centred_pose pose;
    std::array<float, 12> rows{};  ///< the pose for the loops over the matches
  };
  static constexpr std::size_t sample_size = 3;

  /// Up to four models.
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
                   if (all.size != 4) all.models[all.size++] = made_of({rotation, translation});
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

  /// A few steps of Gauss-Newton.
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    return refine(start, inliers, 3);
  }
  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers,
                                            int steps) const {
    const std::size_t groups = gather(inliers);
    const auto pose =
        descend_pose(start.pose, steps, [&](const centred_pose& at, pose_equations& e) { sum_up(groups, at, e); });
    if (!pose) return std::nullopt;
    return made_of(*pose);
  }

  [[nodiscard]] static model made_of(const centred_pose& pose) {
    model m{pose, {}};
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column)
        m.rows[static_cast<std::size_t>(4 * row + column)] = static_cast<float>(pose.rotation(row, column));
      m.rows[static_cast<std::size_t>(4 * row + 3)] = static_cast<float>(pose.translation[row]);
    }
    return m;
  }

 private:
  /// Copies the named matches side by side and fills up with matches of no weight; returns the number of groups of
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
  match_kernels kernels_{};
};

/// Why the points themselves determine no pose; empty if they do.
[[nodiscard]] inline std::string pnp_degeneracy(const pnp_matches& matches) {
  mat3 covariance = zeros<mat3>();
  for (const vec3& p : matches.points) covariance += p * transposed(p);
  const vec3 spread = eigen_of_symmetric<3>(covariance).values;
  // Up to the rounding of the points about the origin of the world.
  const double rounding = 1e-30 * squared_norm(matches.centre) * static_cast<double>(matches.size());
  if (!(spread[2] > rounding)) return "the points all lie in one place";
  if (!(spread[1] > 1e-12 * spread[2])) return "the points all lie on one line";
  return {};
}

}  // namespace orbis::optimize::detail
