// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of two_view.hpp.
#pragma once

#include <algorithm>
#include <utility>

#include <orbis/core/inline.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/minimal/essential_estimator.hpp>
#include <orbis/optimize/detail/minimal/homography_estimator.hpp>
#include <orbis/optimize/detail/minimal/two_view_reconstruction.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view.hpp>

namespace orbis::optimize {

namespace detail {

template <class Match>
result<relative_pose_estimate> essential_of_matches(const std::vector<Match>& matches, std::size_t n,
                                                    const essential_options& options) {
  constexpr const char* where = "essential matrix";
  const essential_estimator estimator(matches);
  auto found = ransac(estimator, ransac_part(options, essential_estimator::model_cost));
  if (!found) return fail(found.error().code, where, found.error().message);
  const double squared_threshold = options.threshold * options.threshold;
  const std::size_t by_rotation = count_rotation_inliers(matches, found->inliers, squared_threshold);
  if (10 * by_rotation >= 9 * found->inliers.size())
    return fail(errc::degenerate, where,
                "no parallax: a rotation alone explains " + std::to_string(by_rotation) + " of " +
                    std::to_string(found->inliers.size()) + " inliers");

  mat3 essential = polished(estimator, *found, squared_threshold, options.min_inliers);
  essential *= std::sqrt(2.0) / norm(essential);
  relative_pose_estimate out;
  out.essential = essential;
  out.iterations = found->iterations;
  std::vector<std::uint32_t> inside;
  double sum = 0.0;
  for (std::size_t i = 0; i != matches.size(); ++i) {
    const double e = estimator.squared_error(essential, i);
    if (!(e < squared_threshold)) continue;
    sum += e;
    inside.push_back(static_cast<std::uint32_t>(i));
    out.inliers.push_back(matches[i].original);
  }
  std::sort(out.inliers.begin(), out.inliers.end());
  if (auto enough = enough_inliers(where, inside.size(), n, options.min_inliers, 5); !enough)
    return fail(std::move(enough.error()));
  out.rmse = std::sqrt(sum / static_cast<double>(inside.size()));
  // Of the four poses, choose the one with the most points in front of both cameras.
  std::vector<double> angles;
  for (const se3& T_second_first : decompose_essential(essential)) {
    std::size_t in_front = 0;
    angles.clear();
    const se3 T_first_second = T_second_first.inverse();
    for (const std::uint32_t i : inside) {
      const triangulation t = triangulate(se3(), matches[i].first.direction(), T_first_second,
                                          matches[i].second.direction(), {.min_parallax = 0.0});
      in_front += t.ok() ? 1U : 0U;
      angles.push_back(t.parallax);
    }
    if (in_front <= out.in_front && out.in_front != 0) continue;
    out.in_front = in_front;
    out.T_first_second = T_first_second;
    if (angles.empty()) continue;
    const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
    std::nth_element(angles.begin(), middle, angles.end());
    out.parallax = *middle;
  }
  return out;
}

}  // namespace detail

template <std::same_as<homography_options> Options>
result<homography_estimate> estimate_homography(std::span<const vec2> first, std::span<const vec2> second,
                                                const Options& options) {
  constexpr const char* where = "homography";
  using estimator_type = detail::homography_estimator;
  const std::size_t n = first.size();
  if (n != second.size()) return fail(errc::invalid_argument, where, "the lists of pixels differ in length");
  ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::find_fault(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 4) return fail(errc::no_data, where, "fewer than four matches");
  std::vector<detail::image_match> matches;
  matches.reserve(n);
  vec2 first_centre = zeros<vec2>(), second_centre = zeros<vec2>();
  for (std::size_t i = 0; i != n; ++i) {
    if (!all_finite(first[i]) || !all_finite(second[i])) continue;
    matches.push_back({{first[i].x(), first[i].y()}, {second[i].x(), second[i].y()}, static_cast<std::uint32_t>(i)});
    first_centre += first[i];
    second_centre += second[i];
  }
  if (matches.size() < 4)
    return fail(
        errc::degenerate, where,
        "only " + std::to_string(matches.size()) + " of " + std::to_string(n) + " matches are finite; four are needed");
  first_centre /= static_cast<double>(matches.size());
  second_centre /= static_cast<double>(matches.size());
  // Points are relative to the centres and in units of the image size, so that the entries of H have similar
  // magnitudes.
  double size = 0.0;
  mat2 first_spread = zeros<mat2>(), second_spread = zeros<mat2>();
  const auto centre = [](detail::metric_ray& r, const vec2& at, mat2& spread) {
    const vec2 offset(r.x - at.x(), r.y - at.y());
    spread += offset * transposed(offset);
    r.x = offset.x();
    r.y = offset.y();
  };
  for (detail::image_match& m : matches) {
    centre(m.first, first_centre, first_spread);
    centre(m.second, second_centre, second_spread);
  }
  size = std::sqrt((trace(first_spread) + trace(second_spread)) / static_cast<double>(2 * matches.size()));
  const double threshold = options.threshold / size;
  if (!(size > 0.0) || !std::isfinite(threshold))
    return fail(errc::degenerate, where, "all points are collinear or coincident");
  for (detail::image_match& m : matches)
    for (double* const v : {&m.first.x, &m.first.y, &m.second.x, &m.second.y}) *v /= size;
  random_bits random(mix64(options.seed));
  shuffle(matches, random);

  const estimator_type estimator(matches);
  asked.threshold = threshold;
  auto found = ransac(estimator, asked);
  if (!found) {
    const auto is_line = [](const mat2& spread) {
      return !(determinant(spread) > 1e-12 * trace(spread) * trace(spread));
    };
    if (found.error().code == errc::degenerate && (is_line(first_spread) || is_line(second_spread)))
      return fail(errc::degenerate, where, "all points are collinear or coincident");
    return fail(found.error().code, where, found.error().message);
  }
  const typename estimator_type::model model =
      detail::polished(estimator, *found, threshold * threshold, options.min_inliers);
  homography_estimate out;
  out.iterations = found->iterations;
  double sum = 0.0;
  for (std::size_t i = 0; i != matches.size(); ++i) {
    const double e = estimator.squared_error(model, i);
    if (!(e < threshold * threshold)) continue;
    sum += e;
    out.inliers.push_back(matches[i].original);
  }
  std::sort(out.inliers.begin(), out.inliers.end());
  if (auto enough = detail::enough_inliers(where, out.inliers.size(), n, options.min_inliers, 4); !enough)
    return fail(std::move(enough.error()));
  out.rmse = size * std::sqrt(sum / static_cast<double>(out.inliers.size()));
  // Undo the centring.
  mat3 to_centre = identity<mat3>(), from_centre = identity<mat3>();
  for (int i = 0; i != 2; ++i) {
    to_centre(i, i) = 1.0 / size;
    to_centre(i, 2) = -first_centre[i] / size;
    from_centre(i, i) = size;
    from_centre(i, 2) = second_centre[i];
  }
  const mat3 whole = from_centre * model.forward * to_centre;
  out.H_second_first = whole / (whole(2, 2) != 0.0 ? whole(2, 2) : norm(whole));
  return out;
}

ORBIS_LAZY_INLINE result<std::vector<plane_motion>> decompose_homography(const mat3& homography, const vec3& ray) {
  constexpr const char* where = "homography";
  mat3 h = homography;
  if (!all_finite(h)) return fail(errc::degenerate, where, "is not finite");
  const auto [squares, vectors] = eigen_of_symmetric<3>(mat3(transposed(h) * h));
  const double middle = std::sqrt(std::fmax(0.0, squares[1]));
  if (!(squares[0] > 1e-20 * squares[2])) return fail(errc::degenerate, where, "is singular");
  // R + t n^T has the middle singular value 1, and a positive determinant if the plane is in front of both cameras.
  h /= middle;
  if (determinant(h) < 0.0) h = -h;
  const double s1 = squares[2] / (middle * middle), s3 = squares[0] / (middle * middle);
  std::vector<plane_motion> motions;
  if (!(s1 - s3 > 1e-12)) {
    motions.push_back({so3(h), zeros<vec3>(), normalized(vec3(ray))});
    return motions;
  }
  mat3 v;
  for (int k = 0; k != 3; ++k) set_column(v, k, column_of(vectors, 2 - k));
  if (determinant(v) < 0.0) v = -v;
  const double a = std::sqrt(std::fmax(0.0, 1.0 - s3) / (s1 - s3)), b = std::sqrt(std::fmax(0.0, s1 - 1.0) / (s1 - s3));
  for (const double sign : {1.0, -1.0}) {
    const vec3 middle = column_of(v, 1), u = a * column_of(v, 0) + sign * b * column_of(v, 2);
    const mat3 before = columns(middle, u, cross(middle, u));
    const vec3 hv = h * middle, hu = h * u;
    const mat3 after = columns(hv, hu, cross(hv, hu));
    const so3 rotation(mat3(after * transposed(before)));
    vec3 normal = column_of(before, 2);
    vec3 translation = (h - rotation.rotation_matrix()) * normal;
    if (dot(normal, ray) < 0.0) {
      normal = -normal;
      translation = -translation;
    }
    motions.push_back({rotation, translation, normal});
  }
  return motions;
}

}  // namespace orbis::optimize
