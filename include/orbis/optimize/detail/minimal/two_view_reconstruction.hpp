// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of the reconstruction in two_view.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/epipolar_motion.hpp>
#include <orbis/optimize/detail/minimal/essential_estimator.hpp>
#include <orbis/optimize/detail/minimal/homography_estimator.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>
#include <orbis/optimize/detail/minimal/two_view_hypotheses.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view.hpp>

namespace orbis::optimize::detail {

/// Search among all candidate motions between two views.
template <class Match>
class two_view_search {
 public:
  struct hypothesis {
    epipolar_motion motion;
    motion_support support;
  };

  explicit two_view_search(const std::vector<Match>& matches) : matches_{matches} {}

  /// Refines a motion and adds all four motions of the resulting essential matrix.
  void add(const epipolar_motion& start) {
    constexpr std::array scales{3.0, 3.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0};
    const auto refined = refined_motion(matches_, start, scales);
    if (!refined) return;
    for (const se3& pose : decompose_essential(refined->e)) {
      const epipolar_motion m(pose.rotation(), pose.translation());
      all_.push_back({m, measure_support(matches_, m)});
    }
  }
  /// Returns true if one of the plane's possible motions explains the plane's matches clearly better than `best`, i.e.
  /// if `best` is a mixture of the motion of the plane and that of another object.
  [[nodiscard]] static bool contradicts(const std::vector<Match>& plane, const std::vector<epipolar_motion>& motions,
                                        const epipolar_motion& best) {
    constexpr std::array scales{3.0, 2.0, 2.0, 2.0, 2.0, 2.0};
    const auto score = [&](const mat3& e) {
      double sum = 0.0;
      for (const Match& m : plane) sum += std::max(0.0, 1.5 * line_gate - squared_sampson(e, m));
      return sum;
    };
    const double enough = 1.05 * score(best.e);
    return std::any_of(motions.begin(), motions.end(), [&](const epipolar_motion& m) {
      const auto refined = refined_motion(plane, m, scales);
      return refined && score(refined->e) > enough;
    });
  }
  /// Searches for additional motions, starting from evenly distributed directions of translation, each combined with
  /// the rotation `turn`.
  void add_sampled_motions(const so3& turn) {
    constexpr std::array scales{20.0, 20.0, 10.0, 10.0, 5.0, 5.0};
    constexpr std::size_t few = 150;
    for (const vec3& t : hemisphere<16>())
      if (const auto rough = refined_motion(matches_, epipolar_motion(turn, t), scales, few);
          rough && !is_known(*rough))
        add(*rough);
  }

  /// Returns the motion with the highest score; null if there is none.
  [[nodiscard]] const hypothesis* best() const {
    const auto found = std::max_element(all_.begin(), all_.end(), [](const hypothesis& a, const hypothesis& b) {
      return a.support.score < b.support.score;
    });
    return found == all_.end() ? nullptr : &*found;
  }
  /// Returns true if a motion different from `best` explains the matches about equally well: a test between two models
  /// that may both be wrong. The test statistic is the sum of the matches' log-likelihood ratios in favour of `best`,
  /// divided by the standard deviation of the sum.
  /// Source: Q. Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57 (1989).
  [[nodiscard]] bool has_rival(const hypothesis& best) const {
    const mat3 rotation = best.motion.rotation.rotation_matrix();
    return std::any_of(all_.begin(), all_.end(), [&](const hypothesis& h) {
      if (same(h.motion, best.motion)) return false;
      const mat3 other = h.motion.rotation.rotation_matrix();
      double sum = 0.0, squares = 0.0;
      for (const Match& m : matches_) {
        const double more = score_match(rotation, best.motion, m) - score_match(other, h.motion, m);
        sum += more;
        squares += more * more;
      }
      constexpr double least = 50.0, deviations = 4.5;  // scores are twice a log-likelihood
      return !(sum >= least && sum >= deviations * std::sqrt(squares));
    });
  }

 private:
  /// Returns true if two refined motions are equal up to the tolerances.
  [[nodiscard]] static bool same(const epipolar_motion& a, const epipolar_motion& b) {
    constexpr double turned = 0.02, apart = 0.1;  // tolerances of rotation and direction, radians
    return (a.rotation.inverse() * b.rotation).angle() < turned &&
           angle_between_directions(a.direction, b.direction) < apart;
  }
  /// Returns true if a motion, or its opposite, has already been refined.
  [[nodiscard]] bool is_known(const epipolar_motion& m) const {
    return std::any_of(all_.begin(), all_.end(), [&](const hypothesis& h) {
      return same(h.motion, m) || same(h.motion, {m.rotation, vec3(-m.direction)});
    });
  }

  const std::vector<Match>& matches_;
  std::vector<hypothesis> all_;
};

/// The matches that agree with a motion, and the uncertainty of that motion.
template <class Match>
struct two_view_inliers {
  std::vector<const Match*> all, near;
  double rms = 0.0;    ///< root mean square Sampson distance
  double sigma = 0.0;  ///< standard deviation of a match
  double rotation_deviation = 0.0, direction_deviation = 0.0;

  two_view_inliers(const std::vector<Match>& matches, const epipolar_motion& motion) {
    std::vector<double> squares;
    const mat3 rotation = motion.rotation.rotation_matrix();
    for (const Match& m : matches) {
      double squared = 0.0;
      const agreement a = classify_match(rotation, motion.direction, motion.e, m, squared);
      if (a != agreement::far && a != agreement::near) continue;
      all.push_back(&m);
      if (a == agreement::near) near.push_back(&m);
      squares.push_back(squared);
      rms += squared;
    }
    rotation_deviation = direction_deviation = std::numeric_limits<double>::infinity();
    if (all.empty()) return;
    rms = std::sqrt(rms / static_cast<double>(all.size()));
    // Residuals far below the given standard deviation are not trusted.
    sigma = std::max(0.5, 1.4826 * std::sqrt(median(squares)));
    estimate_deviations(motion);
  }

 private:
  /// Estimates the deviations as the larger of two values: one from the noise of matches with independent errors, and
  /// one from the change of the motion when the matches in a part of the image are left out (delete-a-group jackknife).
  /// The latter covers correlated errors: those of neighbouring matches, of moving objects, and of the rows of a
  /// rolling shutter.
  void estimate_deviations(const epipolar_motion& motion) {
    constexpr std::size_t side = 3, parts = side * side;
    std::vector<const Match*> order = all;
    const auto by = [](double metric_ray::*axis) {
      return [axis](const Match* a, const Match* b) { return a->first.*axis < b->first.*axis; };
    };
    std::sort(order.begin(), order.end(), by(&metric_ray::x));
    std::array<epipolar_equations, parts> of_part;
    epipolar_equations whole;
    const auto at = [](std::size_t k, std::size_t n, std::size_t count) { return k * n / count; };
    for (std::size_t column = 0; column != side; ++column) {
      const std::size_t begin = at(column, order.size(), side), n = at(column + 1, order.size(), side) - begin;
      const auto first = order.begin() + static_cast<std::ptrdiff_t>(begin);
      std::sort(first, first + static_cast<std::ptrdiff_t>(n), by(&metric_ray::y));
      for (std::size_t i = 0; i != n; ++i) {
        epipolar_equations& sum = of_part[side * column + i * side / n];
        sum.add(motion.e, *order[begin + i], [](double squared) { return geman_mcclure_weight(0.25 * squared); });
      }
    }
    for (epipolar_equations& part : of_part) {
      part.mirror();
      whole.h += part.h;
      whole.g += part.g;
    }
    const auto [h, g] = whole.by_motion(motion);
    small_cholesky<5> factors;
    if (!factors.set(h) || !(factors.factor(0.0) > small_cholesky<5>::determined)) return;
    matrix<5, 5> covariance = factors.inverse() * square(sigma);
    matrix<5, 5> jackknife = zeros<matrix<5, 5>>();
    for (const epipolar_equations& part : of_part) {
      const auto [part_h, part_g] = part.by_motion(motion);
      if (!factors.set(matrix<5, 5>(h - part_h)) || !(factors.factor(0.0) > small_cholesky<5>::determined)) return;
      const matrix<5> step = factors.solve(matrix<5>(part_g - g));
      jackknife += step * transposed(step);
    }
    jackknife *= static_cast<double>(parts - 1) / static_cast<double>(parts);
    const auto largest = [](const auto& c) {
      return std::pair{eigen_of_symmetric<3>(mat3(block<3, 3>(c, 0, 0))).values[2],
                       eigen_of_symmetric<2>(block<2, 2>(c, 3, 3)).values[1]};
    };
    const auto [turn, direction] = largest(covariance);
    const auto [turn_of_parts, direction_of_parts] = largest(jackknife);
    rotation_deviation = std::sqrt(std::max(turn, turn_of_parts));
    direction_deviation = std::sqrt(std::max(direction, direction_of_parts));
  }

 public:
  /// Returns the median; changes the order of the values. @pre !values.empty()
  [[nodiscard]] static double median(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
};

template <class Match>
result<two_view_reconstruction> reconstruction_of_matches(const std::vector<Match>& matches, std::size_t n,
                                                          const two_view_options& options) {
  constexpr const char* where = "two views";
  const std::size_t least = std::max<std::size_t>(options.min_points, 8), usable = matches.size();
  const auto refuse = [&](const std::string& why) { return fail(errc::degenerate, where, why); };
  const auto of = [](std::size_t part, std::size_t whole) {
    return std::to_string(part) + " of " + std::to_string(whole);
  };
  if (usable < least)
    return fail(errc::no_data, where,
                "only " + of(usable, n) + " matches are usable; " + std::to_string(least) + " are needed");

  // Test the cheapest case first: pure rotation.
  const so3 turn = dominant_rotation(matches);
  const mat3 turned = turn.rotation_matrix();
  const auto is_still = [&](const Match& m, double sigma) {
    return squared_disparity(turned, m) < square(least_disparity * sigma);
  };
  const auto still = static_cast<std::size_t>(
      std::count_if(matches.begin(), matches.end(), [&](const Match& m) { return is_still(m, 0.75); }));
  if (usable - still < least || 5 * still > 4 * usable)
    return refuse("no parallax: a rotation alone explains " + of(still, usable) + " matches");

  const ransac_options asked{.threshold = std::sqrt(line_gate),
                             .confidence = options.confidence,
                             .max_iterations = options.max_iterations,
                             .model_cost = essential_estimator::model_cost,
                             .seed = options.seed};
  const essential_estimator lines(matches);
  const auto essential = ransac(lines, asked);
  if (!essential) return refuse(essential.error().message);
  if (5 * essential->inliers.size() < 2 * usable || essential->inliers.size() < least)
    return refuse("the best motion explains only " + of(essential->inliers.size(), usable) + " matches");
  ransac_options of_planes = asked;
  of_planes.threshold = std::sqrt(point_gate);
  of_planes.model_cost = 200.0;
  const auto plane = ransac(homography_estimator(matches), of_planes);

  // Add the motions of both models: those of the model with the lower score are also rivals.
  two_view_search<Match> search(matches);
  const se3 first_of_four = decompose_essential(essential->model)[0];
  search.add({first_of_four.rotation(), first_of_four.translation()});
  bool from_homography = false;
  std::vector<Match> of_plane;
  std::vector<epipolar_motion> plane_motions;
  if (plane) {
    const auto& [forward, backward] = plane->model;
    from_homography = score_models(matches, forward, backward, essential->model).ratio() > 0.45;
    const vec3 ray = matches[plane->inliers.empty() ? 0 : plane->inliers.front()].first.direction();
    if (const auto motions = decompose_homography(forward, ray))
      for (const plane_motion& m : *motions)
        if (squared_norm(m.translation) > 0.0)
          plane_motions.emplace_back(m.R_second_first, vec3(normalized(m.translation)));
    for (const epipolar_motion& m : plane_motions) search.add(m);
    for (const std::uint32_t i : plane->inliers) of_plane.push_back(matches[i]);
  }
  const auto* best = search.best();
  if (best == nullptr) return refuse("no motion could be refined");
  constexpr const char* two = "two motions explain the matches about equally well";
  if (search.has_rival(*best)) return refuse(two);

  const epipolar_motion motion = best->motion;
  const two_view_inliers<Match> inliers(matches, motion);
  const auto unmoved = static_cast<std::size_t>(std::count_if(
      inliers.all.begin(), inliers.all.end(), [&](const Match* m) { return is_still(*m, inliers.sigma); }));
  if (2 * unmoved > inliers.all.size())
    return refuse("no parallax: a rotation alone explains " + of(unmoved, inliers.all.size()) + " inliers");
  if (10 * best->support.behind > inliers.all.size())
    return refuse(of(best->support.behind, usable) + " matches are behind a camera");
  if (!(inliers.rotation_deviation <= options.max_rotation) || !(inliers.direction_deviation <= options.max_direction))
    return refuse("the motion is uncertain");

  struct seen_point {
    std::uint32_t match;
    vec3 position;
    double parallax;
  };
  std::vector<seen_point> found;
  const se3 T_first_second = se3(motion.rotation, motion.direction).inverse();
  const double least_seen = std::sqrt(2.0) * inliers.sigma / options.max_depth;
  for (const Match* m : inliers.near) {
    if (squared_disparity(motion.rotation.rotation_matrix(), *m) < square(least_seen)) continue;
    const triangulation t = triangulate(se3(), m->first.direction(), T_first_second, m->second.direction());
    if (t.ok()) found.push_back({m->original, t.point, t.parallax});
  }
  if (found.size() < least || 2 * found.size() < inliers.all.size())
    return refuse("too little parallax: it determines the depth of only " + of(found.size(), inliers.all.size()) +
                  " inliers");
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.match < b.match; });
  std::vector<double> depths, angles;
  for (const seen_point& p : found) {
    depths.push_back(p.position.z());
    angles.push_back(p.parallax);
  }
  two_view_reconstruction out;
  out.parallax = two_view_inliers<Match>::median(angles);
  if (!(out.parallax >= options.min_parallax)) return refuse("the median parallax is too small");

  // Only a motion that would be accepted is compared with all others.
  const double score = best->support.score;
  search.add_sampled_motions(turn);
  best = search.best();
  if (best->support.score > 1.02 * score || search.has_rival(*best)) return refuse(two);
  constexpr const char* shared = "the matches belong to two different motions";
  if (5 * of_plane.size() > 2 * inliers.all.size() &&
      two_view_search<Match>::contradicts(of_plane, plane_motions, motion))
    return refuse(shared);
  std::vector<Match> others;
  for (const Match& m : matches)
    if (!(squared_sampson(motion.e, m) < 2.0 * line_gate)) others.push_back(m);
  if (2 * others.size() > inliers.all.size()) {
    const auto second = ransac(essential_estimator(others), asked);
    if (second && 2 * second->inliers.size() > inliers.all.size()) return refuse(shared);
  }

  const double unit = 1.0 / two_view_inliers<Match>::median(depths);
  for (const seen_point& p : found) {
    out.matches.push_back(p.match);
    out.points.push_back(unit * p.position);
  }
  out.inliers = inliers.all.size();
  out.rmse = options.deviation * inliers.rms;
  out.rotation_deviation = inliers.rotation_deviation;
  out.direction_deviation = inliers.direction_deviation;
  out.from_homography = from_homography;
  out.T_first_second = se3(T_first_second.rotation(), unit * T_first_second.translation());
  return out;
}

}  // namespace orbis::optimize::detail
