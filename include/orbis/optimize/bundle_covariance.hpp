// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How sure bundle adjustment is of its cameras and points: blocks of the inverse of the normal equations.
///
/// Sources: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
/// synthesis", Vision Algorithms 2000, section 9 (gauge freedom); W. Baarda, "S-transformations and
/// criterion matrices", 1973 (from one gauge to another).
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/optimize/bundle_gauge.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/detail/bundle/bundle_equations.hpp>
#include <orbis/optimize/linear_solver.hpp>
#include <orbis/optimize/residual.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

/// With respect to what positions are uncertain. Observations alone do not say where the whole is, how it
/// is turned and, without depth, how large it is: as much as this is left free by the fixed cameras and
/// points has to be settled by a convention, and variances are about that convention.
enum class covariance_gauge {
  as_given,      ///< the fixed cameras and points; where they leave something free there are no covariances
  first_camera,  ///< what they leave free, the first camera that moves; the scale, its distance to the one
                 ///< that is farthest from it
  inner          ///< what they leave free, the whole: the pseudo-inverse, whose trace no other gauge undercuts
};

enum class covariance_status {
  done,
  nothing_to_do,       ///< no usable observation, or nothing that may move
  missing_pose,        ///< observation `where` names a pose that there is not
  missing_point,       ///< observation `where` names a point that there is not
  gauge_free,          ///< `free_directions` ways to move the whole change no observation
  undetermined_camera  ///< the observations do not determine camera `where`
};

[[nodiscard]] inline std::string describe(covariance_status status, std::size_t where) {
  switch (status) {
    case covariance_status::done: return "done";
    case covariance_status::nothing_to_do: return "nothing to do";
    case covariance_status::missing_pose:
      return "observation " + std::to_string(where) + " names a pose that there is not";
    case covariance_status::missing_point:
      return "observation " + std::to_string(where) + " names a point that there is not";
    case covariance_status::gauge_free: return "the whole can be moved without changing any observation";
    case covariance_status::undetermined_camera:
      return "camera " + std::to_string(where) + " is not determined by the observations";
  }
  return "unknown";
}

struct covariance_options {
  covariance_gauge gauge = covariance_gauge::as_given;
  std::span<const std::uint8_t> fixed_poses{};   ///< empty, or one for each camera: not 0 is known exactly
  std::span<const std::uint8_t> fixed_points{};  ///< empty, or one for each point, likewise
  std::span<const std::uint8_t> ignored{};       ///< empty, or one for each observation: not 0 leaves it out
  /// Pairs of cameras whose cross-covariance is wanted besides.
  std::span<const std::pair<std::uint32_t, std::uint32_t>> pairs{};
};

/// Covariances of the steps on a camera's manifold (for a pose: translation in metres, then rotation in
/// radians, both in the camera's own frame) and of points in the world. Zero for what is fixed; NaN where
/// there is no covariance: not a single observation, or, of a point, too few to determine it.
template <bundle_residual R>
struct bundle_covariance {
  using camera_block = matrix<R::camera_manifold::dimension, R::camera_manifold::dimension>;

  covariance_status status = covariance_status::nothing_to_do;
  std::size_t where = 0;
  int free_directions = 0;  ///< of the gauge, that the fixed cameras and points leave free
  std::vector<camera_block> cameras;
  std::vector<mat3> points;
  std::vector<camera_block> pairs;  ///< in the order asked for: rows are the first camera's, columns the second's
};

[[nodiscard]] inline bool is_failure(covariance_status status) noexcept { return status != covariance_status::done; }

namespace detail {

/// The computation; see `covariance_of`.
template <camera_frame_residual R, robust_loss Loss, reduced_solver Reduced>
class covariance_computation {
 public:
  static constexpr int camera_size = R::camera_manifold::dimension;
  using camera_state = typename R::camera_state;
  using observation = typename R::observation;
  using output = bundle_covariance<R>;
  using camera_block = typename output::camera_block;
  // By way of R: what is done with them is compiled only where there is a computation.
  using dense = Eigen::Matrix<typename camera_block::Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using dense_column = Eigen::Matrix<typename camera_block::Scalar, Eigen::Dynamic, 1>;

  covariance_computation(const R& residual, const Loss& loss, const Reduced& reduced)
      : equations_{residual, loss, reduced, simd::detected()} {}

  template <class Policy>
  output run(const Policy& policy, std::span<const camera_state> cameras, std::span<const vec3> points,
             std::span<const observation> observations, const covariance_options& options) {
    output out;
    for (std::size_t k = 0; k != observations.size(); ++k) {
      if (observations[k].pose < cameras.size() && observations[k].point < points.size()) continue;
      out.status =
          observations[k].pose < cameras.size() ? covariance_status::missing_point : covariance_status::missing_pose;
      out.where = k;
      return out;
    }
    linearize(policy, cameras, points, observations, options);
    if (points_ == 0) return out;
    find_free_directions(cameras, points);
    out.free_directions = static_cast<int>(gauge_.cols());
    if (gauge_.cols() != 0 && options.gauge == covariance_gauge::as_given) {
      out.status = covariance_status::gauge_free;
      return out;
    }
    // Any entries that hold the whole give the same covariances once the gauge is changed.
    const dense_column damping =
        holding_entries(gauge_, static_cast<Eigen::Index>(camera_size * unknowns_), equations_.diagonal());
    out.status = covariance_status::undetermined_camera;
    if (!equations_.eliminate(policy, damping) || !equations_.factor()) {
      out.where = equations_.failed_camera();
      return out;
    }
    invert_reduced(options);
    if (const auto weak = undetermined_unknown(); weak != unknowns_) {
      out.where = structure().camera[weak];
      return out;
    }
    if (gauge_.cols() != 0) change_gauge(options.gauge);
    out.status = covariance_status::done;
    write_cameras(out, cameras.size(), options);
    write_points(policy, out, points.size(), options);
    return out;
  }

 private:
  using mixed = matrix<camera_size, 3>;
  /// A coordinate whose variance is so much larger than what its own observations would give is not
  /// determined.
  static constexpr double weakest = 1e12;

  [[nodiscard]] const bundle_structure& structure() const { return equations_.structure(); }
  [[nodiscard]] Eigen::Index camera_row(std::size_t u) const { return static_cast<Eigen::Index>(camera_size * u); }
  [[nodiscard]] Eigen::Index point_row(std::size_t p) const {
    return static_cast<Eigen::Index>(camera_size * unknowns_ + 3 * p);
  }

  /// Normal equations without the points that nothing determines.
  template <class Policy>
  void linearize(const Policy& policy, std::span<const camera_state> cameras, std::span<const vec3> points,
                 std::span<const observation> observations, const covariance_options& options) {
    assert(options.fixed_poses.empty() || options.fixed_poses.size() == cameras.size());
    assert(options.fixed_points.empty() || options.fixed_points.size() == points.size());
    assert(options.ignored.empty() || options.ignored.size() == observations.size());
    ignored_.assign(observations.size(), 0);
    std::copy(options.ignored.begin(), options.ignored.end(), ignored_.begin());
    const auto attempt = [&] {
      equations_.set_structure(cameras.size(), points.size(), observations, options.fixed_poses, false);
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
  /// Which ways to move, turn and scale the whole leave all residuals as they are: `gauge_`, orthonormal.
  void find_free_directions(std::span<const camera_state> cameras, std::span<const vec3> points) {
    const auto rows = static_cast<Eigen::Index>(camera_size * unknowns_ + 3 * points_);
    dense all = dense::Zero(rows, 7);  // shift, turn, scale, about the middle of the cameras
    centres_.resize(unknowns_);
    rotations_.resize(unknowns_);
    vec3 middle = vec3::Zero();
    std::size_t seeing = 0;
    for (std::size_t u = 0; u != unknowns_; ++u) {
      if (is_blind(u)) continue;  // its pose may not even be finite
      ++seeing;
      const auto view = equations_.residual().prepare(cameras[structure().camera[u]]);
      rotations_[u] = view.rotation;
      centres_[u] = -(view.rotation.transpose() * view.translation);
      middle += centres_[u];
    }
    if (seeing == 0) {  // every observation is by a camera that is known
      gauge_.resize(rows, 0);
      return;
    }
    middle /= static_cast<double>(seeing);
    for (std::size_t u = 0; u != unknowns_; ++u) {
      if (is_blind(u)) continue;
      const vec3 from_middle = centres_[u] - middle;
      auto block = all.template middleRows<6>(camera_row(u));
      block.template block<3, 3>(0, 0) = rotations_[u];
      block.template block<3, 3>(0, 3) = -rotations_[u] * hat<double>(from_middle);
      block.template block<3, 3>(3, 3) = rotations_[u];
      block.template block<3, 1>(0, 6) = rotations_[u] * from_middle;
    }
    for (std::size_t p = 0; p != points_; ++p) {
      if (!moves_point(p)) continue;
      const vec3 from_middle = points[structure().point_source[p]] - middle;
      auto block = all.template middleRows<3>(point_row(p));
      block.template block<3, 3>(0, 0).setIdentity();
      block.template block<3, 3>(0, 3) = -hat<double>(from_middle);
      block.col(6) = from_middle;
    }
    dense energy(7, 7);
    dense_column alone(7);
    for (Eigen::Index i = 0; i != 7; ++i) {
      alone[i] = all.col(i).cwiseAbs2().dot(equations_.diagonal());
      energy(i, i) = equations_.curvature(all.col(i));
    }
    for (Eigen::Index i = 0; i != 7; ++i)
      for (Eigen::Index j = 0; j != i; ++j)
        energy(i, j) = energy(j, i) =
            0.5 * (equations_.curvature(all.col(i) + all.col(j)) - energy(i, i) - energy(j, j));
    gauge_ = free_directions(all, energy, alone);
  }
  /// Not fixed, and determined by its observations.
  [[nodiscard]] bool moves_point(std::size_t p) const {
    const std::size_t source = structure().point_source[p];
    return is_fixed_point_[source] == 0 && is_weak_[source] == 0;
  }
  /// Whether no observation by this camera takes part.
  [[nodiscard]] bool is_blind(std::size_t u) const { return equations_.camera_hessian(u).isZero(0.0); }

  /// The blocks of the inverse of the reduced system that cameras, points and pairs need: those where it
  /// has blocks itself, and the pairs.
  void invert_reduced(const covariance_options& options) {
    block_at_.assign(structure().slots.size(), camera_block::Zero());
    pair_blocks_.assign(options.pairs.size(), camera_block::Zero());
    std::vector<std::vector<std::uint32_t>> slots_of(unknowns_);
    for (std::uint32_t s = 0; s != structure().slots.size(); ++s) slots_of[structure().slots[s].column].push_back(s);
    std::vector<std::vector<std::uint32_t>> pairs_of(unknowns_);
    for (std::uint32_t k = 0; k != options.pairs.size(); ++k) {
      const auto [a, b] = options.pairs[k];
      assert(a < structure().unknown.size() && b < structure().unknown.size());
      if (structure().unknown[a] != bundle_structure::none && structure().unknown[b] != bundle_structure::none)
        pairs_of[structure().unknown[b]].push_back(k);
    }
    std::vector<double> x(camera_size * unknowns_);
    for (std::size_t u = 0; u != unknowns_; ++u)
      for (int c = 0; c != camera_size; ++c) {
        std::fill(x.begin(), x.end(), 0.0);
        x[camera_size * u + static_cast<std::size_t>(c)] = 1.0;
        equations_.solve_reduced(x);
        const auto part = [&](std::uint32_t row) {
          return Eigen::Map<const matrix<camera_size>>(x.data() + camera_size * std::size_t{row});
        };
        for (const std::uint32_t s : slots_of[u]) block_at_[s].col(c) = part(structure().slots[s].row);
        for (const std::uint32_t k : pairs_of[u])
          pair_blocks_[k].col(c) = part(structure().unknown[options.pairs[k].first]);
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

  /// What the matrix that was factored makes of `right`, whole.
  void solve(Eigen::Ref<dense_column> x) {
    std::vector<double> cameras(camera_size * unknowns_);
    std::copy_n(x.data(), cameras.size(), cameras.data());
    std::vector<vec3> solved(points_);
    const auto mixed_rows = [&](std::size_t a) {
      return Eigen::Map<matrix<camera_size>>(cameras.data() + camera_size * std::size_t{structure().mixed_unknown[a]});
    };
    for (std::size_t p = 0; p != points_; ++p) {
      solved[p] = point_inverse(p) * x.template segment<3>(point_row(p));
      for (std::uint32_t a = structure().first_mixed[p]; a != structure().first_mixed[p + 1]; ++a)
        mixed_rows(a) -= mixed_of(a, p) * solved[p];
    }
    if (unknowns_ != 0) equations_.solve_reduced(cameras);
    std::copy(cameras.begin(), cameras.end(), x.data());
    for (std::size_t p = 0; p != points_; ++p) {
      vec3 pulled = vec3::Zero();
      for (std::uint32_t a = structure().first_mixed[p]; a != structure().first_mixed[p + 1]; ++a)
        pulled += mixed_of(a, p).transpose() * mixed_rows(a);
      x.template segment<3>(point_row(p)) = solved[p] - point_inverse(p) * pulled;
    }
  }
  [[nodiscard]] mixed mixed_of(std::size_t a, std::size_t p) const {
    return moves_point(p) ? mixed(equations_.mixed_block(a)) : mixed(mixed::Zero());
  }
  [[nodiscard]] mat3 point_inverse(std::size_t p) const {
    if (!moves_point(p)) return mat3::Zero();
    return equations_.point_hessian(p).llt().solve(mat3::Identity());
  }

  void change_gauge(covariance_gauge gauge) {
    const dense constraints = gauge == covariance_gauge::first_camera ? first_camera_constraints() : gauge_;
    dense solved = constraints;
    for (Eigen::Index k = 0; k != solved.cols(); ++k) solve(solved.col(k));
    change_.set(constraints, gauge_, std::move(solved));
  }
  /// The first camera that moves, as far as the free directions move it; where they can leave it in place,
  /// its distance to the farthest one besides.
  [[nodiscard]] dense first_camera_constraints() const {
    std::size_t first = 0;
    while (first + 1 != unknowns_ && is_blind(first)) ++first;
    std::size_t farthest = first;
    for (std::size_t u = first; u != unknowns_; ++u)
      if (!is_blind(u) && (centres_[u] - centres_[first]).norm() > (centres_[farthest] - centres_[first]).norm())
        farthest = u;
    dense candidates = dense::Zero(gauge_.rows(), 7);
    for (int i = 0; i != 6; ++i) candidates(camera_row(first) + i, i) = 1.0;
    const vec3 away = centres_[farthest] - centres_[first];
    if (away.norm() > 0.0)
      candidates.col(6).template segment<3>(camera_row(farthest)) = rotations_[farthest] * away.normalized();
    return holding_constraints(candidates, 6, gauge_);
  }
  template <int Rows, int Columns>
  [[nodiscard]] matrix<Rows, Columns> in_gauge(matrix<Rows, Columns> block, Eigen::Index row,
                                               Eigen::Index column) const {
    if (gauge_.cols() != 0) change_.apply(block.data(), Rows, Columns, row, column);
    return block;
  }

  void write_cameras(output& out, std::size_t cameras, const covariance_options& options) const {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto nothing_known = [&](std::size_t c) {
      const std::uint32_t u = structure().unknown[c];
      if (u == bundle_structure::none) return options.fixed_poses.empty() || options.fixed_poses[c] == 0;
      return is_blind(u);
    };
    out.cameras.assign(cameras, camera_block::Zero());
    for (std::size_t c = 0; c != cameras; ++c)
      if (nothing_known(c)) out.cameras[c].setConstant(nan);
    for (std::size_t s = 0; s != structure().slots.size(); ++s) {
      const block_place& slot = structure().slots[s];
      if (slot.row != slot.column || is_blind(slot.row)) continue;
      camera_block& block = out.cameras[structure().camera[slot.row]];
      block = in_gauge<camera_size, camera_size>(block_at_[s], camera_row(slot.row), camera_row(slot.row));
      block = (0.5 * (block + block.transpose())).eval();
    }
    out.pairs.assign(options.pairs.size(), camera_block::Zero());
    for (std::size_t k = 0; k != options.pairs.size(); ++k) {
      const auto [a, b] = options.pairs[k];
      const std::uint32_t ua = structure().unknown[a], ub = structure().unknown[b];
      if (nothing_known(a) || nothing_known(b))
        out.pairs[k].setConstant(nan);
      else if (ua != bundle_structure::none && ub != bundle_structure::none)
        out.pairs[k] = in_gauge<camera_size, camera_size>(pair_blocks_[k], camera_row(ua), camera_row(ub));
    }
  }

  /// V^-1 + V^-1 W^T S^-1 W V^-1, of which the sum over pairs of cameras takes most.
  template <class Policy>
  void write_points(const Policy& policy, output& out, std::size_t points, const covariance_options& options) const {
    out.points.assign(points, mat3::Constant(std::numeric_limits<double>::quiet_NaN()));
    for (std::size_t j = 0; j != points; ++j)
      if (!options.fixed_points.empty() && options.fixed_points[j] != 0) out.points[j].setZero();
    for_each_index(policy, points_, 64, [&](std::size_t p) {
      const std::size_t source = structure().point_source[p];
      if (!moves_point(p)) return;
      const std::uint32_t begin = structure().first_mixed[p], end = structure().first_mixed[p + 1];
      mat3 sum = mat3::Zero();
      std::size_t pair = structure().first_pair[p];
      for (std::uint32_t a = begin; a != end; ++a)
        for (std::uint32_t b = begin; b <= a; ++b, ++pair) {
          const mat3 share = equations_.mixed_block(a).transpose() * block_at_[structure().pair_slot[pair]] *
                             equations_.mixed_block(b);
          sum += share;
          if (a != b) sum += share.transpose();
        }
      const mat3 inverse = point_inverse(p);
      const mat3 block = in_gauge<3, 3>(inverse + inverse * sum * inverse, point_row(p), point_row(p));
      out.points[source] = 0.5 * (block + block.transpose());
    });
  }

  bundle_equations<R, Loss, Reduced> equations_;
  std::size_t unknowns_ = 0, points_ = 0;
  std::vector<std::uint8_t> ignored_, is_fixed_point_, is_weak_;
  std::vector<vec3> centres_;
  std::vector<mat3> rotations_;
  std::vector<camera_block> block_at_, pair_blocks_;  // of the inverse
  dense gauge_;                                       ///< what is free of the whole, by columns
  gauge_change change_;
};

}  // namespace detail

/// The covariances at these estimates, which should be a minimum: the inverse of J^T W J with the
/// weights of the loss there, `information` taken as 1 / sigma^2. Points that their observations do not
/// determine, in one view without depth say, take no part.
///
/// O(observations + sum over the points of the square of how many cameras see them), and for each camera
/// as many solutions of the reduced system as it has coordinates. The same for every policy.
/// @pre the options' spans are empty or of matching length, their pairs in range
template <execution_policy Policy, camera_frame_residual R, robust_loss Loss = trivial,
          reduced_solver Reduced = automatic_reduced_solver>
[[nodiscard]] bundle_covariance<R> covariance_of(const Policy& policy, const R& residual,
                                                 std::span<const typename R::camera_state> cameras,
                                                 std::span<const vec3> points,
                                                 std::span<const typename R::observation> observations,
                                                 const covariance_options& options = {}, const Loss& loss = {},
                                                 const Reduced& reduced = {}) {
  return detail::covariance_computation<R, Loss, Reduced>{residual, loss, reduced}.run(policy, cameras, points,
                                                                                       observations, options);
}

}  // namespace orbis::optimize
