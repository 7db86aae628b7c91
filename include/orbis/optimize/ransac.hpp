// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RANSAC over any model: deterministic by seed, scored by MSAC, with a local-optimisation hook.
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981); P. Torr, A. Zisserman, "MLESAC", CVIU 78 (2000)
/// for the truncated score; O. Chum, J. Matas, J. Kittler, "Locally optimized RANSAC", DAGM 2003.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>

namespace orbis::optimize {

/// What RANSAC needs to know about a model and its data.
///
/// - `E::sample_size`: how many data determine the model up to a few solutions.
/// - `size()`: how many data there are.
/// - `fit(sample)`: a range of candidate models from `sample_size` data; empty where degenerate.
/// - `squared_error(model, i)`: of datum `i`, in squared units of the threshold; infinite (or NaN)
///   where it cannot be told.
/// - `refine(model, inliers)`: a better model from many data, starting at `model`; empty if that
///   fails. Return the model itself to go without local optimisation.
template <class E>
concept model_estimator = requires(const E& estimator, const typename E::model& model,
                                   std::span<const std::uint32_t> indices, std::size_t i,
                                   const std::array<std::uint32_t, E::sample_size>& sample) {
  requires std::copyable<typename E::model>;
  { estimator.size() } -> std::convertible_to<std::size_t>;
  { *estimator.fit(sample).begin() } -> std::convertible_to<typename E::model>;
  { estimator.squared_error(model, i) } -> std::convertible_to<double>;
  { estimator.refine(model, indices) } -> std::same_as<std::optional<typename E::model>>;
};

struct ransac_options {
  double threshold = 1.0;  ///< largest error of an inlier, in the estimator's units (not squared)
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 0;  ///< fewer than this is a failure
  std::size_t refinements = 4;  ///< of each new best model, at most
  std::uint64_t seed = 1;
};

template <class Model>
struct ransac_estimate {
  Model model;
  std::vector<std::uint32_t> inliers;  ///< exactly the data within the threshold of `model`, ascending
  double score = 0.0;                  ///< sum over all data of min(squared error, squared threshold)
  std::size_t iterations = 0;
};

namespace detail {

/// The truncated sum of squared errors, given up as soon as it exceeds `limit`.
template <model_estimator E>
[[nodiscard]] double msac_score(const E& estimator, const typename E::model& model, double squared_threshold,
                                double limit) {
  double score = 0.0;
  const std::size_t n = estimator.size();
  for (std::size_t i = 0; i < n && score < limit; ++i) {
    const double e = estimator.squared_error(model, i);
    score += e < squared_threshold ? e : squared_threshold;  // NaN counts as an outlier
  }
  return score;
}

template <model_estimator E>
void collect_inliers(const E& estimator, const typename E::model& model, double squared_threshold,
                     std::vector<std::uint32_t>& inliers) {
  inliers.clear();
  const std::size_t n = estimator.size();
  for (std::size_t i = 0; i < n; ++i)
    if (estimator.squared_error(model, i) < squared_threshold) inliers.push_back(static_cast<std::uint32_t>(i));
}

/// `N` distinct numbers below `n`. @pre n >= N
template <std::size_t N>
[[nodiscard]] std::array<std::uint32_t, N> draw_sample(random_bits& random, std::size_t n) {
  std::array<std::uint32_t, N> sample{};
  for (std::size_t k = 0; k < N; ++k) {
    do {
      sample[k] = random.below(static_cast<std::uint32_t>(n));
    } while (std::find(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(k), sample[k]) !=
             sample.begin() + static_cast<std::ptrdiff_t>(k));
  }
  return sample;
}

/// How many samples it takes to draw, with the wanted confidence, one without an outlier.
[[nodiscard]] inline double wanted_iterations(double confidence, double inlier_ratio, std::size_t sample_size) {
  const double clean = std::pow(inlier_ratio, static_cast<double>(sample_size));
  if (clean >= 1.0) return 0.0;
  if (clean < 1e-12) return std::numeric_limits<double>::infinity();
  return std::log(1.0 - confidence) / std::log1p(-clean);
}

}  // namespace detail

/// The model that most of the data agree with. The same data, options and seed give the same answer.
/// Errors: `invalid_argument` for options out of range, `no_data` where there are fewer data than a
/// sample, `degenerate` where no sample gives a model with `min_inliers` (and at least a sample's
/// number of) inliers.
template <model_estimator E>
[[nodiscard]] result<ransac_estimate<typename E::model>> ransac(const E& estimator, const ransac_options& options) {
  using model = typename E::model;
  constexpr const char* where = "ransac";
  if (!(options.threshold > 0.0)) return fail(errc::invalid_argument, where, "the threshold must be positive");
  if (!(options.confidence > 0.0 && options.confidence < 1.0))
    return fail(errc::invalid_argument, where, "the confidence must lie between 0 and 1");
  const std::size_t n = estimator.size();
  if (n < E::sample_size) return fail(errc::no_data, where, "fewer data than one sample needs");

  const double squared_threshold = options.threshold * options.threshold;
  random_bits random(options.seed);
  std::optional<model> best;
  double best_score = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> inliers;
  std::size_t best_inliers = 0;

  const auto adopt_if_better = [&](const model& candidate) {
    const double score = detail::msac_score(estimator, candidate, squared_threshold, best_score);
    if (!(score < best_score)) return false;
    best = candidate;
    best_score = score;
    detail::collect_inliers(estimator, candidate, squared_threshold, inliers);
    best_inliers = inliers.size();
    return true;
  };

  double wanted = static_cast<double>(options.max_iterations);
  std::size_t iteration = 0;
  for (; iteration < options.max_iterations &&
         (iteration < options.min_iterations || static_cast<double>(iteration) < wanted);
       ++iteration) {
    bool improved = false;
    for (const model& candidate : estimator.fit(detail::draw_sample<E::sample_size>(random, n)))
      improved |= adopt_if_better(candidate);
    if (!improved) continue;
    for (std::size_t k = 0; k < options.refinements && best_inliers > E::sample_size; ++k) {
      const std::optional<model> refined = estimator.refine(*best, inliers);
      if (!refined || !adopt_if_better(*refined)) break;
    }
    wanted = detail::wanted_iterations(options.confidence, static_cast<double>(best_inliers) / static_cast<double>(n),
                                       E::sample_size);
  }

  if (!best || best_inliers < std::max(options.min_inliers, E::sample_size))
    return fail(errc::degenerate, where, "no model has enough inliers");
  return ransac_estimate<model>{*best, std::move(inliers), best_score, iteration};
}

}  // namespace orbis::optimize
