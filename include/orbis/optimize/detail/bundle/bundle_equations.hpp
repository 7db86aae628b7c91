// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normal equations of bundle adjustment: computed, reduced to the cameras, solved.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_kernels.hpp>
#include <orbis/optimize/detail/bundle/bundle_structure.hpp>
#include <orbis/optimize/detail/bundle/schur_kernels.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize::detail {

/// The unknowns are the steps of the cameras that may move, C numbers each, then those of the points in the order of
/// `structure()`, three each. Keeps its memory.
template <bundle_residual R, robust_loss Loss, reduced_solver Reduced>
class bundle_equations {
 public:
  static constexpr int camera_size = R::camera_manifold::dimension;
  using camera_state = typename R::camera_state;
  using observation = typename R::observation;
  using camera_block = matrix<camera_size, camera_size>;
  using reduced_type = typename Reduced::template solver<camera_size>;

  bundle_equations(R residual, Loss loss, const Reduced& reduced);

  [[nodiscard]] const R& residual() const { return residual_; }
  [[nodiscard]] const Loss& loss() const { return loss_; }
  [[nodiscard]] const bundle_structure& structure() const { return structure_; }
  [[nodiscard]] const reduced_type& reduced() const { return reduced_; }

  /// Orders the observations and finds the blocks of the reduced system.
  void set_structure(std::size_t cameras, std::size_t points, std::span<const observation> observations,
                     std::span<const std::uint8_t> fixed, bool hold_first);

  /// Begins at these estimates, with the observations that are not ignored and have a projection there; counts them in
  /// `summary`.
  template <class Policy>
  void begin(const Policy& policy, std::span<const camera_state> cameras, std::span<const vec3> points,
             const bundle_options& options, bundle_summary& summary) {
    states_.assign(cameras.begin(), cameras.end());
    tried_states_ = states_;
    views_.resize(cameras.size());
    tried_views_.resize(cameras.size());
    for (std::size_t c = 0; c != cameras.size(); ++c)
      if (structure_.count[c] != 0) tried_views_[c] = views_[c] = residual_.prepare(states_[c]);
    const std::size_t count = structure_.points();
    positions_.resize(4 * count);
    holds_point_.assign(count, 0);
    for (std::size_t p = 0; p != count; ++p) {
      const std::size_t source = structure_.point_source[p];
      for (int i = 0; i != 3; ++i) positions_[4 * p + static_cast<std::size_t>(i)] = points[source][i];
      positions_[4 * p + 3] = 0.0;
      holds_point_[p] = !options.fixed_points.empty() && options.fixed_points[source] != 0;
    }
    tried_positions_ = positions_;
    choose_observations(policy, options.ignored, summary);
  }

  /// Residuals, weights and normal equations at the estimate.
  template <class Policy>
  void linearize(const Policy& policy) {
    for_each_camera(policy, [&](std::size_t c) {
      camera_work<R> work = work_of(c, views_, positions_);
      const std::uint32_t u = structure_.unknown[c];
      work.shares = shares_.data();
      if (u != bundle_structure::none) {
        work.mixed = mixed_.data();
        work.hessian = camera_hessian_[u].data();
        work.gradient = gradient_.data() + camera_size * u;
      }
      camera_cost_[c] = kernels_.linearize(work, loss_);
    });
    cost_ = sum_of_cameras();
    for_each_chunk(policy, structure_.points(), point_grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p != end; ++p) gather(p);
    });
    for (std::size_t u = 0; u != structure_.unknowns(); ++u)
      for (int i = 0; i != camera_size; ++i)
        diagonal_[static_cast<Eigen::Index>(camera_size * u) + i] = camera_hessian_[u](i, i);
  }

  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double tried_cost() const { return tried_cost_; }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] const Eigen::VectorXd& diagonal() const { return diagonal_; }

  /// `x^T H x`.
  [[nodiscard]] double curvature(const Eigen::VectorXd& x) const {
    double sum = 0.0;
    for (std::size_t u = 0; u != structure_.unknowns(); ++u) {
      const auto part = camera_part(x, u);
      sum += part.dot(camera_hessian_[u] * part);
    }
    for (std::size_t p = 0; p != structure_.points(); ++p) {
      const mat3 h = point_hessian(p);
      const auto y = x.template segment<3>(point_row(p));
      vec3 pulled = vec3::Zero();
      for (std::uint32_t a = structure_.first_mixed[p]; a != structure_.first_mixed[p + 1]; ++a)
        pulled.noalias() += mixed_block(a).transpose() * camera_part(x, structure_.mixed_unknown[a]);
      sum += y.dot(h * y) + 2.0 * y.dot(pulled);
    }
    return sum;
  }

  /// Eliminates the points from H + diag(damping); an empty `damping` is 0. False if the block of a point is not
  /// positive definite; `failed_camera()` then sees that point.
  template <class Policy>
  [[nodiscard]] bool eliminate(const Policy& policy, const Eigen::VectorXd& damping) {
    const std::size_t n = structure_.unknowns();
    const double* const point_damping = damping.size() == 0 ? nullptr : damping.data() + camera_size * n;
    for_each_chunk(policy, structure_.points(), chunk_, [&](std::size_t begin, std::size_t end) {
      partial& sum = partials_[begin / chunk_];
      std::fill(sum.blocks.begin() + static_cast<std::ptrdiff_t>(block_size * sum.first_slot),
                sum.blocks.begin() + static_cast<std::ptrdiff_t>(block_size * sum.end_slot), 0.0);
      std::fill(sum.right.begin(), sum.right.end(), 0.0);
      const std::size_t stopped = schur_.eliminate_points({.begin = begin,
                                                           .end = end,
                                                           .normal = normal_.data(),
                                                           .damping = point_damping,
                                                           .mixed = mixed_.data(),
                                                           .first_mixed = structure_.first_mixed.data(),
                                                           .mixed_unknown = structure_.mixed_unknown.data(),
                                                           .first_pair = structure_.first_pair.data(),
                                                           .pair_slot = structure_.pair_slot.data(),
                                                           .inverse = inverse_.data(),
                                                           .blocks = sum.blocks.data(),
                                                           .right = sum.right.data(),
                                                           .scratch = sum.scratch.data()});
      sum.failed = stopped == end ? structure_.points() : stopped;
    });
    for (const partial& sum : partials())
      if (sum.failed != structure_.points()) {
        failed_camera_ = structure_.point[0];
        for (std::size_t at = 0; at != structure_.point.size(); ++at)
          if (structure_.source[at] != bundle_structure::none && structure_.point[at] == sum.failed) {
            const auto after = std::upper_bound(structure_.first_tile.begin(), structure_.first_tile.end(), at / 8);
            failed_camera_ = static_cast<std::size_t>(after - structure_.first_tile.begin()) - 1;
            break;
          }
        return false;
      }
    for_each_chunk(policy, structure_.slots.size(), slot_grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t s = begin; s != end; ++s) assemble(s, damping);
    });
    for (std::size_t u = 0; u != n; ++u)
      for (std::size_t i = 0; i != camera_size; ++i) {
        double sum = 0.0;
        for (const partial& part : partials()) sum += part.right[pad * u + i];
        reduced_right_[camera_size * u + i] = sum - gradient_[static_cast<Eigen::Index>(camera_size * u + i)];
      }
    return true;
  }
  /// Factors the reduced system; false if it is not positive definite.
  [[nodiscard]] bool factor() {
    if (structure_.unknowns() == 0) return true;
    if (reduced_.factor(reduced_diagonal_, reduced_off_diagonal_)) return true;
    failed_camera_ = structure_.camera[reduced_.failed_block()];
    return false;
  }
  [[nodiscard]] std::size_t failed_camera() const { return failed_camera_; }

  /// The step of the cameras, their part of `-(H + D)^-1 g`.
  void solve_cameras(Eigen::VectorXd& step) {
    step.resize(gradient_.size());
    std::copy(reduced_right_.begin(), reduced_right_.end(), step.data());
    if (structure_.unknowns() != 0) reduced_.solve({step.data(), reduced_right_.size()});
  }
  /// Replaces a right-hand side of the reduced system that was factored last by the solution.
  void solve_reduced(std::span<double> x) { reduced_.solve(x); }
  /// The step of the points, for that of the cameras in `step`.
  template <class Policy>
  void solve_points(const Policy& policy, Eigen::VectorXd& step) {
    const std::size_t n = structure_.unknowns();
    for (std::size_t u = 0; u != n; ++u)
      std::copy_n(step.data() + camera_size * u, camera_size, &padded_step_[pad * u]);
    for_each_chunk(policy, structure_.points(), point_grain, [&](std::size_t begin, std::size_t end) {
      schur_.substitute_points({.begin = begin,
                                .end = end,
                                .mixed = mixed_.data(),
                                .first_mixed = structure_.first_mixed.data(),
                                .mixed_unknown = structure_.mixed_unknown.data(),
                                .inverse = inverse_.data(),
                                .cameras = padded_step_.data(),
                                .steps = step.data() + camera_size * n});
    });
  }

  /// The cost one step away; `accept` then makes that the estimate.
  template <class Policy>
  [[nodiscard]] double try_step(const Policy& policy, const Eigen::VectorXd& step) {
    for (std::size_t u = 0; u != structure_.unknowns(); ++u) {
      const std::size_t c = structure_.camera[u];
      tried_states_[c] = manifold_.retract(states_[c], camera_part(step, u));
      tried_views_[c] = residual_.prepare(tried_states_[c]);
    }
    const double* const moves = step.data() + camera_size * structure_.unknowns();
    for (std::size_t p = 0; p != structure_.points(); ++p)
      for (std::size_t i = 0; i != 3; ++i) tried_positions_[4 * p + i] = positions_[4 * p + i] + moves[3 * p + i];
    for_each_camera(policy, [&](std::size_t c) {
      camera_cost_[c] = kernels_.cost(work_of(c, tried_views_, tried_positions_), loss_);
    });
    return tried_cost_ = sum_of_cameras();
  }
  void accept() {
    states_.swap(tried_states_);
    views_.swap(tried_views_);
    positions_.swap(tried_positions_);
    cost_ = tried_cost_;
  }

  /// Writes the estimates to the caller's arrays.
  void write(std::span<camera_state> cameras, std::span<vec3> points) const {
    for (const std::uint32_t c : structure_.camera) cameras[c] = states_[c];
    for (std::size_t p = 0; p != structure_.points(); ++p)
      if (holds_point_[p] == 0)
        points[structure_.point_source[p]] = vec3{positions_[4 * p], positions_[4 * p + 1], positions_[4 * p + 2]};
  }
  [[nodiscard]] bool moves_anything() const {
    return structure_.unknowns() != 0 || std::find(holds_point_.begin(), holds_point_.end(), 0) != holds_point_.end();
  }

  // The blocks of the normal equations at the estimate last linearised.
  [[nodiscard]] const camera_block& camera_hessian(std::size_t unknown) const { return camera_hessian_[unknown]; }
  [[nodiscard]] mat3 point_hessian(std::size_t point) const {
    const double* const v = normal_.data() + point_at(point);
    mat3 h;
    h << v[0], v[8], v[16], v[8], v[24], v[32], v[16], v[32], v[40];
    return h;
  }
  /// The block of camera and point of an observation by a camera that may move, in the order of
  /// `structure().mixed_unknown`.
  [[nodiscard]] auto mixed_block(std::size_t observation_by_point) const {
    return Eigen::Map<const matrix<camera_size, 3>, Eigen::Unaligned, Eigen::OuterStride<>>(
        mixed_.data() + 3 * pad * observation_by_point, Eigen::OuterStride<>(pad));
  }

 private:
  static constexpr std::size_t pad = padded<camera_size>;
  static constexpr std::size_t block_size = pad * camera_size;
  static constexpr std::size_t point_grain = 256, slot_grain = 256;

  /// What a chunk of points subtracts from the reduced system.
  struct partial {
    std::vector<double> blocks, right, scratch;
    std::size_t first_slot = 0, end_slot = 0;  ///< the slots that the chunk touches
    std::size_t failed = 0;
  };

  [[nodiscard]] std::span<const partial> partials() const { return std::span{partials_}.first(used_partials_); }
  [[nodiscard]] auto camera_part(const Eigen::VectorXd& x, std::size_t u) const {
    return x.template segment<camera_size>(static_cast<Eigen::Index>(camera_size * u));
  }
  [[nodiscard]] Eigen::Index point_row(std::size_t p) const {
    return static_cast<Eigen::Index>(camera_size * structure_.unknowns() + 3 * p);
  }

  void make_room() {
    const std::size_t n = structure_.unknowns(), points = structure_.points();
    camera_cost_.assign(structure_.count.size(), 0.0);
    camera_hessian_.assign(n, camera_block::Zero());
    shares_.resize(share_size * static_cast<std::size_t>(structure_.first.back()));
    mixed_.resize(3 * pad * structure_.mixed_unknown.size());
    normal_.assign(point_size * ((points + 7) / 8 * 8), 0.0);
    inverse_.resize(normal_.size());
    gradient_.setZero(static_cast<Eigen::Index>(camera_size * n + 3 * points));
    diagonal_.setZero(gradient_.size());
    padded_step_.assign(pad * n, 0.0);
    reduced_right_.resize(camera_size * n);

    // Chunks of points whose bounds depend only on the problem; fewer where the reduced system is large compared to the
    // work that goes into it.
    const std::size_t runs = std::clamp<std::size_t>(
        structure_.pair_slot.size() / (8 * std::max<std::size_t>(1, structure_.slots.size())), 1, 8);
    chunk_ = std::max<std::size_t>(8, (points + 8 * runs - 1) / (8 * runs) * 8);
    used_partials_ = (points + chunk_ - 1) / chunk_;
    if (partials_.size() < used_partials_) partials_.resize(used_partials_);
    for (std::size_t k = 0; k != used_partials_; ++k) {
      partial& sum = partials_[k];
      sum.blocks.resize(block_size * structure_.slots.size());
      sum.right.resize(pad * n);
      sum.scratch.resize(3 * pad * structure_.longest());
      sum.first_slot = structure_.slots.size();
      sum.end_slot = 0;
      const std::size_t end = structure_.first_pair[std::min(points, (k + 1) * chunk_)];
      for (std::size_t at = structure_.first_pair[k * chunk_]; at != end; ++at) {
        sum.first_slot = std::min<std::size_t>(sum.first_slot, structure_.pair_slot[at]);
        sum.end_slot = std::max<std::size_t>(sum.end_slot, structure_.pair_slot[at] + std::size_t{1});
      }
      sum.first_slot = std::min(sum.first_slot, sum.end_slot);
    }
  }

  void analyze_reduced() {
    const std::size_t n = structure_.unknowns();
    off_diagonal_places_.clear();
    place_of_slot_.resize(structure_.slots.size());
    for (std::size_t s = 0; s != structure_.slots.size(); ++s) {
      const block_place& slot = structure_.slots[s];
      if (slot.row == slot.column) {
        place_of_slot_[s] = slot.row;
      } else {
        place_of_slot_[s] = static_cast<std::uint32_t>(off_diagonal_places_.size());
        off_diagonal_places_.push_back(slot);
      }
    }
    reduced_diagonal_.resize(n);
    reduced_off_diagonal_.resize(off_diagonal_places_.size());
    if (n != 0) reduced_.analyze(n, off_diagonal_places_);
  }

  /// One block of the reduced system.
  void assemble(std::size_t s, const Eigen::VectorXd& damping) {
    using taken_block = Eigen::Map<const camera_block, Eigen::Unaligned, Eigen::OuterStride<>>;
    const block_place& slot = structure_.slots[s];
    const bool on_diagonal = slot.row == slot.column;
    camera_block& to = on_diagonal ? reduced_diagonal_[place_of_slot_[s]] : reduced_off_diagonal_[place_of_slot_[s]];
    if (on_diagonal)
      to = camera_hessian_[slot.row];
    else
      to.setZero();
    for (const partial& sum : partials())
      if (s >= sum.first_slot && s < sum.end_slot)
        to -= taken_block(sum.blocks.data() + block_size * s, Eigen::OuterStride<>(pad));
    if (!on_diagonal) return;
    for (int i = 0; i != camera_size; ++i) {
      if (damping.size() != 0) to(i, i) += damping[static_cast<Eigen::Index>(camera_size * slot.row) + i];
      if (camera_hessian_[slot.row](i, i) == 0.0) to(i, i) = 1.0;  // not determined at all: it stays
    }
  }

  template <class Policy>
  void choose_observations(const Policy& policy, std::span<const std::uint8_t> ignored, bundle_summary& summary) {
    information_ = base_information_;
    flags_.resize(information_.size());
    for_each_camera(policy, [&](std::size_t c) {
      find_visible(work_of(c, views_, positions_), flags_.data() + 8 * structure_.first_tile[c]);
    });
    for (std::size_t at = 0; at != information_.size(); ++at) {
      const std::uint32_t source = structure_.source[at];
      if (source == bundle_structure::none) continue;
      const bool is_ignored = !ignored.empty() && ignored[source] != 0;
      const bool is_seen = flags_[at] != 0.0;
      if (is_ignored || !is_seen) information_[at] = 0.0;
      if (is_ignored) continue;
      if (is_seen) {
        ++summary.observations;
      } else {
        if (summary.left_out++ == 0 || source < summary.first_left_out) summary.first_left_out = source;
      }
    }
  }

  template <class Policy, class F>
  void for_each_camera(const Policy& policy, const F& f) {
    for_each_index(policy, structure_.count.size(), 1, [&](std::size_t c) {
      if (structure_.count[c] != 0) f(c);
    });
  }

  [[nodiscard]] camera_work<R> work_of(std::size_t c, const std::vector<typename R::view>& views,
                                       const std::vector<double>& positions) const {
    const std::size_t at = 8 * structure_.first_tile[c];
    camera_work<R> work{.residual = residual_, .view = views[c], .count = structure_.count[c]};
    if constexpr (lane_residual<R>)
      work.measurements = measurements_.data() + static_cast<std::size_t>(R::measured) * at;
    else
      work.observations = observations_.data() + at;
    work.information = information_.data() + at;
    work.point = structure_.point.data() + at;
    work.positions = positions.data();
    work.by_point = structure_.by_point.data() + at;
    work.mixed_by_point = structure_.mixed_by_point.data() + at;
    return work;
  }

  [[nodiscard]] double sum_of_cameras() const {
    double sum = 0.0;
    for (const double cost : camera_cost_) sum += cost;
    return sum;
  }

  /// Adds up the contributions of the observations of a point.
  void gather(std::size_t p) {
    double sum[point_size] = {};
    if (holds_point_[p] == 0)
      for (std::uint32_t at = structure_.first[p]; at != structure_.first[p + 1]; ++at) {
        const double* const share = shares_.data() + share_size * std::size_t{at};
        for (std::size_t i = 0; i != point_size; ++i) sum[i] += share[i];
      }
    double* const to = normal_.data() + point_at(p);
    for (std::size_t i = 0; i != point_size; ++i) to[8 * i] = sum[i];
    double* const gradient = gradient_.data() + point_row(p);
    double* const diagonal = diagonal_.data() + point_row(p);
    for (std::size_t i = 0; i != 3; ++i) gradient[i] = sum[6 + i];
    diagonal[0] = sum[0];
    diagonal[1] = sum[3];
    diagonal[2] = sum[5];
  }

  R residual_;
  Loss loss_;
  typename R::camera_manifold manifold_{};
  reduced_type reduced_;
  bundle_kernels<R, Loss> kernels_;
  schur_kernels<camera_size> schur_;
  bundle_structure structure_;

  // Of each place in the order by camera.
  std::vector<double> measurements_, base_information_, information_, flags_;
  std::vector<observation> observations_;
  // Estimates, and those one step away.
  std::vector<camera_state> states_, tried_states_;
  std::vector<typename R::view> views_, tried_views_;
  std::vector<double> positions_, tried_positions_;  // four numbers for each point
  std::vector<std::uint8_t> holds_point_;
  // The normal equations.
  double cost_ = 0.0, tried_cost_ = 0.0;
  std::vector<double> camera_cost_;
  std::vector<camera_block> camera_hessian_;
  std::vector<double> shares_, mixed_;    // of each observation
  std::vector<double> normal_, inverse_;  // of each point
  Eigen::VectorXd gradient_, diagonal_;
  // The reduced system.
  std::size_t chunk_ = 1, failed_camera_ = 0;
  std::vector<partial> partials_;  // of which the last may be left from a larger problem
  std::size_t used_partials_ = 0;
  std::vector<block_place> off_diagonal_places_;
  std::vector<std::uint32_t> place_of_slot_;  // among the blocks on, or off, the diagonal
  std::vector<camera_block> reduced_diagonal_, reduced_off_diagonal_;
  std::vector<double> reduced_right_, padded_step_;
};

template <bundle_residual R, robust_loss Loss, reduced_solver Reduced>
bundle_equations<R, Loss, Reduced>::bundle_equations(R residual, Loss loss, const Reduced& reduced)
    : residual_{std::move(residual)}, loss_{std::move(loss)}, reduced_{reduced} {}

template <bundle_residual R, robust_loss Loss, reduced_solver Reduced>
void bundle_equations<R, Loss, Reduced>::set_structure(std::size_t cameras, std::size_t points,
                                                       std::span<const observation> observations,
                                                       std::span<const std::uint8_t> fixed, bool hold_first) {
  structure_.build(cameras, points, observations, fixed, hold_first,
                   [&](std::uint32_t k) { return residual_.is_usable(observations[k]); });
  const std::size_t places = structure_.source.size();
  base_information_.assign(places, 0.0);
  if constexpr (lane_residual<R>)
    measurements_.assign(static_cast<std::size_t>(R::measured) * places, 0.0);
  else
    observations_.assign(places, observation{});
  for (std::size_t at = 0; at != places; ++at) {
    if (structure_.source[at] == bundle_structure::none) continue;
    const observation& o = observations[structure_.source[at]];
    base_information_[at] = o.information;
    if constexpr (lane_residual<R>)
      residual_.measure(o, measurements_.data() + static_cast<std::size_t>(R::measured) * (at / 8 * 8) + at % 8);
    else
      observations_[at] = o;
  }
  information_ = base_information_;
  make_room();
  analyze_reduced();
}

}  // namespace orbis::optimize::detail
