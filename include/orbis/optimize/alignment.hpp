// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rigid or similarity transform between two lists of points: in closed form, or by robust estimation if many pairs
/// may be wrong.
///
/// Sources: B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4 (1987);
/// S. Umeyama, PAMI 13 (1991) for the scale.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/core/inline.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/pair_moments.hpp>

namespace orbis::optimize {

struct alignment_options;
template <class Transform>
struct alignment_estimate;

namespace detail {

/// Point `i` of a list.
template <point_range Points>
[[nodiscard]] vec3 read_point(const Points& points, std::size_t i) {
  const auto c =
      coordinates<double>(std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<Points>>(i)]);
  return {c[0], c[1], c[2]};
}
template <point_range Points>
[[nodiscard]] std::vector<vec3> read_points(const Points& points) {
  std::vector<vec3> out(static_cast<std::size_t>(std::ranges::size(points)));
  for (std::size_t i = 0; i != out.size(); ++i) out[i] = read_point(points, i);
  return out;
}

/// Returns an error if lists of these lengths cannot be aligned.
ORBIS_LAZY [[nodiscard]] result<void> check_pairs(std::size_t from, std::size_t to, std::span<const double> weights);
/// Returns the transform determined by the moments of n pairs; empty if they do not determine a rotation.
ORBIS_LAZY [[nodiscard]] std::optional<sim3> align_by_moments(const pair_moments& moments, std::size_t n,
                                                              bool with_scale);
/// The error for a failed alignment; `not_finite`: index of the first pair that is not finite, or n.
ORBIS_LAZY [[nodiscard]] error alignment_error(std::size_t not_finite, std::size_t n);

/// Returns the transform between two lists of points. Without weights, all pairs have equal weight.
template <point_range From, point_range To>
[[nodiscard]] result<sim3> align(const From& from, const To& to, bool with_scale,
                                 std::span<const double> weights = {}) {
  const auto n = static_cast<std::size_t>(std::ranges::size(from));
  if (auto possible = check_pairs(n, static_cast<std::size_t>(std::ranges::size(to)), weights); !possible)
    return fail(possible.error());
  const auto pair = [&](std::size_t i, double* a, double* b) {
    const vec3 p = read_point(from, i), q = read_point(to, i);
    for (int k = 0; k != 3; ++k) a[k] = p[k], b[k] = q[k];
    return weights.empty() ? 1.0 : weights[i];
  };
  if (const auto found = align_by_moments(compute_moments(n, pair), n, with_scale)) return *found;
  std::size_t i = 0;
  while (i != n && all_finite(read_point(from, i)) && all_finite(read_point(to, i))) ++i;
  return fail(alignment_error(i, n));
}

/// `estimate_alignment` for lists of vectors.
template <class Transform>
[[nodiscard]] result<alignment_estimate<Transform>> align_vectors(std::span<const vec3> from, std::span<const vec3> to,
                                                                  const alignment_options& options);

}  // namespace detail

/// Absolute orientation: returns the `T_to_from` that minimises the sum of `|T_to_from * from[i] - to[i]|^2`, in closed
/// form. Not robust; see `estimate_alignment` for pairs that may be wrong. O(n). Errors: `invalid_argument` for lists
/// of different lengths; `no_data` for fewer than three pairs; `degenerate` for collinear, coincident or non-finite
/// points.
template <point_range From, point_range To>
[[nodiscard]] result<se3> absolute_orientation(const From& from, const To& to) {
  const auto s = detail::align(from, to, false);
  if (!s) return fail(s.error());
  return se3(s->rotation(), s->translation());
}

/// Absolute orientation with unknown scale: minimises the sum of `|s R from[i] + t - to[i]|^2`, weighted by
/// `weights[i]` unless `weights` is empty. O(n). Errors: those of `absolute_orientation`, and `invalid_argument` unless
/// there is one finite, non-negative weight per pair.
template <point_range From, point_range To>
[[nodiscard]] result<sim3> absolute_orientation_with_scale(const From& from, const To& to,
                                                           std::span<const double> weights = {}) {
  return detail::align(from, to, true, weights);
}

struct alignment_options {
  /// Maximum distance between a transformed point and its partner in an inlier pair: in metres, or in units of
  /// `deviations` if specified.
  double threshold = 0.05;
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< minimum number of inliers for success
  std::uint64_t seed = 1;
  /// Standard deviation of the distance of each pair, metres; for a depth camera, it grows with the square of the
  /// depth. Pairs are weighted by 1 / deviation^2. Empty: all pairs have equal weight.
  std::span<const double> deviations = {};
};

template <class Transform>
struct alignment_estimate {
  Transform T_to_from;
  std::vector<std::uint32_t> inliers;  ///< indices of all pairs within the threshold, ascending
  double rmse = 0.0;                   ///< root mean square error of the inliers, in the unit of the threshold
  std::size_t iterations = 0;
};

/// Estimates the transform `T_to_from` (`se3` or `sim3`) that maps most points `from[i]` close to `to[i]`: RANSAC with
/// three pairs per sample; each new best transform is refined on its inliers. Non-finite pairs, and those with a zero
/// or non-finite deviation, are outliers. Deterministic for a given `options.seed`. Errors: `invalid_argument` for
/// lists of different lengths or options out of range; `no_data` for fewer than three pairs; `degenerate` if all points
/// are collinear or coincide, or no transform has `min_inliers` inliers. The message gives the reason.
template <class Transform = se3, point_range From, point_range To>
requires(std::same_as<Transform, se3> || std::same_as<Transform, sim3>)
    [[nodiscard]] result<alignment_estimate<Transform>> estimate_alignment(const From& from, const To& to,
                                                                           const alignment_options& options = {}) {
  return detail::align_vectors<Transform>(detail::read_points(from), detail::read_points(to), options);
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/alignment-inl.hpp>
#endif
