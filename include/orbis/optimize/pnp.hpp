// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera pose from matches between known points and pixels, most of which may be wrong.
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981); the parts as named in `ransac_policies.hpp` and `p3p.hpp`.
///
/// `S` is always double: what has it is a template so that only who uses it has it compiled.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
#include <orbis/optimize/detail/pose/descent.hpp>
#include <orbis/optimize/detail/sparse/small_cholesky.hpp>
#include <orbis/optimize/p3p.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct pnp_options {
  double threshold = 3.0;  ///< largest reprojection error of an inlier, pixels
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
  /// The matches from the best to the worst: samples are drawn in PROSAC's order. Every index once; empty where
  /// nothing is known.
  std::span<const std::uint32_t> best_first = {};
  simd::level level = simd::level::avx512;  ///< at most; the outcome does not depend on it
};

struct pose_estimate {
  se3 T_world_camera;
  std::vector<std::uint32_t> inliers;  ///< exactly the matches within the threshold at the pose, ascending
  double rmse = 0.0;                   ///< of the inliers' reprojection errors, pixels
  std::size_t iterations = 0;
};

/// Memory that can be used again: estimates allocate nothing but their inliers, once there is enough.
struct pnp_workspace {
  detail::pnp_matches matches;
  ransac_workspace ransac;
  std::vector<std::uint32_t> order, place, part;
};

namespace detail {

/// Of half the sum of squares, for a motion on the left of the pose; `cost` is the sum itself.
struct pose_equations {
  mat6 h;
  vec6 g;
  double cost;
};

/// As `descend` in general, by motions of the camera; `sum_up(pose, equations)`.
template <class SumUp>
[[nodiscard]] std::optional<centred_pose> descend_pose(const centred_pose& start, int steps, const SumUp& sum_up) {
  struct state {
    so3 rotation;
    centred_pose pose;
  };
  const so3 rotation(start.rotation);  // samples give rotations up to rounding and a little more
  const auto equations = [&](const state& s) {
    pose_equations e;
    sum_up(s.pose, e);
    return e;
  };
  const auto step = [](const state& s, const pose_equations& e) -> std::optional<state> {
    // The slightest damping: enough to leave alone what the matches do not determine.
    mat6 damped = e.h;
    damped.diagonal() *= 1.0 + 1e-9;
    damped.diagonal().array() += 1e-12 * e.h.diagonal().maxCoeff();
    small_cholesky<6> factors;
    if (!factors.set(damped) || !(factors.factor(0.0) > 0.0)) return std::nullopt;
    const vec6 d = -factors.solve(e.g);
    if (!(d.tail<3>().norm() < 1.0)) return std::nullopt;  // also where it is not a number
    const se3 motion = se3::exp(d);
    const so3 turned = motion.rotation() * s.rotation;
    return state{turned, {turned.rotation_matrix(), motion * s.pose.translation}};
  };
  const auto found = descend(state{rotation, {rotation.rotation_matrix(), start.translation}}, steps, equations, step);
  if (!found) return std::nullopt;
  return found->pose;
}

/// P3P with reprojection errors in pixels, as `ransac` wants it.
template <std::same_as<double> S = double>
class pnp_estimator {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;

 public:
  struct model {
    centred_pose pose;
    std::array<float, 12> rows{};  ///< the same, as the errors want it
  };
  static constexpr std::size_t sample_size = 3;

  /// Up to four models.
  struct candidates {
    std::array<model, 4> models;
    std::size_t size = 0;
    [[nodiscard]] const model* begin() const noexcept { return models.data(); }
    [[nodiscard]] const model* end() const noexcept { return models.data() + size; }
  };

  pnp_estimator(pnp_matches& matches, simd::level level) : matches_{matches}, kernels_{match_kernels::at(level)} {}

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

  /// A few steps of Gauss and Newton.
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
  /// The named matches side by side, filled up with ones of no weight; returns the number of groups of four.
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
    std::array<double, 4 * equation_sums> sums;
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

  pnp_matches& matches_;
  match_kernels kernels_;
};

/// Why there is no pose, by the points alone; empty if they are not to blame.
template <std::same_as<double> S = double>
[[nodiscard]] std::string pnp_degeneracy(const pnp_matches& matches) {
  using vec3 = matrix<3, 1, S>;
  using mat3 = matrix<3, 3, S>;
  mat3 covariance = mat3::Zero();
  for (const vec3& p : matches.points) covariance += p * p.transpose();
  const vec3 spread = eigen_of_symmetric<3>(covariance).values;
  // Up to the rounding of the points as they were, about the world's origin.
  const double rounding = 1e-30 * matches.centre.squaredNorm() * static_cast<double>(matches.size());
  if (!(spread[2] > rounding)) return "the points all lie in one place";
  if (!(spread[1] > 1e-12 * spread[2])) return "the points all lie on one line";
  return {};
}

}  // namespace detail

/// The pose from which the most of `points_world[i]` (metres) appear at `pixels[i]`: P3P in RANSAC with a sequential
/// test of its models, each new best one refined on its inliers. Matches that are not finite are outliers, as are
/// pixels that the camera cannot un-project. Deterministic by `options.seed`. `workspace` holds no state.
/// Errors: `invalid_argument` for spans of different length or options out of range, `no_data` below three matches,
/// `degenerate` where fewer than three can be used, where all points lie on a line or in one place, or where no pose
/// has `min_inliers` inliers; the message says which.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options,
                                                  pnp_workspace& workspace) {
  constexpr const char* where = "pnp";
  const std::size_t n = points_world.size();
  if (n != pixels.size()) return fail(errc::invalid_argument, where, "the lists of points and pixels differ in length");
  if (!options.best_first.empty() && options.best_first.size() != n)
    return fail(errc::invalid_argument, where, "the order of the matches names not each of them once");
  ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::fault_of(asked)) return fail(errc::invalid_argument, where, fault);
  asked.min_inliers = 0;  // they are counted at the end, with the camera as it is
  if (n < 3) return fail(errc::no_data, where, "fewer than three matches");

  detail::pnp_matches& matches = workspace.matches;
  matches.assign(points_world, pixels, camera, options.seed);
  if (matches.size() < 3)
    return fail(errc::degenerate, where,
                "of " + std::to_string(n) + " matches " + std::to_string(matches.size()) +
                    " are finite and in the camera's view, three are needed");
  using estimator_type = detail::pnp_estimator<>;
  const estimator_type estimator(matches, options.level);
  const auto search = [&](const auto& sampling) {
    return ransac(estimator, asked, ransac_policies{msac{}, sampling, sprt{}, iterated_refinement{}}, workspace.ransac);
  };
  result<ransac_estimate<estimator_type::model>> found = [&] {
    if (options.best_first.empty()) return search(uniform_sampling{});
    auto& place = workspace.place;
    auto& order = workspace.order;
    place.assign(n, std::numeric_limits<std::uint32_t>::max());
    for (std::size_t i = 0; i != matches.size(); ++i) place[matches.original[i]] = static_cast<std::uint32_t>(i);
    order.clear();
    order.reserve(n);
    for (const std::uint32_t i : options.best_first)
      if (i < n && place[i] < n) order.push_back(std::exchange(place[i], std::numeric_limits<std::uint32_t>::max()));
    if (order.size() != matches.size())
      return result<ransac_estimate<estimator_type::model>>(
          fail(errc::invalid_argument, where, "the order of the matches names not each of them once"));
    return search(prosac{order});
  }();
  if (!found) {
    if (found.error().code != errc::degenerate) return fail(found.error());
    const std::string why = detail::pnp_degeneracy(matches);
    return fail(errc::degenerate, where, why.empty() ? found.error().message : why);
  }

  // From here on with the camera as it is: the pose of the least truncated squared error, and its inliers.
  const double squared_threshold = options.threshold * options.threshold;
  const auto error_at = [&](const se3& T_camera_world, std::size_t i) {
    const auto pixel = camera.project(T_camera_world * points_world[i]);
    return pixel ? (*pixel - pixels[i]).squaredNorm() : std::numeric_limits<double>::infinity();
  };
  std::vector<std::uint32_t> inliers;
  inliers.reserve(n);
  double sum = 0.0;
  const auto judge = [&](const se3& T_world_camera) {  // the score; the inliers and their sum of squares
    const se3 T_camera_world = T_world_camera.inverse();
    inliers.clear();
    sum = 0.0;
    for (std::size_t i = 0; i != n; ++i) {
      const double e = error_at(T_camera_world, i);
      if (!(e < squared_threshold)) continue;
      inliers.push_back(static_cast<std::uint32_t>(i));
      sum += e;
    }
    return sum + squared_threshold * static_cast<double>(n - inliers.size());
  };
  const auto in_world = [&](const detail::centred_pose& p) {
    const so3 rotation(p.rotation);
    return se3(rotation, p.translation - rotation * matches.centre).inverse();
  };
  estimator_type::model model = found->model;
  if (const auto polished = estimator.refine(model, found->inliers, 10)) model = *polished;
  se3 pose = in_world(model.pose);
  double score = judge(pose);
  if constexpr (!std::same_as<Camera, camera::pinhole>) {  // for which the loops above are exact
    for (int k = 0; k != 3 && inliers.size() >= 3; ++k) {
      workspace.part.assign(inliers.begin(), inliers.end());
      const auto sum_up = [&](const detail::centred_pose& at, detail::pose_equations& e) {
        e = {mat6::Zero(), vec6::Zero(), 0.0};
        for (const std::uint32_t i : workspace.part) {
          const vec3 p = at.rotation * (points_world[i] - matches.centre) + at.translation;
          matrix<2, 3> j;
          const auto pixel = camera.project(p, j);
          if (!pixel) {
            e.cost = std::numeric_limits<double>::infinity();
            return;
          }
          matrix<2, 6> by_motion;
          by_motion << j, -(j * hat<double>(p));
          const vec2 r = *pixel - pixels[i];
          e.h.noalias() += by_motion.transpose() * by_motion;
          e.g.noalias() += by_motion.transpose() * r;
          e.cost += r.squaredNorm();
        }
      };
      const auto refined = detail::descend_pose(model.pose, 10, sum_up);
      if (!refined) break;
      const double next = judge(in_world(*refined));
      if (!(next < score)) break;
      score = next;
      model.pose = *refined;
      pose = in_world(model.pose);
    }
  }
  judge(pose);  // again: the last pose judged may not be the one that was kept
  if (auto enough = detail::enough_inliers(where, inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  const double rmse = std::sqrt(sum / static_cast<double>(inliers.size()));
  return pose_estimate{pose, std::move(inliers), rmse, found->iterations};
}

template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options = {}) {
  pnp_workspace workspace;
  return estimate_pose(points_world, pixels, camera, options, workspace);
}

}  // namespace orbis::optimize
