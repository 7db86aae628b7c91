// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment: poses and points that together explain all observations best.
///
/// Levenberg-Marquardt on the caller's arrays. Points are eliminated by the Schur complement, the
/// reduced system of the free poses is solved densely: made for the tens of keyframes of a local map.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <orbis/core/execution.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

/// Point `point` seen by camera `pose`, both as indices into the caller's arrays.
struct bundle_observation {
  std::uint32_t pose = 0;
  std::uint32_t point = 0;
  vec2 pixel = vec2::Zero();
  double right = std::numeric_limits<double>::quiet_NaN();  ///< as in `pose_observation`
  double information = 1.0;                                 ///< 1 / sigma^2 of the pixel, 1 / pixel^2
};

struct bundle_options {
  int max_iterations = 10;
  double relative_tolerance = 1e-6;             ///< ends when a step lowers the cost by less than this share
  std::span<const std::uint8_t> fixed_poses{};  ///< empty, or one for each pose: not 0 keeps it where it is
  std::span<const std::uint8_t> ignored{};      ///< empty, or one for each observation: not 0 leaves it out
  progress callback{};                          ///< called with (iteration, max_iterations)
};

enum class bundle_status {
  converged,
  iteration_limit,
  nothing_to_do,  ///< no usable observation
  no_progress,    ///< no damping gave a step that lowers the cost; the arrays are untouched since the last one that did
  cancelled
};

[[nodiscard]] constexpr std::string_view to_string(bundle_status status) noexcept {
  switch (status) {
    case bundle_status::converged: return "converged";
    case bundle_status::iteration_limit: return "iteration limit";
    case bundle_status::nothing_to_do: return "nothing to do";
    case bundle_status::no_progress: return "no progress";
    case bundle_status::cancelled: return "cancelled";
  }
  return "unknown";
}

struct bundle_summary {
  bundle_status status = bundle_status::nothing_to_do;
  double initial_cost = 0.0;  ///< half the sum of the robust loss over the observations
  double final_cost = 0.0;    ///< never above `initial_cost`
  int iterations = 0;         ///< accepted steps
  std::size_t observations = 0;
};

/// Made of a residual and a robust loss: `bundle_adjuster ba{reprojection{camera}, huber{2.45}};`.
/// Keeps its working memory for the next call; not for several threads at once.
template <camera::camera_model Camera, robust_loss Loss = huber>
class bundle_adjuster {
 public:
  explicit bundle_adjuster(reprojection<Camera> model, Loss loss = Loss{}) : model_{std::move(model)}, loss_{loss} {}

  /// Whitened squared residual of one observation; infinite without a projection.
  [[nodiscard]] double chi2(const se3& T_world_camera, const vec3& point, const bundle_observation& o) const {
    const auto r = model_.residual(T_world_camera.inverse() * point, as_pose_observation(o));
    return r ? o.information * r->squaredNorm() : std::numeric_limits<double>::infinity();
  }

  /// Moves `T_world_camera` (those that are not fixed) and `points` so that the robust cost falls;
  /// never leaves them worse than they were. Observations that are not finite, or that have no
  /// projection at the start, take no part. The same result for every policy.
  /// Without any fixed pose the gauge is held by the damping alone.
  /// @pre the observations' indices are in range, the options' spans empty or of matching length
  template <execution_policy Policy>
  bundle_summary solve(const Policy& policy, std::span<se3> T_world_camera, std::span<vec3> points,
                       std::span<const bundle_observation> observations, const bundle_options& options = {}) {
    bundle_summary summary;
    set_up(T_world_camera, points, observations, options);
    summary.observations = active_.size();
    if (active_.empty()) return summary;

    double cost = linearize(policy);
    summary.initial_cost = summary.final_cost = cost;
    double lambda = 1e-4;
    summary.status = bundle_status::iteration_limit;
    for (int k = 0; k < options.max_iterations; ++k) {
      if (!options.callback(static_cast<std::size_t>(k), static_cast<std::size_t>(options.max_iterations))) {
        summary.status = bundle_status::cancelled;
        break;
      }
      double gain = -1.0;
      for (int attempt = 0; attempt < 10 && gain < 0.0; ++attempt) {
        if (compute_step(policy, lambda)) {
          const double candidate = candidate_cost(policy);
          if (candidate <= cost) gain = cost - candidate;
        }
        if (gain < 0.0) lambda *= 10.0;
      }
      if (gain < 0.0) {
        summary.status = bundle_status::no_progress;
        break;
      }
      poses_.swap(candidate_poses_);
      positions_.swap(candidate_positions_);
      ++summary.iterations;
      lambda = std::max(1e-10, 0.2 * lambda);
      const bool small = gain <= options.relative_tolerance * cost;
      cost -= gain;
      if (small) {
        summary.status = bundle_status::converged;
        break;
      }
      if (k + 1 < options.max_iterations) cost = linearize(policy);
    }
    summary.final_cost = cost;
    for (std::size_t i = 0; i < T_world_camera.size(); ++i)
      if (free_[i] != fixed) T_world_camera[i] = poses_[i].inverse();
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = positions_[i];
    return summary;
  }

 private:
  using mat63 = matrix<6, 3>;
  static constexpr std::uint32_t fixed = std::numeric_limits<std::uint32_t>::max();
  /// Cost of an observation that a step throws behind its camera: more than any step could gain.
  static constexpr double behind = 1e6;

  /// The share of a run of points in the reduced system.
  struct partial {
    Eigen::MatrixXd schur;
    Eigen::VectorXd gradient;
    double cost = 0.0;
  };

  [[nodiscard]] static pose_observation as_pose_observation(const bundle_observation& o) {
    pose_observation p;
    p.pixel = o.pixel;
    p.right = o.right;
    p.information = o.information;
    return p;
  }

  void set_up(std::span<const se3> T_world_camera, std::span<const vec3> points,
              std::span<const bundle_observation> observations, const bundle_options& options) {
    assert(options.fixed_poses.empty() || options.fixed_poses.size() == T_world_camera.size());
    assert(options.ignored.empty() || options.ignored.size() == observations.size());
    observations_ = observations;
    poses_.resize(T_world_camera.size());
    for (std::size_t i = 0; i < poses_.size(); ++i) poses_[i] = T_world_camera[i].inverse();
    positions_.assign(points.begin(), points.end());

    // Active observations, those of a point together.
    const auto is_active = [&](std::size_t k) {
      const bundle_observation& o = observations[k];
      assert(o.pose < poses_.size() && o.point < positions_.size());
      if (!options.ignored.empty() && options.ignored[k] != 0) return false;
      if (!(o.information > 0.0) || !std::isfinite(o.information) || !o.pixel.allFinite() || std::isinf(o.right))
        return false;
      const auto r = model_.residual(poses_[o.pose] * positions_[o.point], as_pose_observation(o));
      return r && r->allFinite();
    };
    first_.assign(points.size() + 1, 0);
    std::vector<std::uint32_t> usable;
    for (std::uint32_t k = 0; k < observations.size(); ++k)
      if (is_active(k)) {
        usable.push_back(k);
        ++first_[observations[k].point + 1];
      }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    active_.resize(usable.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const std::uint32_t k : usable) active_[next[observations[k].point]++] = k;

    // Free poses that anything is seen from.
    std::vector<std::uint8_t> sees(poses_.size(), 0);
    for (const std::uint32_t k : active_) sees[observations[k].pose] = 1;
    free_.assign(poses_.size(), fixed);
    free_count_ = 0;
    for (std::size_t i = 0; i < poses_.size(); ++i)
      if (sees[i] != 0 && (options.fixed_poses.empty() || options.fixed_poses[i] == 0)) free_[i] = free_count_++;

    mixed_.resize(active_.size());
    point_hessian_.resize(points.size());
    point_gradient_.resize(points.size());
    point_inverse_.resize(points.size());
    // Runs of points whose bounds depend on the problem alone, few enough to hold a system each.
    grain_ = std::max<std::size_t>(1, (points.size() + 7) / 8);
    partials_.resize((points.size() + grain_ - 1) / grain_);
  }

  /// Blocks of the normal equations at the current estimate; returns its cost.
  template <class Policy>
  double linearize(const Policy& policy) {
    const auto n = static_cast<Eigen::Index>(6 * free_count_);
    for_each_chunk(policy, positions_.size(), grain_, [&](std::size_t begin, std::size_t end) {
      partial& sum = partials_[begin / grain_];
      sum.schur.setZero(n, 6);  // the diagonal blocks of the poses, stacked
      sum.gradient.setZero(n);
      sum.cost = 0.0;
      for (std::size_t p = begin; p < end; ++p) {
        mat3 v = mat3::Zero();
        vec3 g = vec3::Zero();
        for (std::uint32_t at = first_[p]; at < first_[p + 1]; ++at) {
          const bundle_observation& o = observations_[active_[at]];
          const se3& pose = poses_[o.pose];
          const mat3 rotation = pose.rotation_matrix();
          const vec3 seen = rotation * positions_[p] + pose.translation();
          mat3 j;
          const auto r = model_.residual(seen, as_pose_observation(o), j);
          mixed_[at].setZero();
          if (!r) {
            sum.cost += 0.5 * behind;
            continue;
          }
          const double squared = o.information * r->squaredNorm();
          const double weight = o.information * loss_.weight(squared);
          sum.cost += 0.5 * loss_.cost(squared);
          // Everything about this observation is made of these two, by products with the rotation
          // and with (I, -hat(seen)).
          const mat3 m = weight * j.transpose() * j;
          const vec3 b = weight * j.transpose() * *r;
          const mat3 mr = m * rotation;
          v.noalias() += rotation.transpose() * mr;
          g.noalias() += rotation.transpose() * b;
          if (free_[o.pose] == fixed) continue;
          const mat3 h = hat<double>(seen);
          mixed_[at].template topRows<3>() = mr;
          mixed_[at].template bottomRows<3>() = h * mr;
          const auto row = static_cast<Eigen::Index>(6 * free_[o.pose]);
          const mat3 mh = m * h;
          sum.schur.template block<3, 3>(row, 0) += m;
          sum.schur.template block<3, 3>(row, 3) -= mh;
          sum.schur.template block<3, 3>(row + 3, 0) += h * m;
          sum.schur.template block<3, 3>(row + 3, 3) -= h * mh;
          sum.gradient.template segment<3>(row) += b;
          sum.gradient.template segment<3>(row + 3) += h * b;
        }
        point_hessian_[p] = v;
        point_gradient_[p] = g;
      }
    });
    pose_hessian_.setZero(n, 6);
    pose_gradient_.setZero(n);
    double cost = 0.0;
    for (const partial& sum : partials_) {
      pose_hessian_ += sum.schur;
      pose_gradient_ += sum.gradient;
      cost += sum.cost;
    }
    return cost;
  }

  /// The damped step into the candidate arrays; false where the system has no solution.
  template <class Policy>
  bool compute_step(const Policy& policy, double lambda) {
    const auto n = static_cast<Eigen::Index>(6 * free_count_);
    const auto damp = [&](double diagonal) { return lambda * std::max(diagonal, 1e-6); };
    for_each_chunk(policy, positions_.size(), grain_, [&](std::size_t begin, std::size_t end) {
      partial& sum = partials_[begin / grain_];
      sum.schur.setZero(n, n);
      sum.gradient.setZero(n);
      for (std::size_t p = begin; p < end; ++p) {
        if (first_[p] == first_[p + 1]) continue;
        mat3 v = point_hessian_[p];
        for (int i = 0; i < 3; ++i) v(i, i) += damp(v(i, i));
        const mat3 inverse = v.inverse();
        point_inverse_[p] = inverse;
        const vec3 solved = inverse * point_gradient_[p];
        for (std::uint32_t a = first_[p]; a < first_[p + 1]; ++a) {
          const std::uint32_t pose = free_[observations_[active_[a]].pose];
          if (pose == fixed) continue;
          const auto row = static_cast<Eigen::Index>(6 * pose);
          const mat63 y = mixed_[a] * inverse;
          sum.gradient.template segment<6>(row) += mixed_[a] * solved;
          for (std::uint32_t b = first_[p]; b < first_[p + 1]; ++b) {
            const std::uint32_t other = free_[observations_[active_[b]].pose];
            if (other == fixed || other > pose) continue;  // the lower triangle
            sum.schur.template block<6, 6>(row, static_cast<Eigen::Index>(6 * other)).noalias() +=
                y * mixed_[b].transpose();
          }
        }
      }
    });
    reduced_.setZero(n, n);
    step_ = -pose_gradient_;
    for (const partial& sum : partials_) {
      reduced_ -= sum.schur;
      step_ += sum.gradient;
    }
    for (Eigen::Index i = 0; i < n; i += 6) {
      reduced_.template block<6, 6>(i, i) += pose_hessian_.template middleRows<6>(i);
      for (Eigen::Index k = i; k < i + 6; ++k) reduced_(k, k) += damp(pose_hessian_(k, k - i));
    }
    if (n > 0) {
      solver_.compute(reduced_);
      if (solver_.info() != Eigen::Success) return false;
      solver_.solveInPlace(step_);
      if (!step_.allFinite()) return false;
    }

    candidate_poses_ = poses_;
    for (std::size_t i = 0; i < poses_.size(); ++i)
      if (free_[i] != fixed)
        candidate_poses_[i] = se3::exp(step_.template segment<6>(static_cast<Eigen::Index>(6 * free_[i]))) * poses_[i];
    candidate_positions_ = positions_;
    for_each_chunk(policy, positions_.size(), grain_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        if (first_[p] == first_[p + 1]) continue;
        vec3 right = -point_gradient_[p];
        for (std::uint32_t a = first_[p]; a < first_[p + 1]; ++a)
          if (const std::uint32_t pose = free_[observations_[active_[a]].pose]; pose != fixed)
            right -= mixed_[a].transpose() * step_.template segment<6>(static_cast<Eigen::Index>(6 * pose));
        candidate_positions_[p] += point_inverse_[p] * right;
      }
    });
    return true;
  }

  template <class Policy>
  double candidate_cost(const Policy& policy) {
    for_each_chunk(policy, positions_.size(), grain_, [&](std::size_t begin, std::size_t end) {
      double cost = 0.0;
      for (std::uint32_t at = first_[begin]; at < first_[end]; ++at) {
        const bundle_observation& o = observations_[active_[at]];
        const auto r =
            model_.residual(candidate_poses_[o.pose] * candidate_positions_[o.point], as_pose_observation(o));
        cost += 0.5 * (r ? loss_.cost(o.information * r->squaredNorm()) : behind);
      }
      partials_[begin / grain_].cost = cost;
    });
    double cost = 0.0;
    for (const partial& sum : partials_) cost += sum.cost;
    return cost;
  }

  reprojection<Camera> model_;
  Loss loss_;

  std::span<const bundle_observation> observations_;  // of the call that is running
  std::vector<std::uint32_t> active_;                 // observations that take part, by point
  std::vector<std::uint32_t> first_;                  // where the observations of a point begin in active_
  std::vector<std::uint32_t> free_;                   // index of each pose among the free ones
  std::uint32_t free_count_ = 0;
  std::size_t grain_ = 1;
  std::vector<se3> poses_, candidate_poses_;  // T_camera_world
  std::vector<vec3> positions_, candidate_positions_;
  std::vector<mat63> mixed_;  // pose by point block of each active observation
  std::vector<mat3> point_hessian_, point_inverse_;
  std::vector<vec3> point_gradient_;
  std::vector<partial> partials_;
  Eigen::MatrixXd pose_hessian_, reduced_;
  Eigen::VectorXd pose_gradient_, step_;
  Eigen::LLT<Eigen::MatrixXd> solver_;
};

template <class Camera, class Loss>
bundle_adjuster(reprojection<Camera>, Loss) -> bundle_adjuster<Camera, Loss>;

}  // namespace orbis::optimize
