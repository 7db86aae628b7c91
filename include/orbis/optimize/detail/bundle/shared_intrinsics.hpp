// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The normal equations of poses, points and one shared camera model.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <orbis/camera/parameters.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize::detail {

/// Levenberg-Marquardt with eliminated points and a dense reduced system: six unknowns for each image except the first,
/// followed by the estimated camera parameters.
template <camera::parametric_camera Camera>
class shared_intrinsics {
  using parameters = camera::parameters_of<Camera>;
  using residual_type = reprojection_with_intrinsics<Camera>;
  using view_type = typename residual_type::view;
  // Theta, the vector of camera unknowns, has room for all parameters; only the first `count_` entries are used.
  using by_theta_type = matrix<3, parameters::count>;
  using block_63 = matrix<6, 3>;
  using block_t3 = matrix<parameters::count, 3>;
  using block_t6 = matrix<parameters::count, 6>;
  using theta_vector = matrix<parameters::count>;
  using basis_type = matrix<parameters::count, parameters::count>;

  struct estimate {
    Camera camera;
    std::vector<se3> poses;
    std::vector<vec3> points;
  };
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  /// Reason for the exclusion of an observation.
  enum class out : std::uint8_t {
    no,
    outlier,  ///< inconsistent with the estimate
    alone     ///< its image or point is not determined, or not connected to the largest component
  };

 public:
  /// Excludes points with fewer than two usable observations, and points behind a camera at the start.
  shared_intrinsics(const Camera& start, double bf, std::uint32_t free, bool keeps_aspect, std::span<const se3> poses,
                    std::span<const vec3> points, std::span<const bundle_observation> observations)
      : residual_{bf}, now_{start, {poses.begin(), poses.end()}, {points.begin(), points.end()}} {
    constexpr std::uint32_t focal_lengths = 0x3;
    const bool ties = keeps_aspect && (free & focal_lengths) == focal_lengths;
    for (int i = 0; i != parameters::count; ++i) {
      if ((free >> i & 1U) == 0 || (ties && i == 1)) continue;
      basis_(i, count_++) = 1.0;
    }
    if (ties) basis_(1, 0) = parameters::get(start)[1] / parameters::get(start)[0];
    choose(observations);
    keep_connected();
  }

  /// The number of observations used, and the number of outliers among them.
  [[nodiscard]] std::size_t observations() const noexcept {
    return static_cast<std::size_t>(std::count_if(out_.begin(), out_.end(), [](out o) { return o != out::alone; }));
  }
  [[nodiscard]] std::size_t outliers() const noexcept {
    return static_cast<std::size_t>(std::count(out_.begin(), out_.end(), out::outlier));
  }
  /// Returns true if depth observations determine the scale.
  [[nodiscard]] bool has_depth() const {
    for (std::size_t k = 0; k != observations_.size(); ++k)
      if (out_[k] == out::no && observations_[k].has_depth()) return true;
    return false;
  }
  [[nodiscard]] const Camera& camera() const noexcept { return now_.camera; }
  void write(std::span<se3> poses, std::span<vec3> points) const {
    std::copy(now_.poses.begin(), now_.poses.end(), poses.begin());
    std::copy(now_.points.begin(), now_.points.end(), points.begin());
  }

  /// Iterates until the cost stops decreasing; counts the steps in `steps`. Returns false if `go_on()` returned false.
  template <class GoOn>
  [[nodiscard]] bool descend(int limit, double relative_tolerance, int& steps, const GoOn& go_on) {
    set_noise();
    double cost = total_cost(now_), damping = 1e-4;
    for (int taken = 0; taken < limit;) {
      if (!go_on()) return false;
      linearize();
      double gain = -1.0;
      for (; damping < 1e8; damping *= 10.0) {
        const std::optional<estimate> tried = step(damping);
        gain = tried ? cost - total_cost(*tried) : -1.0;
        if (!(gain >= 0.0)) continue;
        now_ = *tried;
        damping = std::max(damping * 0.1, 1e-12);
        break;
      }
      if (!(gain >= 0.0)) return true;
      ++taken, ++steps;
      cost -= gain;
      if (gain <= relative_tolerance * cost) return true;
    }
    return true;
  }

  /// Excludes observations that are inconsistent with the estimate, and restores those that are consistent again.
  void update_outliers() {
    constexpr double gates[] = {13.816, 16.266};  // the 99.9 % quantiles of chi-squared, for two and three coordinates
    set_noise();
    const std::vector<view_type> views = make_views(now_);
    for (std::size_t k = 0; k != observations_.size(); ++k) {
      const double gate = gates[observations_[k].has_depth() ? 1 : 0] * noise_ * noise_;
      out_[k] = squared(views, now_.points, k) > gate ? out::outlier : out::no;
    }
    keep_connected();
  }

  /// Returns the root mean square of the entries of the whitened residuals.
  [[nodiscard]] double rms() const { return residual_rms(now_.camera, now_.poses, now_.points); }
  [[nodiscard]] double residual_rms(const Camera& camera, std::span<const se3> poses,
                                    std::span<const vec3> points) const {
    const estimate e{camera, {poses.begin(), poses.end()}, {points.begin(), points.end()}};
    const std::vector<view_type> views = make_views(e);
    double sum = 0.0, entries = 0.0;
    for (std::size_t k = 0; k != observations_.size(); ++k) {
      const double s = out_[k] != out::no ? std::numeric_limits<double>::infinity() : squared(views, e.points, k);
      if (!std::isfinite(s)) continue;
      sum += s;
      entries += observations_[k].has_depth() ? 3.0 : 2.0;
    }
    return entries > 0.0 ? std::sqrt(sum / entries) : 0.0;
  }

  /// Computes the covariance of the parameters at the current estimate; returns false if they are not determined.
  template <class Matrix>
  [[nodiscard]] bool covariance(Matrix& out) {
    out = zeros<Matrix>();
    if (count_ == 0) return true;
    linearize();
    reduce(0.0);
    const Eigen::Index size = reduced_.rows(), first = size - count_;
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(reduced_);
    if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-14)) return false;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(size, count_);  // rows of the inverse
    for (int i = 0; i != count_; ++i) rows(first + i, i) = 1.0;
    factor.solveInPlace(rows);
    basis_type spread = zeros<basis_type>();
    double points = 0.0;
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      if (!eliminate(p, 0.0)) continue;
      theta_vector move = zeros<theta_vector>();
      for (int i = 0; i != count_; ++i) {
        for (int k = 0; k != count_; ++k) move[i] += rows(first + k, i) * point_.theta_gradient[k];
        for (const seen& o : point_.by)
          if (o.row != none)
            for (int k = 0; k != 6; ++k) move[i] += rows(static_cast<Eigen::Index>(o.row) + k, i) * o.gradient[k];
      }
      spread += outer_product(move, move);
      points += 1.0;
    }
    spread *= points / std::max(points - 1.0, 1.0);
    out = basis_ * spread * transposed(basis_);
    return all_finite(out);
  }

 private:
  void choose(std::span<const bundle_observation> all) {
    const std::vector<view_type> views = make_views(now_);
    std::vector<std::vector<std::uint32_t>> by_point(now_.points.size());
    for (std::size_t k = 0; k != all.size(); ++k) {
      const bundle_observation& o = all[k];
      if (residual_type::is_usable(o) && residual_.residual(views[o.pose], now_.points[o.point], o))
        by_point[o.point].push_back(static_cast<std::uint32_t>(k));
    }
    begins_.assign(1, 0);
    for (const auto& seen_by : by_point) {
      if (seen_by.size() < 2) continue;
      for (const std::uint32_t k : seen_by) observations_.push_back(all[k]);
      begins_.push_back(observations_.size());
    }
    out_.assign(observations_.size(), out::no);
  }
  /// Sets the standard deviation of the residuals, estimated from their median.
  void set_noise() {
    constexpr double medians[] = {1.386, 2.366};  // medians of chi-squared, for two and three coordinates
    constexpr double least = 0.01;  // lower limit, so that rounding errors of noise-free data do not count as noise
    const std::vector<view_type> views = make_views(now_);
    std::vector<double> shares;
    for (std::size_t k = 0; k != observations_.size(); ++k)
      if (out_[k] == out::no) {
        const double s = squared(views, now_.points, k) / medians[observations_[k].has_depth() ? 1 : 0];
        if (std::isfinite(s)) shares.push_back(s);
      }
    if (shares.empty()) return;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    noise_ = std::max(least, std::sqrt(*middle));
    loss_.width = 2.447 * noise_;
  }

  /// Excludes images with too few observations, points that have fewer than two observations or are not determined by
  /// their observations, and all images and points outside the largest connected component.
  void keep_connected() {
    for (out& o : out_)
      if (o == out::alone) o = out::no;
    views_ = make_views(now_);
    row_of_.assign(now_.poses.size(), none);
    parts_.resize(begins_.size() - 1);
    seen_.resize(observations_.size());
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      linearize_point(p);
      if (!eliminate(p, 0.0)) set_aside(p);
    }
    drop_weak();
    const std::vector<std::uint32_t> part = parts();
    std::vector<std::size_t> sizes(now_.poses.size(), 0);
    for (std::size_t k = 0; k != out_.size(); ++k) sizes[part[observations_[k].pose]] += out_[k] == out::no;
    const auto largest = static_cast<std::uint32_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    for (std::size_t k = 0; k != out_.size(); ++k)
      if (out_[k] == out::no && part[observations_[k].pose] != largest) out_[k] = out::alone;
    number_images();
  }
  /// Excludes all observations of a point.
  void set_aside(std::size_t p) {
    for (std::size_t k = begins_[p]; k != begins_[p + 1]; ++k)
      if (out_[k] == out::no) out_[k] = out::alone;
  }
  void drop_weak() {
    constexpr std::size_t least = 10;
    for (bool changed = true; changed;) {
      changed = false;
      std::vector<std::size_t> seen(now_.poses.size(), 0);
      for (std::size_t k = 0; k != out_.size(); ++k) seen[observations_[k].pose] += out_[k] == out::no;
      for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
        std::size_t held = 0;
        for (std::size_t k = begins_[p]; k != begins_[p + 1]; ++k) {
          if (out_[k] == out::no && seen[observations_[k].pose] < least) out_[k] = out::alone, changed = true;
          held += out_[k] == out::no;
        }
        if (held == 1) set_aside(p), changed = true;
      }
    }
  }
  /// Returns the connected components of images that share points: for each image, the first image of its component.
  [[nodiscard]] std::vector<std::uint32_t> parts() const {
    std::vector<std::uint32_t> first(now_.poses.size());
    for (std::uint32_t i = 0; i != first.size(); ++i) first[i] = i;
    const auto find = [&](std::uint32_t i) {
      while (first[i] != i) i = first[i] = first[first[i]];
      return i;
    };
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      std::uint32_t with = none;
      for (std::size_t k = begins_[p]; k != begins_[p + 1]; ++k) {
        if (out_[k] != out::no) continue;
        const std::uint32_t of = find(observations_[k].pose);
        if (with == none) with = of;
        first[std::max(with, of)] = std::min(with, of);
        with = std::min(with, of);
      }
    }
    for (std::uint32_t i = 0; i != first.size(); ++i) first[i] = find(i);
    return first;
  }
  void number_images() {
    row_of_.assign(now_.poses.size(), none);
    std::vector<std::uint8_t> has(now_.poses.size(), 0);
    for (std::size_t k = 0; k != out_.size(); ++k)
      if (out_[k] == out::no) has[observations_[k].pose] = 1;
    bool is_first = true;
    std::uint32_t rows = 0;
    for (std::size_t i = 0; i != has.size(); ++i) {
      if (has[i] == 0) continue;
      if (!is_first) row_of_[i] = rows, rows += 6;
      is_first = false;
    }
    pose_rows_ = static_cast<Eigen::Index>(rows);
  }

  [[nodiscard]] static std::vector<view_type> make_views(const estimate& e) {
    std::vector<view_type> views;
    views.reserve(e.poses.size());
    for (const se3& pose : e.poses) views.push_back(residual_type::prepare({pose, e.camera}));
    return views;
  }
  [[nodiscard]] double squared(const std::vector<view_type>& views, const std::vector<vec3>& points,
                               std::size_t k) const {
    const bundle_observation& o = observations_[k];
    auto r = residual_.residual(views[o.pose], points[o.point], o);
    if (r && o.has_depth())
      (*r)[2] = o.depth_weight * ((*r)[2] - (*r)[0]);  // only the depth error: the difference of inverse depths
    return r ? o.information * squared_norm(*r) : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] double total_cost(const estimate& e) const {
    const std::vector<view_type> views = make_views(e);
    double sum = 0.0;
    for (std::size_t k = 0; k != observations_.size(); ++k)
      if (out_[k] == out::no) sum += loss_.cost(squared(views, e.points, k));
    return 0.5 * sum;
  }

  /// The contribution of an observation to the normal equations.
  struct seen {
    bool takes_part = false;
    std::uint32_t row = none;  ///< first row of the image's unknowns
    block_63 pose_point;
    vec6 gradient;  ///< with respect to the image pose
  };
  /// The sum of the contributions of a point's observations.
  struct point_part {
    bool is_determined = false;  ///< true if the observations determine the point
    mat3 own = zeros<mat3>();
    vec3 gradient = zeros<vec3>();
    block_t3 theta_point = zeros<block_t3>();
    theta_vector theta_gradient = zeros<theta_vector>();
  };
  /// The contribution of a point, with its own unknowns eliminated from the gradients.
  struct eliminated {
    std::vector<seen> by;
    block_t3 theta_point;
    theta_vector theta_gradient;
    mat3 inverse;  ///< inverse of the point's own block
    vec3 gradient;
  };

  /// Computes the contribution of point `p`, and the derivatives of its residuals.
  void linearize_point(std::size_t p) {
    const vec3& at = now_.points[observations_[begins_[p]].point];
    point_part& part = parts_[p];
    part = {};
    rows_.clear();
    for (std::size_t k = begins_[p]; k != begins_[p + 1]; ++k) {
      seen& s = seen_[k];
      s.takes_part = false;
      if (out_[k] != out::no) continue;
      const bundle_observation& o = observations_[k];
      const view_type& view = views_[o.pose];
      const vec3 q = view.rotation * at + view.translation;
      mat3 by_q;
      matrix<3, parameters::count> by_all;
      auto r = residual_.linearize_in_camera(view, q, o, by_q, by_all);
      if (!r) continue;
      if (o.has_depth()) {
        const double w = o.depth_weight;
        (*r)[2] = w * ((*r)[2] - (*r)[0]);
        for (int i = 0; i != 3; ++i) by_q(2, i) = w * (by_q(2, i) - by_q(0, i));
        for (int i = 0; i != parameters::count; ++i) by_all(2, i) = w * (by_all(2, i) - by_all(0, i));
      }
      s.takes_part = true;
      s.row = row_of_[o.pose];
      const double weight = o.information * loss_.weight(o.information * squared_norm(*r));
      const jacobians j{s.row, weight, side_by_side(-by_q, by_q * hat<double>(q)), by_all * basis_};
      const mat3 by_point = by_q * view.rotation;
      const mat3 weighted = weight * by_point;
      const vec3 pull = weight * *r;
      part.own += transposed(by_point) * weighted;
      part.gradient += transposed(by_point) * pull;
      part.theta_point += transposed(j.by_theta) * weighted;
      part.theta_gradient += transposed(j.by_theta) * pull;
      s.pose_point = transposed(j.by_pose) * weighted;
      s.gradient = transposed(j.by_pose) * pull;
      rows_.push_back(j);
    }
    part.is_determined = rows_.size() >= 2;
  }

  /// Adds `part` to a matrix, starting at (row, column), without the unused entries of theta.
  template <int R, int C>
  void add(Eigen::MatrixXd& to, Eigen::Index row, Eigen::Index column, const matrix<R, C>& part) const {
    const int rows = row == pose_rows_ ? count_ : R, columns = column == pose_rows_ ? count_ : C;
    for (int c = 0; c != columns; ++c)
      for (int r = 0; r != rows; ++r) to(row + r, column + c) += part(r, c);
  }
  static void clear(Eigen::MatrixXd& m, Eigen::Index size) {
    m.resize(size, size);
    std::fill_n(m.data(), m.size(), 0.0);
  }

  /// Adds the terms of the linearised point that do not involve its own unknowns.
  void add_direct_terms() {
    const Eigen::Index theta = pose_rows_;
    for (const jacobians& j : rows_) {
      const matrix<6, 3> weighted = j.weight * transposed(j.by_pose);
      add(direct_, theta, theta, basis_type(transposed(j.by_theta) * (j.weight * j.by_theta)));
      if (j.row == none) continue;
      add(direct_, j.row, j.row, mat6(weighted * j.by_pose));
      add(direct_, theta, j.row, block_t6(transposed(weighted * j.by_theta)));
    }
  }

  /// Computes `point_` from the contribution of point `p`. Returns false if the observations do not determine it.
  [[nodiscard]] bool eliminate(std::size_t p, double damping) {
    const point_part& part = parts_[p];
    if (!part.is_determined) return false;
    mat3 own = part.own;
    change_diagonal(own, 1.0 + damping, 0.0);
    small_cholesky<3> factor;
    if (!factor.set(own) || !(factor.factor(0.0) > 0.0)) return false;
    point_.inverse = factor.inverse();
    if (!(1.0 > 1e-12 * one_norm(own) * one_norm(point_.inverse))) return false;
    point_.gradient = part.gradient;
    const vec3 back = point_.inverse * part.gradient;
    point_.theta_point = part.theta_point;
    point_.theta_gradient = part.theta_gradient - part.theta_point * back;
    point_.by.clear();
    for (std::size_t k = begins_[p]; k != begins_[p + 1]; ++k) {
      if (!seen_[k].takes_part) continue;
      point_.by.push_back(seen_[k]);
      point_.by.back().gradient -= seen_[k].pose_point * back;
    }
    return true;
  }

  /// Returns the 1-norm: the largest column sum of magnitudes. Its product with the 1-norm of the inverse is the
  /// condition number.
  [[nodiscard]] static double one_norm(const mat3& m) {
    double most = 0.0;
    for (int c = 0; c != 3; ++c) most = std::max(most, std::abs(m(0, c)) + std::abs(m(1, c)) + std::abs(m(2, c)));
    return most;
  }

  /// Subtracts the terms that involve the unknowns of `point_` from the lower triangle of the system.
  void subtract_eliminated() {
    const Eigen::Index theta = pose_rows_;
    const block_t3 theta_inverse = point_.theta_point * point_.inverse;
    add(removed_, theta, theta, basis_type(theta_inverse * transposed(point_.theta_point)));
    for (const seen& a : point_.by) {
      if (a.row == none) continue;
      const block_63 a_inverse = a.pose_point * point_.inverse;
      add(removed_, theta, a.row, block_t6(theta_inverse * transposed(a.pose_point)));
      for (const seen& b : point_.by)
        if (b.row <= a.row) add(removed_, a.row, b.row, mat6(a_inverse * transposed(b.pose_point)));
    }
  }

  /// Linearises all residuals at the current estimate.
  void linearize() {
    views_ = make_views(now_);
    clear(direct_, pose_rows_ + count_);
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      linearize_point(p);
      parts_[p].is_determined = eliminate(p, 0.0);
      if (parts_[p].is_determined) add_direct_terms();
    }
  }

  /// Computes the reduced system with `damping` times its diagonal added (before the elimination of the points), and
  /// its gradient.
  void reduce(double damping) {
    const Eigen::Index size = direct_.rows();
    clear(removed_, size);
    gradient_.assign(static_cast<std::size_t>(size), 0.0);
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      if (!eliminate(p, damping)) continue;
      subtract_eliminated();
      double* const by_theta = gradient_.data() + pose_rows_;
      for (int i = 0; i != count_; ++i) by_theta[i] += point_.theta_gradient[i];
      for (const seen& s : point_.by)
        if (s.row != none)
          for (int i = 0; i != 6; ++i) gradient_.data()[static_cast<int>(s.row) + i] += s.gradient[i];
    }
    clear(reduced_, size);
    for (Eigen::Index c = 0; c != size; ++c)
      for (Eigen::Index r = c; r != size; ++r)
        reduced_(r, c) = direct_(r, c) * (r == c ? 1.0 + damping : 1.0) - removed_(r, c);
  }

  /// Returns the estimate after a damped step; empty if there is no step, or if the camera would be invalid.
  [[nodiscard]] std::optional<estimate> step(double damping) {
    reduce(damping);
    const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(reduced_);
    if (factor.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXd d(reduced_.rows());
    std::transform(gradient_.begin(), gradient_.end(), d.data(), [](double g) { return -g; });
    factor.solveInPlace(d);
    if (!std::all_of(d.data(), d.data() + d.size(), [](double x) { return std::isfinite(x); })) return std::nullopt;
    theta_vector theta = zeros<theta_vector>();
    for (int i = 0; i != count_; ++i) theta[i] = d[pose_rows_ + i];
    const std::optional<Camera> camera = parameters::with(now_.camera, parameters::get(now_.camera) + basis_ * theta);
    if (!camera) return std::nullopt;
    estimate to{*camera, now_.poses, now_.points};
    for (std::size_t p = 0; p + 1 < begins_.size(); ++p) {
      if (!eliminate(p, damping)) continue;
      vec3 pull = point_.gradient + transposed(point_.theta_point) * theta;
      for (const seen& s : point_.by)
        if (s.row != none) pull += transposed(s.pose_point) * segment<6>(d, s.row);
      to.points[observations_[begins_[p]].point] -= point_.inverse * pull;
    }
    for (std::size_t i = 0; i != to.poses.size(); ++i)
      if (row_of_[i] != none) to.poses[i] = to.poses[i] * se3::exp(vec6(segment<6>(d, row_of_[i])));
    return to;
  }

  /// The derivatives of one residual.
  struct jacobians {
    std::uint32_t row;  ///< first row of the image's unknowns
    double weight;
    matrix<3, 6> by_pose;
    by_theta_type by_theta;
  };

  residual_type residual_;
  double noise_ = 1.0;  ///< standard deviation of the whitened residuals
  huber loss_{2.447};   ///< width: square root of the chi-squared gate for two coordinates, times noise_
  estimate now_;
  basis_type basis_ = zeros<basis_type>();        ///< derivatives of the parameters, one column per unknown
  int count_ = 0;                                 ///< number of unknowns of the camera
  std::vector<bundle_observation> observations_;  ///< ordered by point
  std::vector<std::size_t> begins_;               ///< start of each point's observations, followed by the end
  std::vector<out> out_;                          ///< for each observation, the reason for its exclusion
  std::vector<std::uint32_t> row_of_;             ///< for each image: its first unknown; `none` if its pose is fixed
  Eigen::Index pose_rows_ = 0;

  std::vector<view_type> views_;
  std::vector<seen> seen_;                      ///< contribution of each observation at the last linearisation
  std::vector<point_part> parts_;               ///< contribution of each point at the last linearisation
  std::vector<jacobians> rows_;                 ///< derivatives of the residuals of the last linearised point
  Eigen::MatrixXd direct_, reduced_, removed_;  ///< lower triangles; `direct_`: before elimination and damping
  std::vector<double> gradient_;
  eliminated point_;
};

}  // namespace orbis::optimize::detail
