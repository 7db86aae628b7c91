// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normal equations of bundle adjustment: linearisation, reduction to the cameras, and solution.
///
/// Source: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_kernels.hpp>
#include <orbis/optimize/detail/bundle/bundle_structure.hpp>
#include <orbis/optimize/detail/bundle/schur_kernels.hpp>
#include <orbis/optimize/detail/sparse/reduced_solver.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/solver_policies.hpp>

namespace orbis::optimize::detail {

/// The normal equations and the current estimates. The unknowns are the steps of the movable cameras, with C entries
/// each, followed by the steps of the points in the order of `structure()`, with three entries each. Reuses its memory.
template <bundle_residual R, robust_loss Loss>
class bundle_equations {
 public:
  static constexpr int camera_size = R::camera_manifold::dimension;
  using camera_state = typename R::camera_state;
  using observation = typename R::observation;
  using camera_block = matrix<camera_size, camera_size>;
  using reduced_type = reduced_solver<camera_size>;

  bundle_equations(R residual, Loss loss, const reduced_solver_options& reduced)
      : residual_{std::move(residual)}, loss_{std::move(loss)}, reduced_{reduced} {}

  [[nodiscard]] const R& residual() const { return residual_; }
  [[nodiscard]] const Loss& loss() const { return loss_; }
  [[nodiscard]] const bundle_structure& structure() const { return structure_; }
  [[nodiscard]] const reduced_type& reduced() const { return reduced_; }

  /// Orders the observations and determines the blocks of the reduced system.
  void set_structure(std::size_t cameras, std::size_t points, std::span<const observation> observations,
                     std::span<const std::uint8_t> fixed) {
    structure_.build(cameras, points, observations, fixed,
                     [&](std::uint32_t k) { return residual_.is_usable(observations[k]); });
    const std::size_t places = structure_.places();
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

  /// Initialises the estimates, and selects the observations that are not ignored and have a projection; writes the
  /// number of these observations to `summary`.
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

  /// Computes residuals, weights and normal equations at the estimate.
  template <class Policy>
  void linearize(const Policy& policy) {
    for_each_index(policy, structure_.chunks(), 1, [&](std::size_t chunk) {
      const std::size_t begin = structure_.chunk_begin[chunk].first_point;
      const std::size_t end = structure_.chunk_begin[chunk + 1].first_point;
      std::fill_n(normal_.data() + point_size * begin, point_size * (end - begin), 0.0);
      for_each_segment(chunk, [&](std::size_t s) {
        camera_work<R> work = make_work(s, views_, positions_);
        work.normal = normal_.data();
        if (moves_camera(s)) {
          work.mixed = mixed_.data() + mixed_block_tile::size * structure_.segments[s].first_mixed_tile;
          work.sums = segment_sums_.data() + segment_size * s;
        }
        segment_cost_[s] = kernels_.linearize(work, loss_);
      });
      for (std::size_t p = begin; p != end; ++p) finish_point(p);
    });
    cost_ = sum_of_segments();
    add_up_cameras();
  }

  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double tried_cost() const { return tried_cost_; }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] const Eigen::VectorXd& diagonal() const { return diagonal_; }

  /// Returns `x^T H x`.
  [[nodiscard]] double curvature(const Eigen::VectorXd& x) const {
    double sum = 0.0;
    for (std::size_t u = 0; u != structure_.unknowns(); ++u) {
      const auto part = camera_part(x, u);
      sum += dot(part, camera_hessian_[u] * part);
    }
    for (std::size_t p = 0; p != structure_.points(); ++p) {
      const vec3 y = segment<3>(x, point_row(p));
      sum += dot(y, point_hessian(p) * y);
    }
    for (const bundle_structure::group& g : structure_.groups)
      for (std::uint32_t i = 0; i != g.points * g.cameras; ++i) {
        const std::size_t number = g.first_mixed + i;
        sum += 2.0 * dot(camera_part(x, structure_.mixed_unknown[number]),
                         mixed_block(number) * segment<3>(x, point_row(g.first_point + i % g.points)));
      }
    return sum;
  }

  /// Eliminates the points from H + diag(damping); an empty `damping` means 0. Returns false if the block of a point is
  /// not positive definite; `failed_camera()` is then a camera that observes this point.
  template <class Policy>
  [[nodiscard]] bool eliminate(const Policy& policy, const Eigen::VectorXd& damping) {
    const std::size_t n = structure_.unknowns();
    const double* const point_damping = damping.size() == 0 ? nullptr : damping.data() + camera_size * n;
    constexpr bool one_by_one = std::is_same_v<Policy, sequential_policy>;
    if (const std::size_t buffers = one_by_one ? std::min<std::size_t>(1, runs_.size()) : runs_.size();
        buffers_.size() < buffers)
      buffers_.resize(buffers);
    for (std::size_t s = 0; s != structure_.slots.size(); ++s) begin_reduced(s);
    for (std::size_t i = 0; i != reduced_right_.size(); ++i) reduced_right_[i] = -gradient_.data()[i];
    if constexpr (one_by_one) {  // a single buffer stays in the cache
      for (std::size_t k = 0; k != runs_.size(); ++k) {
        if (!is_regular(eliminate_run(runs_[k], point_damping, buffers_[0]))) return false;
        for (std::size_t s = runs_[k].first_slot; s != runs_[k].end_slot; ++s) subtract(s, buffers_[0]);
        add_to_right(buffers_[0]);
      }
    } else {
      for_each_index(policy, runs_.size(), 1,
                     [&](std::size_t k) { failed_point_[k] = eliminate_run(runs_[k], point_damping, buffers_[k]); });
      for (const std::size_t failed : failed_point_)
        if (!is_regular(failed)) return false;
      for_each_index(policy, structure_.slots.size(), slot_grain, [&](std::size_t s) {
        for (std::size_t k = 0; k != runs_.size(); ++k)
          if (s >= runs_[k].first_slot && s < runs_[k].end_slot) subtract(s, buffers_[k]);
      });
      for (std::size_t k = 0; k != runs_.size(); ++k) add_to_right(buffers_[k]);
    }
    for (std::size_t u = 0; u != n; ++u) {
      camera_block& to = reduced_diagonal_[u];
      for (int i = 0; i != camera_size; ++i) {
        if (damping.size() != 0) to(i, i) += damping[static_cast<Eigen::Index>(camera_size * u) + i];
        if (camera_hessian_[u](i, i) == 0.0) to(i, i) = 1.0;  // undetermined unknowns do not move
      }
    }
    return true;
  }
  /// Factorises the reduced system; returns false if it is not positive definite.
  [[nodiscard]] bool factor() {
    if (structure_.unknowns() == 0) return true;
    if (reduced_.factor(reduced_diagonal_, reduced_off_diagonal_)) return true;
    failed_camera_ = structure_.camera[reduced_.failed_block()];
    return false;
  }
  [[nodiscard]] std::size_t failed_camera() const { return failed_camera_; }

  /// Solves for the step of the cameras: their part of `-(H + D)^-1 g`.
  void solve_cameras(Eigen::VectorXd& step) {
    step.resize(gradient_.size());
    std::copy(reduced_right_.begin(), reduced_right_.end(), step.data());
    if (structure_.unknowns() != 0) reduced_.solve({step.data(), reduced_right_.size()});
  }
  /// Solves for the step of the points, given the step of the cameras in `step`.
  template <class Policy>
  void solve_points(const Policy& policy, Eigen::VectorXd& step) {
    for_each_index(policy, structure_.chunks(), 1, [&](std::size_t chunk) {
      schur_.substitute_points({.structure = structure_,
                                .chunk = chunk,
                                .mixed = mixed_.data(),
                                .inverse = inverse_.data(),
                                .cameras = step.data(),
                                .pulled = pulled_.data(),
                                .steps = step.data() + camera_size * structure_.unknowns()});
    });
  }

  /// Computes the cost after a step; `accept` then makes the result the estimate.
  template <class Policy>
  [[nodiscard]] double try_step(const Policy& policy, const Eigen::VectorXd& step) {
    for (std::size_t u = 0; u != structure_.unknowns(); ++u) {
      const std::size_t c = structure_.camera[u];
      tried_states_[c] = manifold_.retract(states_[c], camera_part(step, u));
      tried_views_[c] = residual_.prepare(tried_states_[c]);
    }
    const double* const moves = step.data() + camera_size * structure_.unknowns();
    for_each_index(policy, structure_.chunks(), 1, [&](std::size_t chunk) {
      const std::size_t end = structure_.chunk_begin[chunk + 1].first_point;
      for (std::size_t p = structure_.chunk_begin[chunk].first_point; p != end; ++p)
        for (std::size_t i = 0; i != 3; ++i) tried_positions_[4 * p + i] = positions_[4 * p + i] + moves[3 * p + i];
      for_each_segment(chunk, [&](std::size_t s) {
        segment_cost_[s] = kernels_.cost(make_work(s, tried_views_, tried_positions_), loss_);
      });
    });
    return tried_cost_ = sum_of_segments();
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

 private:
  using rows = row_layout<camera_size>;
  static constexpr std::size_t segment_size = camera_numbers<camera_size>;
  static constexpr std::size_t slot_grain = 256;
  static constexpr bool through_camera = camera_frame_residual<R>;
  using mixed_block_tile = mixed_tile<camera_size, through_camera>;

  /// Chunks whose points are eliminated sequentially, and the slots that they modify. The bounds depend only on the
  /// problem, not on the number of threads.
  struct elimination_run {
    std::size_t first_chunk = 0, end_chunk = 0, first_slot = 0, end_slot = 0;
  };
  /// Contributions to subtract from the reduced system.
  struct elimination_buffer {
    std::vector<double> blocks, right, scratch;
  };

  // The blocks of the normal equations at the last linearisation.
  [[nodiscard]] mat3 point_hessian(std::size_t point) const {
    const double* const v = normal_.data() + point_size * point;
    mat3 h;
    h << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
    return h;
  }
  /// Returns the camera-point block of an observation by a movable camera, given its index in `structure()`.
  [[nodiscard]] matrix<camera_size, 3> mixed_block(std::size_t number) const {
    const std::size_t place = structure_.mixed_place[number];
    const double* const tile = mixed_.data() + mixed_block_tile::size * (place / 8) + place % 8;
    matrix<camera_size, 3> block;
    for (int i = 0; i != camera_size; ++i)
      for (int k = 0; k != 3; ++k)
        if (!through_camera || i < 3 || i >= 6) block(i, k) = tile[mixed_block_tile::row(i) + 8 * k];
    if constexpr (through_camera) {
      const double* const q = tile + mixed_block_tile::q;
      set_block(block, 3, 0, hat<double>(vec3{q[0], q[8], q[16]}) * orbis::block<3, 3>(block, 0, 0));
    }
    return block;
  }

  [[nodiscard]] auto camera_part(const Eigen::VectorXd& x, std::size_t u) const {
    return segment<camera_size>(x, static_cast<Eigen::Index>(camera_size * u));
  }
  [[nodiscard]] Eigen::Index point_row(std::size_t p) const {
    return static_cast<Eigen::Index>(camera_size * structure_.unknowns() + 3 * p);
  }

  void make_room() {
    const std::size_t n = structure_.unknowns(), points = structure_.points();
    segment_cost_.assign(structure_.segments.size(), 0.0);
    segment_sums_.resize(segment_size * structure_.segments.size());
    camera_hessian_.assign(n, zeros<camera_block>());
    mixed_.resize(mixed_block_tile::size * structure_.mixed_tiles());
    normal_.resize(point_size * points);
    inverse_.resize(normal_.size());
    for (auto* const v : {&gradient_, &diagonal_}) {
      v->resize(static_cast<Eigen::Index>(camera_size * n + 3 * points));
      std::fill_n(v->data(), v->size(), 0.0);
    }
    pulled_.resize(4 * points);
    reduced_right_.resize(camera_size * n);

    // Use fewer runs if the reduced system is large compared with the work of elimination.
    const std::size_t chunks = structure_.chunks();
    const std::size_t most =
        std::clamp<std::size_t>(structure_.pairs() / (20 * std::max<std::size_t>(1, structure_.slots.size())), 1, 8);
    const std::size_t length = (chunks + most - 1) / most;
    runs_.clear();
    for (std::size_t begin = 0; begin < chunks; begin += length) {
      elimination_run run{begin, std::min(chunks, begin + length), structure_.slots.size(), 0};
      const auto touch = [&](std::size_t slot) {
        run.first_slot = std::min(run.first_slot, slot);
        run.end_slot = std::max(run.end_slot, slot + 1);
      };
      const std::size_t end_group = structure_.chunk_begin[run.end_chunk].first_group;
      for (std::size_t g = structure_.chunk_begin[begin].first_group; g != end_group; ++g) {
        const bundle_structure::group& group = structure_.groups[g];
        if (group.cameras == 0) continue;  // all slots of a group are between two diagonal slots
        touch(structure_.diagonal_slot[structure_.mixed_unknown[group.first_mixed]]);
        touch(structure_.diagonal_slot[structure_.mixed_unknown[group.first_mixed +
                                                                std::size_t{group.points} * (group.cameras - 1)]]);
      }
      run.first_slot = std::min(run.first_slot, run.end_slot);
      runs_.push_back(run);
    }
    failed_point_.assign(runs_.size(), bundle_structure::none);
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

  [[nodiscard]] camera_block& reduced_block(std::size_t s) {
    const bool on_diagonal = structure_.slots[s].row == structure_.slots[s].column;
    return on_diagonal ? reduced_diagonal_[place_of_slot_[s]] : reduced_off_diagonal_[place_of_slot_[s]];
  }
  void begin_reduced(std::size_t s) {
    const block_place& slot = structure_.slots[s];
    if (slot.row == slot.column)
      reduced_block(s) = camera_hessian_[slot.row];
    else
      reduced_block(s) = zeros<camera_block>();
  }
  /// Eliminates the points of a run. Returns the first point whose block is not positive definite, or `none`.
  [[nodiscard]] std::size_t eliminate_run(const elimination_run& run, const double* point_damping,
                                          elimination_buffer& to) {
    to.blocks.resize(rows::block * structure_.slots.size());
    to.right.assign(camera_size * structure_.unknowns(), 0.0);
    to.scratch.resize(3 * rows::size * structure_.largest_chunk());
    std::fill(to.blocks.begin() + static_cast<std::ptrdiff_t>(rows::block * run.first_slot),
              to.blocks.begin() + static_cast<std::ptrdiff_t>(rows::block * run.end_slot), 0.0);
    for (std::size_t chunk = run.first_chunk; chunk != run.end_chunk; ++chunk) {
      const std::size_t failed = schur_.eliminate_points({.structure = structure_,
                                                          .chunk = chunk,
                                                          .normal = normal_.data(),
                                                          .damping = point_damping,
                                                          .mixed = mixed_.data(),
                                                          .inverse = inverse_.data(),
                                                          .blocks = to.blocks.data(),
                                                          .right = to.right.data(),
                                                          .scratch = to.scratch.data()});
      if (failed != bundle_structure::none) return failed;
    }
    return bundle_structure::none;
  }
  void subtract(std::size_t s, const elimination_buffer& sum) {
    constexpr int body = rows::has_last ? rows::body : camera_size;
    const double* const taken = sum.blocks.data() + rows::block * s;
    camera_block& to = reduced_block(s);
    for (int c = 0; c < camera_size; ++c)
      for (int r = 0; r < body; ++r) to(r, c) -= taken[static_cast<int>(rows::body) * c + r];
    if constexpr (rows::has_last)
      for (int c = 0; c < camera_size; ++c) to(camera_size - 1, c) -= taken[rows::at(camera_size - 1, 0) + c];
  }
  void add_to_right(const elimination_buffer& sum) {
    for (std::size_t i = 0; i != reduced_right_.size(); ++i) reduced_right_[i] += sum.right[i];
  }

  template <class Policy>
  void choose_observations(const Policy& policy, std::span<const std::uint8_t> ignored, bundle_summary& summary) {
    information_ = base_information_;
    flags_.resize(information_.size());
    for_each_index(policy, structure_.chunks(), 1, [&](std::size_t chunk) {
      for_each_segment(chunk, [&](std::size_t s) {
        find_visible(make_work(s, views_, positions_), flags_.data() + 8 * structure_.segments[s].first_tile);
      });
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

  template <class F>
  void for_each_segment(std::size_t chunk, const F& f) const {
    const std::size_t end = structure_.chunk_begin[chunk + 1].first_segment;
    for (std::size_t s = structure_.chunk_begin[chunk].first_segment; s != end; ++s) f(s);
  }
  [[nodiscard]] bool moves_camera(std::size_t segment) const {
    return structure_.unknown[structure_.segments[segment].camera] != bundle_structure::none;
  }

  [[nodiscard]] camera_work<R> make_work(std::size_t s, const std::vector<typename R::view>& views,
                                         const std::vector<double>& positions) const {
    const bundle_structure::segment& segment = structure_.segments[s];
    const std::size_t at = 8 * segment.first_tile;
    camera_work<R> work{.residual = residual_, .view = views[segment.camera], .count = segment.count};
    if constexpr (lane_residual<R>)
      work.measurements = measurements_.data() + static_cast<std::size_t>(R::measured) * at;
    else
      work.observations = observations_.data() + at;
    work.information = information_.data() + at;
    work.point = structure_.point.data() + at;
    work.positions = positions.data();
    return work;
  }

  [[nodiscard]] double sum_of_segments() const {
    double sum = 0.0;
    for (const double cost : segment_cost_) sum += cost;
    return sum;
  }

  /// Completes a point after all its observations have been added.
  void finish_point(std::size_t p) {
    double* const sum = normal_.data() + point_size * p;
    if (holds_point_[p] != 0) std::fill_n(sum, point_size, 0.0);
    double* const gradient = gradient_.data() + point_row(p);
    double* const diagonal = diagonal_.data() + point_row(p);
    for (std::size_t i = 0; i != 3; ++i) gradient[i] = sum[6 + i];
    diagonal[0] = sum[0];
    diagonal[1] = sum[3];
    diagonal[2] = sum[5];
  }
  void add_up_cameras() {
    std::fill_n(gradient_.data(), camera_size * structure_.unknowns(), 0.0);
    for (camera_block& h : camera_hessian_) h = zeros<camera_block>();
    for (std::size_t s = 0; s != structure_.segments.size(); ++s) {
      if (!moves_camera(s)) continue;
      const std::size_t u = structure_.unknown[structure_.segments[s].camera];
      const double* sum = segment_sums_.data() + segment_size * s;
      camera_block& h = camera_hessian_[u];
      for (int i = 0; i != camera_size; ++i)
        for (int j = 0; j <= i; ++j) h(j, i) += *sum++;
      for (std::size_t i = 0; i != camera_size; ++i) gradient_.data()[camera_size * u + i] += *sum++;
    }
    for (std::size_t u = 0; u != structure_.unknowns(); ++u) {
      camera_block& h = camera_hessian_[u];
      for (int i = 1; i < camera_size; ++i)
        for (int j = 0; j < i; ++j) h(i, j) = h(j, i);
      for (int i = 0; i != camera_size; ++i) diagonal_[static_cast<Eigen::Index>(camera_size * u) + i] = h(i, i);
    }
  }
  /// Returns true if no point failed; otherwise stores the first camera that observes the failed point.
  [[nodiscard]] bool is_regular(std::size_t failed_point) {
    if (failed_point == bundle_structure::none) return true;
    for (const bundle_structure::segment& s : structure_.segments) {
      const auto begin = structure_.point.begin() + static_cast<std::ptrdiff_t>(8 * s.first_tile);
      if (std::find(begin, begin + s.count, failed_point) == begin + s.count) continue;
      failed_camera_ = s.camera;
      break;
    }
    return false;
  }

  R residual_;
  Loss loss_;
  typename R::camera_manifold manifold_{};
  reduced_type reduced_;
  bundle_kernels<R, Loss> kernels_;
  schur_kernels<camera_size, camera_frame_residual<R>> schur_;
  bundle_structure structure_;

  // Values for each place of the order by camera.
  std::vector<double> measurements_, base_information_, information_, flags_;
  std::vector<observation> observations_;
  // Current estimates, and estimates after an attempted step.
  std::vector<camera_state> states_, tried_states_;
  std::vector<typename R::view> views_, tried_views_;
  std::vector<double> positions_, tried_positions_;  // four values per point
  std::vector<std::uint8_t> holds_point_;
  // The normal equations.
  double cost_ = 0.0, tried_cost_ = 0.0;
  std::vector<double> segment_cost_, segment_sums_;
  std::vector<camera_block> camera_hessian_;
  std::vector<double> mixed_;             // the block of each observation by a movable camera
  std::vector<double> normal_, inverse_;  // values of each point
  Eigen::VectorXd gradient_, diagonal_;
  // The reduced system.
  std::size_t failed_camera_ = 0;
  std::vector<elimination_run> runs_;
  std::vector<std::size_t> failed_point_;  // failed point of each run, or `none`
  std::vector<elimination_buffer> buffers_;
  std::vector<block_place> off_diagonal_places_;
  std::vector<std::uint32_t> place_of_slot_;  // index among the blocks on or off the diagonal
  std::vector<camera_block> reduced_diagonal_, reduced_off_diagonal_;
  std::vector<double> reduced_right_, pulled_;
};

}  // namespace orbis::optimize::detail
