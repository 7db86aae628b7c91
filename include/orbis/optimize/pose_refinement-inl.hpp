// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of pose_refinement.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/pose/pose_kernels.hpp>
#include <orbis/optimize/pose_refinement.hpp>

namespace orbis::optimize {
namespace detail {

/// The observations of a refinement as a structure of arrays: packed once if they fit, otherwise chunk by chunk in
/// every pass. Observations that are not outliers are active.
class pose_pieces {
 public:
  pose_pieces(std::span<const pose_observation> observations, std::span<const std::uint8_t> outliers)
      : observations_{observations}, outliers_{outliers} {
    if (fits()) pack(0);
  }

  /// Returns true if an observation has positive information, and values whose squares are finite.
  [[nodiscard]] static bool usable(const pose_observation& o) {
    constexpr double most = 1e100;
    const double size = std::abs(o.point.x()) + std::abs(o.point.y()) + std::abs(o.point.z()) + std::abs(o.pixel.x()) +
                        std::abs(o.pixel.y()) + std::abs(o.smear.x()) + std::abs(o.smear.y()) + o.information;
    return size < most && o.information > 0.0 && !(std::abs(o.right) >= most);
  }

  /// Calls `f(lanes, first, count, padded)` for every chunk; `padded` is `count` rounded up to a multiple of eight.
  template <class F>
  void for_each(F&& f) {
    for (std::size_t first = 0; first < observations_.size(); first += pose_lanes::capacity) {
      if (!fits()) pack(first);
      const std::size_t count = std::min(observations_.size() - first, pose_lanes::capacity);
      f(std::as_const(lanes_), first, count, padded(count));
    }
  }

  /// Updates the active observations; call it after the outliers have changed.
  void update() {
    if (!fits()) return;
    for (std::size_t i = 0; i != observations_.size(); ++i)
      lanes_.active[i] = outliers_[i] == 0 ? lanes_.information[i] : 0.0;
  }

 private:
  [[nodiscard]] bool fits() const noexcept { return observations_.size() <= pose_lanes::capacity; }
  [[nodiscard]] static std::size_t padded(std::size_t count) noexcept {
    constexpr std::size_t width = 8;
    return (count + width - 1) / width * width;
  }

  void pack(std::size_t first) {
    const std::size_t count = std::min(observations_.size() - first, pose_lanes::capacity);
    const pose_observation nothing{.point = vec3(0.0, 0.0, 1.0), .information = 0.0};
    for (std::size_t i = 0; i != padded(count); ++i) {
      const bool use = i < count && usable(observations_[first + i]);
      pose_observation o = use ? observations_[first + i] : nothing;
      const double of_right = o.depth_weight * o.smear.x();  // the third residual contains the error of the column
      o = without_smear(o);
      o.depth_weight /= std::sqrt(1.0 + of_right * of_right);
      lanes_.x[i] = o.point.x();
      lanes_.y[i] = o.point.y();
      lanes_.z[i] = o.point.z();
      lanes_.u[i] = o.pixel.x();
      lanes_.v[i] = o.pixel.y();
      lanes_.right[i] = o.has_depth() ? o.right : 0.0;
      lanes_.depth_weight[i] = o.has_depth() ? o.depth_weight : 0.0;
      lanes_.information[i] = o.information;
      lanes_.active[i] = use && outliers_[first + i] == 0 ? o.information : 0.0;
    }
  }

  std::span<const pose_observation> observations_;
  std::span<const std::uint8_t> outliers_;
  pose_lanes lanes_;
};

struct pose_normal_equations {
  mat6 h;  ///< the lower triangle
  vec6 g;
  double cost;  ///< half the sum of the robust loss
};

/// A refinement with a given camera model.
template <class Camera>
class pose_refiner {
 public:
  pose_refiner(std::span<const pose_observation> observations, const Camera& camera, double bf, const se3& start,
               std::span<std::uint8_t> outliers, const pose_refinement_options& options)
      : observations_{observations},
        camera_{camera},
        bf_{bf},
        T_camera_world_{start.inverse()},
        outliers_{outliers},
        options_{options},
        pieces_{observations, outliers} {}

  /// Iterates until a step reduces the cost by less than the fraction `enough`.
  [[nodiscard]] refinement_status run_round(const huber& loss, double enough) {
    double lambda = 1e-6;
    pose_normal_equations now = linearize(T_camera_world_, loss);
    for (int k = 0; k < options_.iterations; ++k) {
      small_cholesky<6> cholesky;
      if (!cholesky.set(now.h) || !(cholesky.factor(0.0) > cholesky.determined)) return refinement_status::degenerate;
      bool accepted = false;
      double gain = 0.0;
      for (int attempt = 0; attempt < 8 && !accepted; ++attempt, lambda *= accepted ? 1.0 : 10.0) {
        if (!(cholesky.factor(lambda) > 0.0)) continue;
        const vec6 step = cholesky.solve(-now.g);
        if (!all_finite(step)) continue;
        // The model predicts a decrease of at least half of -g^T step.
        if (-dot(now.g, step) <= negligible * now.cost || squared_norm(step) < 1e-20)
          return refinement_status::converged;
        const se3 there = se3::exp(step) * T_camera_world_;
        const pose_normal_equations then = linearize(there, loss);
        if (!(then.cost < now.cost)) continue;
        accepted = true;
        gain = now.cost - then.cost;
        now = then;
        T_camera_world_ = there;
      }
      if (!accepted) return refinement_status::converged;
      ++steps_;
      lambda = std::max(1e-9, lambda * 0.1);
      if (gain <= enough * now.cost) return refinement_status::converged;
    }
    return refinement_status::iteration_limit;
  }

  /// Classifies every observation at the current pose as an inlier or an outlier. Returns true if any classification
  /// changed.
  bool apply_gates() {
    bool changed = false;
    inliers_ = 0;
    cost_ = 0.0;
    std::array<double, pose_lanes::capacity> chi2;
    const pose_at at = at_pose(T_camera_world_);
    auto* const judge = judge_pose_function<Camera>();
    pieces_.for_each([&](const pose_lanes& lanes, std::size_t first, std::size_t count, std::size_t padded) {
      judge(lanes, padded, camera_, at, chi2.data());
      for (std::size_t i = 0; i != count; ++i) {
        const double gate = observations_[first + i].has_depth() ? options_.gate_depth : options_.gate_mono;
        const bool inside = chi2[i] <= gate && chi2[i] < std::numeric_limits<double>::infinity();
        changed = changed || (outliers_[first + i] == 0) != inside;
        outliers_[first + i] = inside ? 0 : 1;
        inliers_ += inside ? 1U : 0U;
        cost_ += inside ? 0.5 * chi2[i] : 0.0;
      }
    });
    if (changed) pieces_.update();
    return changed;
  }

  [[nodiscard]] se3 T_world_camera() const { return T_camera_world_.inverse(); }
  [[nodiscard]] std::size_t inliers() const noexcept { return inliers_; }
  [[nodiscard]] double cost() const noexcept { return cost_; }
  [[nodiscard]] int steps() const noexcept { return steps_; }

 private:
  /// Relative decrease of the cost that is too small to distinguish from rounding errors.
  static constexpr double negligible = 1e-13;

  [[nodiscard]] pose_at at_pose(const se3& pose) const {
    return {pose.rotation_matrix(), pose.translation(), bf_, options_.gate_depth};
  }

  [[nodiscard]] pose_normal_equations linearize(const se3& pose, const huber& loss) {
    pose_normal_equations e{zeros<mat6>(), zeros<vec6>(), 0.0};
    const pose_at at = at_pose(pose);
    auto* const sum = sum_pose_function<Camera>();
    pieces_.for_each([&](const pose_lanes& lanes, std::size_t, std::size_t, std::size_t padded) {
      pose_sums s;
      sum(lanes, padded, camera_, at, loss, s);
      for (int row = 0, k = 0; row != 3; ++row)
        for (int column = 0; column <= row; ++column, ++k) {
          e.h(row, column) += s.translation[static_cast<std::size_t>(k)];
          e.h(3 + row, 3 + column) += s.rotation[static_cast<std::size_t>(k)];
        }
      for (int i = 0; i != 9; ++i) e.h(3 + i % 3, i / 3) += s.corner[static_cast<std::size_t>(i)];
      for (int i = 0; i != 6; ++i) e.g[i] += s.gradient[static_cast<std::size_t>(i)];
      e.cost += s.cost;
    });
    return e;
  }

  std::span<const pose_observation> observations_;
  const Camera& camera_;
  double bf_;
  se3 T_camera_world_;
  std::span<std::uint8_t> outliers_;
  const pose_refinement_options& options_;
  pose_pieces pieces_;
  std::size_t inliers_ = 0;
  double cost_ = 0.0;
  int steps_ = 0;
};

template <class Camera>
pose_refinement refine_pose(std::span<const pose_observation> observations, const Camera& camera, double bf,
                            const se3& T_world_camera, std::span<std::uint8_t> outliers,
                            const pose_refinement_options& options, const huber& loss) {
  pose_refinement out;
  out.T_world_camera = T_world_camera;
  const auto give_up = [&](refinement_status status) {
    std::fill(outliers.begin(), outliers.end(), std::uint8_t{1});
    out.status = status;
    return out;
  };
  if (!(largest_magnitude(T_world_camera.to_matrix()) < 1e100)) return give_up(refinement_status::invalid_start);

  std::size_t active = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    outliers[i] = pose_pieces::usable(observations[i]) ? 0 : 1;
    active += outliers[i] == 0;
  }
  if (active < 3) return give_up(refinement_status::too_few_observations);

  pose_refiner<Camera> refiner(observations, camera, bf, T_world_camera, outliers, options);
  bool changed = true;
  for (int round = 0; round < options.rounds; ++round) {
    const bool last = round + 1 == options.rounds;
    if (last)  // with an infinite width, this loss equals least squares, bit for bit
      out.status = refiner.run_round(huber{std::numeric_limits<double>::infinity()}, 1e-9);
    else if (changed || out.status != refinement_status::converged)
      out.status = refiner.run_round(loss, 1e-6);  // this round only needs to identify the outliers
    else
      continue;  // the problem is the same as in the previous round
    if (out.status == refinement_status::degenerate) return give_up(out.status);
    changed = refiner.apply_gates();
    if (refiner.inliers() < 3) return give_up(refinement_status::too_few_observations);
  }
  if (options.rounds <= 0) {  // classification only
    out.status = refinement_status::iteration_limit;
    refiner.apply_gates();
    if (refiner.inliers() < 3) return give_up(refinement_status::too_few_observations);
  }
  out.inliers = refiner.inliers();
  out.cost = refiner.cost();
  out.iterations = refiner.steps();
  out.T_world_camera = refiner.T_world_camera();
  return out;
}

}  // namespace detail

}  // namespace orbis::optimize
