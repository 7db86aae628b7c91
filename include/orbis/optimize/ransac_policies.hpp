// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The policies of RANSAC: how a model is scored, in which order samples are drawn, when the scoring of a bad model
/// stops early, and how a new best model is refined. Each is a small struct; see `ransac.hpp`.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <orbis/core/random.hpp>

namespace orbis::optimize {

// -- scoring ----------------------------------------------------------------------------------------------------------

/// `S::cost(squared_error, squared_threshold)` is what a datum adds to the score, of which the least is the best. It
/// lies between 0 and the squared threshold; errors at or beyond the threshold, and NaN, cost the squared threshold.
/// For float and double.
template <class S>
concept consensus_score = requires(const S& score, float f, double d) {
  { score.cost(f, f) } -> std::same_as<float>;
  { score.cost(d, d) } -> std::same_as<double>;
};

/// The truncated squared error. P. Torr, A. Zisserman, "MLESAC", CVIU 78 (2000).
struct msac {
  template <std::floating_point S>
  [[nodiscard]] static constexpr S cost(S squared, S limit) noexcept {
    return squared < limit ? squared : limit;
  }
};

static_assert(consensus_score<msac>);

// -- order of samples -------------------------------------------------------------------------------------------------

namespace detail {

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

/// The number of samples after which one of them is without outliers, with probability `confidence`; `recognised` is
/// the probability that such a sample is recognised.
[[nodiscard]] inline double wanted_iterations(double confidence, double inlier_ratio, std::size_t sample_size,
                                              double recognised = 1.0) {
  const double clean = std::pow(inlier_ratio, static_cast<double>(sample_size)) * recognised;
  if (clean >= 1.0) return 0.0;
  if (clean < 1e-12) return std::numeric_limits<double>::infinity();
  return std::log(1.0 - confidence) / std::log1p(-clean);
}

}  // namespace detail

/// `s.over<N>(n)` is a sampler: `draw(random)` draws N of n data, `wanted(confidence, inliers, recognised)` is the
/// number of samples that are enough if these are the inliers.
template <class S>
concept sampling_order = requires(const S& s, random_bits& random, std::span<const std::uint32_t> inliers) {
  { s.template over<3>(std::size_t{}).draw(random) } -> std::same_as<std::array<std::uint32_t, 3>>;
  { s.template over<3>(std::size_t{}).wanted(double{}, inliers, double{}) } -> std::same_as<double>;
};

/// Every sample equally likely.
struct uniform_sampling {
  template <std::size_t N>
  struct sampler {
    std::size_t size;
    [[nodiscard]] std::array<std::uint32_t, N> draw(random_bits& random) {
      return detail::draw_sample<N>(random, size);
    }
    [[nodiscard]] double wanted(double confidence, std::span<const std::uint32_t> inliers, double recognised) const {
      return detail::wanted_iterations(confidence, static_cast<double>(inliers.size()) / static_cast<double>(size), N,
                                       recognised);
    }
  };
  template <std::size_t N>
  [[nodiscard]] sampler<N> over(std::size_t n) const {
    return {n};
  }
};

static_assert(sampling_order<uniform_sampling>);

// -- preemption -------------------------------------------------------------------------------------------------------

/// Is asked while a model is scored, block by block: `begin()`, then `hopeless(inliers, data)` with the numbers of each
/// block, true to stop, and `end(complete, inliers, data)` with the numbers of all blocks seen. `adopted(ratio)` tells
/// the inlier ratio of a new best model. `recognised()` is the probability that a model as good as the best is scored
/// to the end.
template <class P>
concept preemption_test = std::copyable<P> && requires(P p, std::size_t n) {
  {p.begin()};
  { p.hopeless(n, n) } -> std::same_as<bool>;
  {p.end(bool{}, n, n)};
  {p.adopted(double{})};
  { p.recognised() } -> std::same_as<double>;
};

/// Scoring stops only when the score is worse than the best: no good model is lost.
struct bail_out {
  static void begin() noexcept {}
  [[nodiscard]] static bool hopeless(std::size_t, std::size_t) noexcept { return false; }
  static void end(bool, std::size_t, std::size_t) noexcept {}
  static void adopted(double) noexcept {}
  [[nodiscard]] static double recognised() noexcept { return 1.0; }
};

/// Sequential probability ratio test: scoring stops as soon as the data seen are much more likely for a bad model than
/// for one as good as the best so far. The data must be in random order. Sometimes rejects a good model, which the
/// number of iterations accounts for.
///
/// Source: J. Matas, O. Chum, "Randomized RANSAC with sequential probability ratio test", ICCV 2005.
struct sprt {
  sprt() = default;
  /// `model_cost`: the time to compute a model from a sample, divided by the time to score one datum.
  explicit sprt(double model_cost) noexcept : model_cost_{model_cost} {}

  void begin() noexcept { log_ratio_ = 0.0; }
  [[nodiscard]] bool hopeless(std::size_t inliers, std::size_t data) noexcept {
    log_ratio_ += static_cast<double>(inliers) * if_inlier_ + static_cast<double>(data - inliers) * if_outlier_;
    return log_ratio_ > log_threshold_;
  }
  void end(bool complete, std::size_t inliers, std::size_t data) noexcept {
    // Nearly all models are bad: their mean ratio of inliers is the one of bad models.
    static_cast<void>(complete);
    const double ratio = static_cast<double>(inliers) / static_cast<double>(std::max<std::size_t>(1, data));
    ++seen_;
    bad_ += (std::min(ratio, 0.5) - bad_) / std::min(500.0, 10.0 + seen_);
    if (std::abs(bad_ - designed_for_) > 0.1 * designed_for_) design();
  }
  void adopted(double inlier_ratio) noexcept {
    good_ = inlier_ratio;
    design();
  }
  [[nodiscard]] double recognised() const noexcept {
    return std::isfinite(log_threshold_) ? 1.0 - std::exp(-log_threshold_) : 1.0;
  }

 private:
  void design() noexcept {
    designed_for_ = bad_;
    const double bad = std::clamp(bad_, 1e-3, 0.9), good = std::min(good_, 0.99);
    if (!(good > 1.5 * bad)) {  // nothing to tell good models by, yet
      log_threshold_ = std::numeric_limits<double>::infinity();
      if_inlier_ = if_outlier_ = 0.0;
      return;
    }
    if_inlier_ = std::log(bad / good);
    if_outlier_ = std::log((1.0 - bad) / (1.0 - good));
    const double information = bad * if_inlier_ + (1.0 - bad) * if_outlier_;  // per datum of a bad model
    const double k = model_cost_ * information + 1.0;
    double threshold = k;
    for (int i = 0; i != 5; ++i) threshold = k + std::log(threshold);
    log_threshold_ = std::log(std::max(threshold, 20.0));
  }

  double model_cost_ = 200.0;
  double good_ = 0.0;
  double bad_ = 0.01;
  double designed_for_ = 0.01;
  double seen_ = 0.0;
  double if_inlier_ = 0.0;
  double if_outlier_ = 0.0;
  double log_threshold_ = std::numeric_limits<double>::infinity();
  double log_ratio_ = 0.0;
};

static_assert(preemption_test<bail_out> && preemption_test<sprt>);

// -- local optimisation -----------------------------------------------------------------------------------------------

namespace detail {
/// The members of RANSAC that a local optimisation may use, for the concept below; never constructed.
struct any_ransac_run {
  std::span<const std::uint32_t> inliers() const;
  std::size_t refinements() const;
  bool refine(std::span<const std::uint32_t>);
};
}  // namespace detail

/// `o.operate(run, random)` is called whenever a model has become the best: `run.inliers()` are its inliers;
/// `run.refine(indices)` refines the best model on these data and returns whether the outcome is the new best;
/// `run.refinements()` is the largest number of refinements asked for.
template <class O>
concept local_optimization = requires(const O& o, detail::any_ransac_run& run, random_bits& random) {
  o.operate(run, random);
};

/// None: the best model is one that comes from a sample.
struct no_local_optimization {
  template <class Run>
  static void operate(Run&, random_bits&) noexcept {}
};

/// Refines on the inliers, then on the inliers of the outcome, as long as the score improves.
struct iterated_refinement {
  template <class Run>
  static void operate(Run& run, random_bits&) {
    for (std::size_t k = 0; k < run.refinements(); ++k)
      if (!run.refine(run.inliers())) return;
  }
};

static_assert(local_optimization<no_local_optimization> && local_optimization<iterated_refinement>);

}  // namespace orbis::optimize
