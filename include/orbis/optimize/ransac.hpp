// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RANSAC for any model, deterministic for a given seed: models are scored by the truncated squared error, and each new
/// best model is refined on its inliers.
///
/// Sources: M. Fischler, R. Bolles, CACM 24 (1981); P. Torr, A. Zisserman, "MLESAC", CVIU 78 (2000), for the score; J.
/// Matas, O. Chum, "Randomized RANSAC with sequential probability ratio test", ICCV 2005; R. Raguram et al., "USAC: a
/// universal framework for random sample consensus", PAMI 35 (2013), for the combination of the parts.
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

namespace orbis::optimize {

/// A model and its data, as required by RANSAC.
///
/// - `E::sample_size`: the number of data points that determine the model up to a few solutions.
/// - `size()`: the number of data points.
/// - `fit(sample)`: a range of candidate models from `sample_size` data points; empty if these are degenerate.
/// - `squared_error(model, i)`: the squared error of data point `i`, in squared units of the threshold;
///   infinite or NaN if it has none.
/// - `refine(model, inliers)`: a better model from many data points, starting at `model`; empty if that fails. Return
///   the model itself to disable refinement.
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

/// Return type of `fit` if a sample determines at most one model.
template <class Model>
struct one_or_none {
  std::optional<Model> found;
  [[nodiscard]] const Model* begin() const noexcept { return found ? &*found : nullptr; }
  [[nodiscard]] const Model* end() const noexcept { return found ? &*found + 1 : nullptr; }
};

/// The number of data points scored at a time.
inline constexpr std::size_t consensus_block = 32;

/// An estimator with batched errors: `squared_errors(model, first, out)` writes the errors of `consensus_block` data
/// points starting at index `first`, which is a multiple of `consensus_block`; values beyond the last data point are
/// ignored. These errors rank the models; `squared_error` determines the inliers.
template <class E>
concept block_estimator = model_estimator<E> && requires(const E& estimator, const typename E::model& model,
                                                         std::size_t first, std::span<float, consensus_block> out) {
  estimator.squared_errors(model, first, out);
};

struct ransac_options {
  double threshold = 1.0;  ///< maximum error of an inlier, in the estimator's units (not squared); positive, finite
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 0;  ///< minimum number of inliers for success
  std::size_t refinements = 4;  ///< maximum number of refinements of each new best model
  /// If positive, bad models are rejected by a sequential probability ratio test, which sometimes rejects a good one;
  /// the number of iterations accounts for that. The value is the time to compute a model from a sample, divided by the
  /// time to score one data point. The test requires data in random order.
  double model_cost = 0.0;
  std::uint64_t seed = 1;
};

/// Reusable memory; not for concurrent calls. A call that uses it allocates only the inliers of the result.
struct ransac_workspace {
  std::vector<std::uint32_t> inliers;
};

template <class Model>
struct ransac_estimate {
  Model model;
  std::vector<std::uint32_t> inliers;  ///< indices of all data points within the threshold of `model`, ascending
  double score = 0.0;                  ///< sum over all data points of min(squared error, squared threshold)
  std::size_t iterations = 0;
};

namespace detail {

/// The truncated squared error: the contribution of a data point to the score (smaller is better); NaN counts as the
/// limit.
template <std::floating_point S>
[[nodiscard]] constexpr S msac_cost(S squared, S limit) noexcept {
  return squared < limit ? squared : limit;
}

/// Returns `N` distinct random indices less than `n`. @pre n >= N
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

/// Returns the number of samples after which at least one is free of outliers with probability `confidence`;
/// `recognised` is the probability that the sequential test accepts such a sample.
[[nodiscard]] inline double wanted_iterations(double confidence, double inlier_ratio, std::size_t sample_size,
                                              double recognised) {
  const double clean = std::pow(inlier_ratio, static_cast<double>(sample_size)) * recognised;
  if (clean >= 1.0) return 0.0;
  if (clean < 1e-12) return std::numeric_limits<double>::infinity();
  return std::log(1.0 - confidence) / std::log1p(-clean);
}

/// Sequential probability ratio test: scoring stops as soon as the scored data are much more likely under a bad model
/// than under a model as good as the best one so far.
class sequential_test {
 public:
  /// `model_cost`: see `ransac_options`; 0: no model is rejected.
  explicit sequential_test(double model_cost) noexcept : model_cost_{model_cost} {}

  /// Call before scoring a model.
  void begin() noexcept { log_ratio_ = 0.0; }
  /// Returns true if scoring should stop after a block of `data` data points with this number of inliers.
  [[nodiscard]] bool rejects(std::size_t inliers, std::size_t data) noexcept {
    log_ratio_ += static_cast<double>(inliers) * if_inlier_ + static_cast<double>(data - inliers) * if_outlier_;
    return log_ratio_ > log_threshold_;
  }
  /// Call after scoring a model, with the number of inliers among the scored data points.
  void end(std::size_t inliers, std::size_t data) noexcept {
    // Nearly all models are bad: their mean inlier ratio estimates that of bad models.
    const double ratio = static_cast<double>(inliers) / static_cast<double>(std::max<std::size_t>(1, data));
    ++seen_;
    bad_ += (std::min(ratio, 0.5) - bad_) / std::min(500.0, 10.0 + seen_);
    if (std::abs(bad_ - designed_for_) > 0.1 * designed_for_) design();
  }
  /// Sets the inlier ratio of the new best model.
  void adopted(double inlier_ratio) noexcept {
    good_ = inlier_ratio;
    design();
  }
  /// Returns the probability that a model as good as the best one is scored completely.
  [[nodiscard]] double recognised() const noexcept {
    return std::isfinite(log_threshold_) ? 1.0 - std::exp(-log_threshold_) : 1.0;
  }

 private:
  void design() noexcept {
    designed_for_ = bad_;
    const double bad = std::clamp(bad_, 1e-3, 0.9), good = std::min(good_, 0.99);
    if (model_cost_ == 0.0 || !(good > 1.5 * bad)) {  // good models cannot be distinguished yet
      log_threshold_ = std::numeric_limits<double>::infinity();
      if_inlier_ = if_outlier_ = 0.0;
      return;
    }
    if_inlier_ = std::log(bad / good);
    if_outlier_ = std::log((1.0 - bad) / (1.0 - good));
    const double information = bad * if_inlier_ + (1.0 - bad) * if_outlier_;  // per data point, for a bad model
    const double k = model_cost_ * information + 1.0;
    double threshold = k;
    for (int i = 0; i != 5; ++i) threshold = k + std::log(threshold);
    log_threshold_ = std::log(std::max(threshold, 20.0));
  }

  double model_cost_;
  double good_ = 0.0;
  double bad_ = 0.01;
  double designed_for_ = 0.01;
  double seen_ = 0.0;
  double if_inlier_ = 0.0;
  double if_outlier_ = 0.0;
  double log_threshold_ = std::numeric_limits<double>::infinity();
  double log_ratio_ = 0.0;
};

/// The state of a RANSAC run.
template <model_estimator E>
class ransac_run {
 public:
  using model = typename E::model;
  static constexpr std::size_t sample_size = E::sample_size;

  ransac_run(const E& estimator, const ransac_options& options, ransac_workspace& workspace)
      : estimator_{estimator},
        options_{options},
        test_{options.model_cost},
        workspace_{workspace},
        squared_threshold_{options.threshold * options.threshold} {
    workspace.inliers.clear();
    workspace.inliers.reserve(estimator.size());
  }

  /// Scores a candidate; returns true if it is the new best.
  bool propose(const model& candidate) {
    const double score = score_model(candidate);
    if (!(score < best_score_)) return false;
    adopt(candidate, score);
    return true;
  }
  [[nodiscard]] std::span<const std::uint32_t> inliers() const noexcept { return workspace_.inliers; }
  /// Refines the best model on its inliers, then the result on its own inliers, as long as the score improves.
  void refine() {
    for (std::size_t k = 0; k < options_.refinements && workspace_.inliers.size() > sample_size; ++k) {
      const std::optional<model> refined = estimator_.refine(*best_, workspace_.inliers);
      if (!refined || !propose(*refined)) return;
    }
  }
  [[nodiscard]] const std::optional<model>& best() const noexcept { return best_; }
  /// Returns the number of samples required, assuming that the best model is correct.
  [[nodiscard]] double wanted() const {
    return wanted_iterations(options_.confidence,
                             static_cast<double>(workspace_.inliers.size()) / static_cast<double>(estimator_.size()),
                             sample_size, test_.recognised());
  }

  /// Returns the score of the best model, computed with `squared_error`.
  [[nodiscard]] double exact_score() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < estimator_.size(); ++i)
      sum += msac_cost(static_cast<double>(estimator_.squared_error(*best_, i)), squared_threshold_);
    return sum;
  }

 private:
  void adopt(const model& candidate, double score) {
    best_ = candidate;
    best_score_ = score;
    workspace_.inliers.clear();
    const std::size_t n = estimator_.size();
    for (std::size_t i = 0; i != n; ++i)
      if (estimator_.squared_error(candidate, i) < squared_threshold_)
        workspace_.inliers.push_back(static_cast<std::uint32_t>(i));
    test_.adopted(static_cast<double>(workspace_.inliers.size()) / static_cast<double>(n));
  }

  /// Returns the score of a candidate; infinite if scoring stopped early.
  [[nodiscard]] double score_model(const model& candidate) {
    const std::size_t n = estimator_.size();
    double score = 0.0;
    std::size_t inliers = 0, seen = 0;
    test_.begin();
    while (seen < n) {
      const std::size_t count = std::min(consensus_block, n - seen);
      const auto [cost, inside] = score_block(candidate, seen, count);
      score += cost;
      inliers += inside;
      seen += count;
      if (score > best_score_ || (seen < n && test_.rejects(inside, count))) {
        test_.end(inliers, seen);
        return std::numeric_limits<double>::infinity();
      }
    }
    test_.end(inliers, seen);
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
      if (count == consensus_block) {  // eight partial sums stay in registers
        std::array<float, 8> cost{};
        std::array<std::int32_t, 8> inside{};
        for (std::size_t i = 0; i != consensus_block; i += 8)
          for (std::size_t k = 0; k != 8; ++k) {
            cost[k] += msac_cost(errors[i + k], limit);
            inside[k] += errors[i + k] < limit ? 1 : 0;
          }
        sum.cost =
            double{(cost[0] + cost[4]) + (cost[2] + cost[6])} + double{(cost[1] + cost[5]) + (cost[3] + cost[7])};
        for (const std::int32_t i : inside) sum.inside += static_cast<std::size_t>(i);
        return sum;
      }
      for (std::size_t i = 0; i != count; ++i) {
        sum.cost += double{msac_cost(errors[i], limit)};
        sum.inside += errors[i] < limit ? 1U : 0U;
      }
    } else {
      for (std::size_t i = first; i != first + count; ++i) {
        const double e = estimator_.squared_error(candidate, i);
        sum.cost += msac_cost(e, squared_threshold_);
        sum.inside += e < squared_threshold_ ? 1U : 0U;
      }
    }
    return sum;
  }

  const E& estimator_;
  const ransac_options& options_;
  sequential_test test_;
  ransac_workspace& workspace_;
  double squared_threshold_;
  std::optional<model> best_;
  double best_score_ = std::numeric_limits<double>::infinity();
};

/// Copies the RANSAC options from an estimator's options, whose members have the same names.
template <class Options>
[[nodiscard]] ransac_options ransac_part(const Options& options, double model_cost = 200.0) {
  return {.threshold = options.threshold,
          .confidence = options.confidence,
          .min_iterations = options.min_iterations,
          .max_iterations = options.max_iterations,
          .min_inliers = options.min_inliers,
          .model_cost = model_cost,
          .seed = options.seed};
}

/// Returns the reason why the options are invalid; null if they are valid.
[[nodiscard]] inline const char* find_fault(const ransac_options& options) noexcept {
  if (!(options.threshold > 0.0) || !std::isfinite(options.threshold))
    return "the threshold must be positive and finite";
  if (!(options.confidence > 0.0 && options.confidence < 1.0)) return "the confidence must be between 0 and 1";
  return nullptr;
}

/// Returns an error if `have`, the number of inliers among `n` data points, is less than `min_inliers` or the sample
/// size.
[[nodiscard]] inline result<void> enough_inliers(const char* where, std::size_t have, std::size_t n,
                                                 std::size_t min_inliers, std::size_t sample_size) {
  const std::size_t needed = std::max(min_inliers, sample_size);
  if (have >= needed) return {};
  return fail(errc::degenerate, where,
              "no model has enough inliers: " + std::to_string(have) + " of " + std::to_string(n) + ", " +
                  std::to_string(needed) + " are required");
}

/// Returns the model of `found` after ten refinement steps on its inliers if that improves its score and leaves at
/// least `min_inliers` inliers; otherwise the model of `found`.
template <class E>
[[nodiscard]] typename E::model polished(const E& estimator, const ransac_estimate<typename E::model>& found,
                                         double squared_threshold, std::size_t min_inliers) {
  const auto refined = estimator.refine(found.model, found.inliers, 10);
  if (!refined) return found.model;
  double score = 0.0;
  std::size_t inside = 0;
  for (std::size_t i = 0; i != estimator.size(); ++i) {
    const double e = estimator.squared_error(*refined, i);
    score += msac_cost(e, squared_threshold);
    inside += e < squared_threshold ? 1U : 0U;
  }
  return score < found.score && inside >= min_inliers ? *refined : found.model;
}

}  // namespace detail

/// Estimates the model that agrees with most of the data. The same data, options and seed give the same result. O(data
/// points) per completely scored model. Errors: `invalid_argument` for options out of range; `no_data` for fewer data
/// points than the sample size; `degenerate` if no sample gives a model, or no model has at least `max(min_inliers,
/// sample_size)` inliers.
template <model_estimator E>
[[nodiscard]] result<ransac_estimate<typename E::model>> ransac(const E& estimator, const ransac_options& options,
                                                                ransac_workspace& workspace) {
  constexpr const char* where = "ransac";
  if (const char* const fault = detail::find_fault(options)) return fail(errc::invalid_argument, where, fault);
  const std::size_t n = estimator.size();
  if (n < E::sample_size) return fail(errc::no_data, where, "fewer data points than the sample size");

  random_bits random(options.seed);
  detail::ransac_run<E> run(estimator, options, workspace);
  double wanted = static_cast<double>(options.max_iterations);
  std::size_t iteration = 0;
  for (; iteration < options.max_iterations &&
         (iteration < options.min_iterations || static_cast<double>(iteration) < wanted);
       ++iteration) {
    bool improved = false;
    for (const auto& candidate : estimator.fit(detail::draw_sample<E::sample_size>(random, n)))
      improved |= run.propose(candidate);
    if (!improved) continue;
    run.refine();
    wanted = run.wanted();
  }

  if (!run.best()) return fail(errc::degenerate, where, "no sample yields a model");
  if (auto enough = detail::enough_inliers(where, run.inliers().size(), n, options.min_inliers, E::sample_size);
      !enough)
    return fail(std::move(enough.error()));
  return ransac_estimate<typename E::model>{
      *run.best(), {run.inliers().begin(), run.inliers().end()}, run.exact_score(), iteration};
}

/// Like the overload with a workspace, but with temporary working memory.
template <model_estimator E>
[[nodiscard]] result<ransac_estimate<typename E::model>> ransac(const E& estimator, const ransac_options& options) {
  ransac_workspace workspace;
  return ransac(estimator, options, workspace);
}

}  // namespace orbis::optimize
