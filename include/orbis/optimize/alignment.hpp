// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rigid or similarity transform between two lists of points: in closed form, or robustly where many pairs may be
/// wrong.
///
/// Sources: B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4 (1987);
/// S. Umeyama, PAMI 13 (1991) for the scale.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/alignment_estimator.hpp>
#include <orbis/optimize/detail/minimal/horn.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

/// Absolute orientation: the `T_to_from` that minimises the sum of `|T_to_from * from[i] - to[i]|^2`, in closed form.
/// Every pair counts; see `estimate_alignment` for pairs that may be wrong. O(n).
/// Errors: `invalid_argument` for lists of different length; `no_data` below three pairs; `degenerate` for collinear,
/// coincident or non-finite points.
template <point_range From, point_range To>
[[nodiscard]] result<se3> absolute_orientation(const From& from, const To& to) {
  const auto s = detail::align(from, to, false);
  if (!s) return fail(s.error());
  return se3(s->rotation(), s->translation());
}

/// Absolute orientation with a free scale: minimises the sum of `|s R from[i] + t - to[i]|^2`, each times `weights[i]`
/// if there are weights. O(n). Errors as above; `invalid_argument` also unless there is a weight for each pair, finite
/// and not negative.
template <point_range From, point_range To>
[[nodiscard]] result<sim3> absolute_orientation_with_scale(const From& from, const To& to,
                                                           std::span<const double> weights = {}) {
  return detail::align(from, to, true, weights);
}

struct alignment_options {
  /// Largest distance between the transformed point and its partner for an inlier: metres, or units of `deviations`
  /// where those are given.
  double threshold = 0.05;
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
  /// Standard deviation of the distance of each pair, metres; for a depth camera it grows with the square of the depth.
  /// Pairs weigh by 1 / deviation^2. Empty: all pairs are equal.
  std::span<const double> deviations = {};
};

template <class Transform>
struct alignment_estimate {
  Transform T_to_from;
  std::vector<std::uint32_t> inliers;  ///< exactly the pairs within the threshold, ascending
  double rmse = 0.0;                   ///< of the inliers, in the threshold's units
  std::size_t iterations = 0;
};

/// The transform `T_to_from` (`se3` or `sim3`) that takes most of `from[i]` near `to[i]`: three pairs in RANSAC, each
/// new best transform refined on its inliers. Pairs that are not finite, and those with a deviation of 0 or one that is
/// not finite, are outliers. Deterministic by `options.seed`. Errors: `invalid_argument` for lists of different length
/// or options out of range; `no_data` below three pairs; `degenerate` if all points lie on a line or in one place, or
/// no transform has `min_inliers` inliers. The message says which.
template <class Transform = se3, point_range From, point_range To>
requires(std::same_as<Transform, se3> || std::same_as<Transform, sim3>)
    [[nodiscard]] result<alignment_estimate<Transform>> estimate_alignment(const From& from, const To& to,
                                                                           const alignment_options& options = {}) {
  constexpr const char* where = "alignment";
  using estimator_type = detail::alignment_estimator<Transform>;
  const auto n = static_cast<std::size_t>(std::ranges::size(from));
  if (n != static_cast<std::size_t>(std::ranges::size(to)))
    return fail(errc::invalid_argument, where, "the two lists of points differ in length");
  if (!options.deviations.empty() && options.deviations.size() != n)
    return fail(errc::invalid_argument, where, "there are not as many deviations as pairs");
  const ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::fault_of(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 3) return fail(errc::no_data, where, "fewer than three pairs of points");
  const auto read = [](const auto& points, std::size_t i) {
    using range = std::remove_cvref_t<decltype(points)>;
    const auto c =
        coordinates<double>(std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<range>>(i)]);
    return vec3(c[0], c[1], c[2]);
  };
  const auto weight_of = [&](std::size_t i) {
    return options.deviations.empty() ? 1.0 : 1.0 / (options.deviations[i] * options.deviations[i]);
  };
  std::vector<typename estimator_type::pair> pairs;
  pairs.reserve(n);
  vec3 from_centre = zeros<vec3>(), to_centre = zeros<vec3>();
  for (std::size_t i = 0; i != n; ++i) {
    const typename estimator_type::pair p{read(from, i), read(to, i), weight_of(i), static_cast<std::uint32_t>(i)};
    if (!all_finite(p.from) || !all_finite(p.to) || !(p.weight > 0.0) || !std::isfinite(p.weight)) continue;
    pairs.push_back(p);
    from_centre += p.from;
    to_centre += p.to;
  }
  if (pairs.size() < 3)
    return fail(errc::degenerate, where,
                "of " + std::to_string(n) + " pairs " + std::to_string(pairs.size()) + " are finite, three are needed");
  from_centre /= static_cast<double>(pairs.size());
  to_centre /= static_cast<double>(pairs.size());
  mat3 spread = zeros<mat3>(), spread_to = zeros<mat3>();
  for (auto& p : pairs) {
    p.from -= from_centre;
    p.to -= to_centre;
    spread += p.from * transposed(p.from);
    spread_to += p.to * transposed(p.to);
  }
  random_bits random(mix64(options.seed));
  shuffle(pairs, random);

  const estimator_type estimator(std::move(pairs));
  auto found = ransac(estimator, asked, ransac_policies{msac{}, uniform_sampling{}, sprt{}, iterated_refinement{}});
  if (!found) {
    if (found.error().code == errc::degenerate)
      for (const mat3& s : {spread, spread_to}) {
        const vec3 sizes = eigen_of_symmetric<3>(s).values;
        if (!(sizes[1] > 1e-12 * sizes[2]))
          return fail(errc::degenerate, where, "the points all lie on one line or in one place");
      }
    return fail(found.error());
  }
  // Back from the centres.
  const auto& centred = found->model.transform;
  Transform transform;
  if constexpr (estimator_type::with_scale)
    transform =
        sim3(centred.rotation(),
             to_centre + centred.translation() - centred.scale() * (centred.rotation() * from_centre), centred.scale());
  else
    transform = se3(centred.rotation(), to_centre + centred.translation() - centred.rotation() * from_centre);
  alignment_estimate<Transform> out{transform, {}, 0.0, found->iterations};
  out.inliers.reserve(found->inliers.size());
  double sum = 0.0;
  for (std::size_t i = 0; i != n; ++i) {
    const double weight = weight_of(i), e = weight * squared_norm(transform * read(from, i) - read(to, i));
    if (!(weight > 0.0) || !(e < options.threshold * options.threshold)) continue;
    out.inliers.push_back(static_cast<std::uint32_t>(i));
    sum += e;
  }
  if (auto enough = detail::enough_inliers(where, out.inliers.size(), n, options.min_inliers, 3); !enough)
    return fail(std::move(enough.error()));
  out.rmse = std::sqrt(sum / static_cast<double>(out.inliers.size()));
  return out;
}

}  // namespace orbis::optimize
