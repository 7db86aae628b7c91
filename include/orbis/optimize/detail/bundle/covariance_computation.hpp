// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The computation of the covariances of bundle adjustment; see `covariance_of`.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_equations.hpp>
#include <orbis/core/small_cholesky.hpp>

namespace orbis::optimize::detail {

/// Whether the information of a point is regular: every direction is determined.
[[nodiscard]] inline bool is_determined(const mat3& v) {
  for (int k = 0; k != 9; ++k)
    if (!std::isfinite(v.data()[k])) return false;
  if (!(v(0, 0) > 0.0) || !(v(1, 1) > 0.0) || !(v(2, 2) > 0.0)) return false;
  const double a = v(0, 1) / std::sqrt(v(0, 0) * v(1, 1)), b = v(0, 2) / std::sqrt(v(0, 0) * v(2, 2)),
               c = v(1, 2) / std::sqrt(v(1, 1) * v(2, 2));
  return 1.0 + 2.0 * a * b * c - a * a - b * b - c * c > 1e-12;
}

/// One computation, with options `Options` and the result `Output`.
template <camera_frame_residual R, robust_loss Loss, reduced_solver Reduced, class Options, class Output>
class covariance_computation {
 public:
  using camera_state = typename R::camera_state;
  using observation = typename R::observation;
  using status_type = decltype(Output::status);

  covariance_computation(const R& residual, const Loss& loss, const Reduced& reduced)
      : equations_{residual, loss, reduced} {}

  template <class Policy>
  Output run(const Policy& policy, std::span<const camera_state> cameras, std::span<const vec3> points,
             std::span<const observation> observations, const Options& options) {
    Output out;
    for (std::size_t k = 0; k != observations.size(); ++k) {
      if (observations[k].pose < cameras.size() && observations[k].point < points.size()) continue;
      out.status = observations[k].pose < cameras.size() ? status_type::missing_point : status_type::missing_pose;
      out.where = k;
      return out;
    }
    linearize(policy, cameras, points, observations, options);
    if (points_ == 0) return out;
    out.status = status_type::undetermined_camera;
    if (!equations_.eliminate(policy, Eigen::VectorXd{}) || !equations_.factor()) {
      out.where = equations_.failed_camera();
      return out;
    }
    invert_reduced();
    if (const std::size_t weak = undetermined_unknown(); weak != unknowns_) {
      out.where = structure().camera[weak];
      return out;
    }
    out.status = status_type::done;
    write_cameras(out, cameras.size(), options);
    write_points(policy, out, points.size(), options);
    return out;
  }

 private:
  static constexpr int camera_size = R::camera_manifold::dimension;
  using camera_block = matrix<camera_size, camera_size>;
  /// A coordinate whose variance is larger than this times what its own observations alone would give is not
  /// determined.
  static constexpr double weakest = 1e12;

  [[nodiscard]] const bundle_structure& structure() const { return equations_.structure(); }

  /// The normal equations without the points that are not determined.
  template <class Policy>
  void linearize(const Policy& policy, std::span<const camera_state> cameras, std::span<const vec3> points,
                 std::span<const observation> observations, const Options& options) {
    assert(options.fixed_poses.empty() || options.fixed_poses.size() == cameras.size());
    assert(options.fixed_points.empty() || options.fixed_points.size() == points.size());
    assert(options.ignored.empty() || options.ignored.size() == observations.size());
    ignored_.assign(observations.size(), 0);
    std::copy(options.ignored.begin(), options.ignored.end(), ignored_.begin());
    const auto attempt = [&] {
      equations_.set_structure(cameras.size(), points.size(), observations, options.fixed_poses,
                               options.hold == bundle_gauge::first_camera);
      bundle_summary counts;
      bundle_options as_options;
      as_options.fixed_points = options.fixed_points;
      as_options.ignored = ignored_;
      equations_.begin(policy, cameras, points, as_options, counts);
      equations_.linearize(policy);
      unknowns_ = structure().unknowns();
      points_ = counts.observations == 0 ? 0 : structure().points();
      if (points_ == 0) unknowns_ = 0;
    };
    attempt();
    is_fixed_point_.assign(points.size(), 0);
    std::copy(options.fixed_points.begin(), options.fixed_points.end(), is_fixed_point_.begin());
    is_weak_.assign(points.size(), 0);
    bool any = false;
    for (std::size_t p = 0; p != points_; ++p) {
      const std::size_t source = structure().point_source[p];
      if (is_fixed_point_[source] != 0 || is_determined(equations_.point_hessian(p))) continue;
      is_weak_[source] = 1;
      any = any || !equations_.point_hessian(p).isZero(0.0);
    }
    if (!any) return;
    for (std::size_t k = 0; k != observations.size(); ++k)
      if (is_weak_[observations[k].point] != 0) ignored_[k] = 1;
    attempt();
  }
  /// Not fixed, and determined by its observations.
  [[nodiscard]] bool moves_point(std::size_t p) const {
    const std::size_t source = structure().point_source[p];
    return is_fixed_point_[source] == 0 && is_weak_[source] == 0;
  }
  /// Whether no observation by this camera takes part.
  [[nodiscard]] bool is_blind(std::size_t u) const { return equations_.camera_hessian(u).isZero(0.0); }

  /// The blocks of the inverse of the reduced system where the system itself has blocks.
  void invert_reduced() {
    block_at_.assign(structure().slots.size(), zeros<camera_block>());
    std::vector<std::vector<std::uint32_t>> slots_of(unknowns_);
    for (std::uint32_t s = 0; s != structure().slots.size(); ++s) slots_of[structure().slots[s].column].push_back(s);
    std::vector<double> x(camera_size * unknowns_);
    for (std::size_t u = 0; u != unknowns_; ++u)
      for (int c = 0; c != camera_size; ++c) {
        std::fill(x.begin(), x.end(), 0.0);
        x[camera_size * u + static_cast<std::size_t>(c)] = 1.0;
        equations_.solve_reduced(x);
        for (const std::uint32_t s : slots_of[u])
          block_at_[s].col(c) =
              Eigen::Map<const matrix<camera_size>>(x.data() + camera_size * std::size_t{structure().slots[s].row});
      }
  }

  /// A camera with a coordinate that its observations do not determine; `unknowns_` if there is none.
  [[nodiscard]] std::size_t undetermined_unknown() const {
    for (std::size_t s = 0; s != structure().slots.size(); ++s) {
      const block_place& slot = structure().slots[s];
      if (slot.row != slot.column || is_blind(slot.row)) continue;
      const camera_block& own = equations_.camera_hessian(slot.row);
      for (int i = 0; i != camera_size; ++i)
        if (!(own(i, i) > 0.0) || !(block_at_[s](i, i) > 0.0) || !(block_at_[s](i, i) * own(i, i) < weakest))
          return slot.row;
    }
    return unknowns_;
  }

  void write_cameras(Output& out, std::size_t cameras, const Options& options) const {
    out.cameras.assign(cameras, zeros<camera_block>());
    for (std::size_t c = 0; c != cameras; ++c) {
      const std::uint32_t u = structure().unknown[c];
      const bool is_fixed = !options.fixed_poses.empty() && options.fixed_poses[c] != 0;
      if (u == bundle_structure::none ? structure().count[c] == 0 && !is_fixed : is_blind(u))
        out.cameras[c].setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    for (std::size_t s = 0; s != structure().slots.size(); ++s) {
      const block_place& slot = structure().slots[s];
      if (slot.row != slot.column || is_blind(slot.row)) continue;
      out.cameras[structure().camera[slot.row]] = 0.5 * (block_at_[s] + transposed(block_at_[s]));
    }
  }

  /// V^-1 + V^-1 W^T S^-1 W V^-1, of which the sum over pairs of cameras takes most.
  template <class Policy>
  void write_points(const Policy& policy, Output& out, std::size_t points, const Options& options) const {
    out.points.assign(points, filled<mat3>(std::numeric_limits<double>::quiet_NaN()));
    for (std::size_t j = 0; j != points; ++j)
      if (!options.fixed_points.empty() && options.fixed_points[j] != 0) out.points[j].setZero();
    if (points_ == 0) return;
    for_each_index(policy, structure().groups.size(), 16, [&](std::size_t k) {
      const bundle_structure::group& g = structure().groups[k];
      for (std::size_t i = 0; i != g.points; ++i) write_point(out, g, i);
    });
  }
  void write_point(Output& out, const bundle_structure::group& g, std::size_t i) const {
    const std::size_t p = g.first_point + i, source = structure().point_source[p];
    if (!moves_point(p)) return;
    const auto number = [&](std::size_t a) { return g.first_mixed + a * g.points + i; };
    mat3 sum = zeros<mat3>();
    std::size_t pair = g.first_pair;
    for (std::size_t a = 0; a != g.cameras; ++a) {
      const auto own = equations_.mixed_block(number(a));
      sum += transposed(own) * block_at_[structure().diagonal_slot[structure().mixed_unknown[number(a)]]] * own;
      for (std::size_t b = 0; b != a; ++b, ++pair) {
        const mat3 share = transposed(own) * block_at_[structure().pair_slot[pair]] * equations_.mixed_block(number(b));
        sum += share + transposed(share);
      }
    }
    const mat3 inverse = point_inverse(p);
    const mat3 block = inverse + inverse * sum * inverse;
    out.points[source] = 0.5 * (block + transposed(block));
  }

  [[nodiscard]] mat3 point_inverse(std::size_t p) const {
    small_cholesky<3> factors;
    const bool is_definite = factors.set(equations_.point_hessian(p)) && factors.factor(0.0) > 0.0;
    return is_definite ? factors.inverse() : filled<mat3>(std::numeric_limits<double>::quiet_NaN());
  }

  bundle_equations<R, Loss, Reduced> equations_;
  std::size_t unknowns_ = 0, points_ = 0;
  std::vector<std::uint8_t> ignored_, is_fixed_point_, is_weak_;
  std::vector<camera_block> block_at_;  // of the inverse
};

}  // namespace orbis::optimize::detail
