// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RANSAC for any model. Deterministic by seed; scoring, order of samples, preemption and local optimisation are
/// policies (see `ransac_policies.hpp`).
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981); R. Raguram et al., "USAC: a universal framework for random sample
/// consensus", PAMI 35 (2013), for the parts and how they go together.
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
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/result.hpp>
#include <orbis/optimize/ransac_policies.hpp>

namespace orbis::optimize {

/// A model and its data, as RANSAC needs them.
///
/// - `E::sample_size`: the number of data that determine the model up to a few solutions.
/// - `size()`: the number of data.
/// - `fit(sample)`: a range of candidate models from `sample_size` data; empty where these are degenerate.
/// - `squared_error(model, i)`: the squared error of datum `i`, in squared units of the threshold; infinite or NaN if
/// it
///   has none.
/// - `refine(model, inliers)`: a better model from many data, starting at `model`; empty if that fails. Return the
/// model
///   itself to go without local optimisation.
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

/// The number of data that are scored at a time.
inline constexpr std::size_t consensus_block = 32;

/// An estimator with errors of many data at once: `squared_errors(model, first, out)` writes those of `consensus_block`
/// data from `first` on, a multiple of it; what it writes for data beyond the last does not matter. Models are ranked
/// by these; whether a datum is an inlier is decided by `squared_error`.
template <class E>
concept block_estimator = model_estimator<E> && requires(const E& estimator, const typename E::model& model,
                                                         std::size_t first, std::span<float, consensus_block> out) {
  estimator.squared_errors(model, first, out);
};

struct ransac_options {
  double threshold = 1.0;  ///< largest error of an inlier, in the estimator's units (not squared); positive, finite
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 0;  ///< fewer than this is a failure
  std::size_t refinements = 4;  ///< largest number, for each new best model
  std::uint64_t seed = 1;
};

/// The policies of RANSAC.
template <consensus_score Score = msac, sampling_order Sampling = uniform_sampling,
          preemption_test Preemption = bail_out, local_optimization LocalOptimization = iterated_refinement>
struct ransac_policies {
  Score score{};
  Sampling sampling{};
  Preemption preemption{};
  LocalOptimization optimization{};
};
template <class Score, class Sampling, class Preemption, class LocalOptimization>
ransac_policies(Score, Sampling, Preemption, LocalOptimization)
    -> ransac_policies<Score, Sampling, Preemption, LocalOptimization>;

/// Memory that calls may share one after the other: with it only the inliers of the result are allocated.
struct ransac_workspace {
  std::vector<std::uint32_t> inliers;
};

template <class Model>
struct ransac_estimate {
  Model model;
  std::vector<std::uint32_t> inliers;  ///< exactly the data within the threshold of `model`, ascending
  double score = 0.0;                  ///< sum of the costs of all data; with `msac` of
                                       ///< min(squared error, squared threshold)
  std::size_t iterations = 0;
};

namespace detail {

template <model_estimator E>
void collect_inliers(const E& estimator, const typename E::model& model, double squared_threshold,
                     std::vector<std::uint32_t>& inliers) {
  inliers.clear();
  const std::size_t n = estimator.size();
  for (std::size_t i = 0; i < n; ++i)
    if (estimator.squared_error(model, i) < squared_threshold) inliers.push_back(static_cast<std::uint32_t>(i));
}

/// The state of one RANSAC.
template <model_estimator E, class Policies>
class ransac_run {
 public:
  using model = typename E::model;
  static constexpr std::size_t sample_size = E::sample_size;

  ransac_run(const E& estimator, const ransac_options& options, const Policies& policies, ransac_workspace& workspace)
      : estimator_{estimator},
        options_{options},
        score_{policies.score},
        preemption_{policies.preemption},
        workspace_{workspace},
        squared_threshold_{options.threshold * options.threshold} {
    workspace.inliers.clear();
    workspace.inliers.reserve(estimator.size());
  }

  /// Scores a candidate; whether it is the new best.
  bool propose(const model& candidate) {
    const double score = score_of(candidate);
    if (!(score < best_score_)) return false;
    adopt(candidate, score);
    return true;
  }
  [[nodiscard]] std::span<const std::uint32_t> inliers() const noexcept { return workspace_.inliers; }
  [[nodiscard]] std::size_t refinements() const noexcept { return options_.refinements; }
  bool refine(std::span<const std::uint32_t> indices) {
    if (indices.size() <= sample_size) return false;
    const std::optional<model> refined = estimator_.refine(*best_, indices);
    return refined && propose(*refined);
  }
  [[nodiscard]] const std::optional<model>& best() const noexcept { return best_; }
  [[nodiscard]] double recognised() const { return preemption_.recognised(); }

  /// The score of the best by `squared_error`.
  [[nodiscard]] double exact_score() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < estimator_.size(); ++i)
      sum += score_.cost(static_cast<double>(estimator_.squared_error(*best_, i)), squared_threshold_);
    return sum;
  }

 private:
  void adopt(const model& candidate, double score) {
    best_ = candidate;
    best_score_ = score;
    collect_inliers(estimator_, candidate, squared_threshold_, workspace_.inliers);
    preemption_.adopted(static_cast<double>(workspace_.inliers.size()) / static_cast<double>(estimator_.size()));
  }

  /// Infinite for a model whose scoring stopped early.
  [[nodiscard]] double score_of(const model& candidate) {
    const std::size_t n = estimator_.size();
    double score = 0.0;
    std::size_t inliers = 0, seen = 0;
    preemption_.begin();
    while (seen < n) {
      const std::size_t count = std::min(consensus_block, n - seen);
      const auto [cost, inside] = score_block(candidate, seen, count);
      score += cost;
      inliers += inside;
      seen += count;
      if (score > best_score_ || (seen < n && preemption_.hopeless(inside, count))) {
        preemption_.end(false, inliers, seen);
        return std::numeric_limits<double>::infinity();
      }
    }
    preemption_.end(true, inliers, seen);
    return score;
  }

  struct block_score {
    double cost = 0.0;
    std::size_t inside = 0;
  };
  [[nodiscard]] block_score score_block(const model& candidate, std::size_t first, std::size_t count) const {
    block_score sum;
    if constexpr (block_estimator<E>) {
      std::array<float, consensus_block> errors;
      estimator_.squared_errors(candidate, first, std::span<float, consensus_block>(errors));
      const auto limit = static_cast<float>(squared_threshold_);
      if (count == consensus_block) {  // eight sums side by side, which stay in registers
        std::array<float, 8> cost{};
        std::array<std::int32_t, 8> inside{};
        for (std::size_t i = 0; i != consensus_block; i += 8)
          for (std::size_t k = 0; k != 8; ++k) {
            cost[k] += score_.cost(errors[i + k], limit);
            inside[k] += errors[i + k] < limit ? 1 : 0;
          }
        sum.cost =
            double{(cost[0] + cost[4]) + (cost[2] + cost[6])} + double{(cost[1] + cost[5]) + (cost[3] + cost[7])};
        for (const std::int32_t i : inside) sum.inside += static_cast<std::size_t>(i);
        return sum;
      }
      for (std::size_t i = 0; i != count; ++i) {
        sum.cost += double{score_.cost(errors[i], limit)};
        sum.inside += errors[i] < limit ? 1U : 0U;
      }
    } else {
      for (std::size_t i = first; i != first + count; ++i) {
        const double e = estimator_.squared_error(candidate, i);
        sum.cost += score_.cost(e, squared_threshold_);
        sum.inside += e < squared_threshold_ ? 1U : 0U;
      }
    }
    return sum;
  }

  const E& estimator_;
  const ransac_options& options_;
  const decltype(Policies::score)& score_;
  decltype(Policies::preemption) preemption_;
  ransac_workspace& workspace_;
  double squared_threshold_;
  std::optional<model> best_;
  double best_score_ = std::numeric_limits<double>::infinity();
};

/// The options of RANSAC among those of an estimator, which have the same names everywhere.
template <class Options>
[[nodiscard]] ransac_options ransac_part(const Options& options) {
  return {.threshold = options.threshold,
          .confidence = options.confidence,
          .min_iterations = options.min_iterations,
          .max_iterations = options.max_iterations,
          .min_inliers = options.min_inliers,
          .seed = options.seed};
}

/// What is wrong with the options; null if nothing is.
[[nodiscard]] inline const char* fault_of(const ransac_options& options) noexcept {
  if (!(options.threshold > 0.0) || !std::isfinite(options.threshold))
    return "the threshold must be positive and finite";
  if (!(options.confidence > 0.0 && options.confidence < 1.0)) return "the confidence must lie between 0 and 1";
  return nullptr;
}

/// An error if `have` inliers of `n` data are fewer than asked for, or fewer than a sample.
[[nodiscard]] inline result<void> enough_inliers(const char* where, std::size_t have, std::size_t n,
                                                 std::size_t min_inliers, std::size_t sample_size) {
  const std::size_t needed = std::max(min_inliers, sample_size);
  if (have >= needed) return {};
  return fail(errc::degenerate, where,
              "no model has enough inliers: " + std::to_string(have) + " of " + std::to_string(n) + ", " +
                  std::to_string(needed) + " are wanted");
}

/// The model of `found` after ten refinement steps on its inliers, if that improves its score and keeps `min_inliers`;
/// else the model itself.
template <class E>
[[nodiscard]] typename E::model polished(const E& estimator, const ransac_estimate<typename E::model>& found,
                                         double squared_threshold, std::size_t min_inliers) {
  const auto refined = estimator.refine(found.model, found.inliers, 10);
  if (!refined) return found.model;
  double score = 0.0;
  std::size_t inside = 0;
  for (std::size_t i = 0; i != estimator.size(); ++i) {
    const double e = estimator.squared_error(*refined, i);
    score += msac::cost(e, squared_threshold);
    inside += e < squared_threshold ? 1U : 0U;
  }
  return score < found.score && inside >= min_inliers ? *refined : found.model;
}

}  // namespace detail

/// The model that most of the data agree with. The same data, options and seed give the same result. With `sprt` the
/// data must be in random order. O(data) for each model that is scored to the end. Errors: `invalid_argument` for
/// options out of range; `no_data` for fewer data than a sample; `degenerate` if no sample gives a model, or no model
/// has `min_inliers` inliers and at least as many as a sample.
template <model_estimator E, consensus_score Score = msac, sampling_order Sampling = uniform_sampling,
          preemption_test Preemption = bail_out, local_optimization LocalOptimization = iterated_refinement>
[[nodiscard]] result<ransac_estimate<typename E::model>> ransac(
    const E& estimator, const ransac_options& options,
    const ransac_policies<Score, Sampling, Preemption, LocalOptimization>& policies, ransac_workspace& workspace) {
  constexpr const char* where = "ransac";
  if (const char* const fault = detail::fault_of(options)) return fail(errc::invalid_argument, where, fault);
  const std::size_t n = estimator.size();
  if (n < E::sample_size) return fail(errc::no_data, where, "fewer data than one sample needs");

  random_bits random(options.seed);
  auto sampler = policies.sampling.template over<E::sample_size>(n);
  detail::ransac_run<E, ransac_policies<Score, Sampling, Preemption, LocalOptimization>> run(estimator, options,
                                                                                             policies, workspace);
  double wanted = static_cast<double>(options.max_iterations);
  std::size_t iteration = 0;
  for (; iteration < options.max_iterations &&
         (iteration < options.min_iterations || static_cast<double>(iteration) < wanted);
       ++iteration) {
    bool improved = false;
    for (const auto& candidate : estimator.fit(sampler.draw(random))) improved |= run.propose(candidate);
    if (!improved) continue;
    policies.optimization.operate(run, random);
    wanted = sampler.wanted(options.confidence, run.inliers(), run.recognised());
  }

  if (!run.best()) return fail(errc::degenerate, where, "no sample of the data gives a model");
  if (auto enough = detail::enough_inliers(where, run.inliers().size(), n, options.min_inliers, E::sample_size);
      !enough)
    return fail(std::move(enough.error()));
  return ransac_estimate<typename E::model>{
      *run.best(), {run.inliers().begin(), run.inliers().end()}, run.exact_score(), iteration};
}

/// As above, with memory of its own.
template <model_estimator E, consensus_score Score = msac, sampling_order Sampling = uniform_sampling,
          preemption_test Preemption = bail_out, local_optimization LocalOptimization = iterated_refinement>
[[nodiscard]] result<ransac_estimate<typename E::model>> ransac(
    const E& estimator, const ransac_options& options,
    const ransac_policies<Score, Sampling, Preemption, LocalOptimization>& policies = {}) {
  ransac_workspace workspace;
  return ransac(estimator, options, policies, workspace);
}

}  // namespace orbis::optimize
