// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What RANSAC can be made of: how a model is scored, in which order samples are drawn, when the scoring
/// of a bad model is given up, and how a new best model is made better.
///
/// Each is a small struct; where RANSAC needs something to keep between its iterations, the struct makes
/// it with `over(...)`. See `ransac.hpp`.
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

/// `S::cost(squared_error, squared_threshold)`: what a datum adds to the score, which is to be small. Between 0 and
/// the squared threshold, which it is for every error at or beyond the threshold, and NaN. For float and double.
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

/// Outliers count, inliers do not. M. Fischler, R. Bolles, CACM 24 (1981).
struct inlier_count {
  template <std::floating_point S>
  [[nodiscard]] static constexpr S cost(S squared, S limit) noexcept {
    return squared < limit ? S(0) : limit;
  }
};

/// Tukey's biweight, which is flat where inliers end: errors near the threshold matter less than with `msac`.
struct biweight_score {
  template <std::floating_point S>
  [[nodiscard]] static constexpr S cost(S squared, S limit) noexcept {
    const S rest = squared < limit ? S(1) - squared / limit : S(0);
    return limit * (S(1) - rest * rest * rest);
  }
};

static_assert(consensus_score<msac> && consensus_score<inlier_count> && consensus_score<biweight_score>);

// -- the order of samples ---------------------------------------------------------------------------------------------

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

/// How many samples it takes to find, with the wanted confidence, one without an outlier, if such a sample is
/// recognised with probability `recognised`.
[[nodiscard]] inline double wanted_iterations(double confidence, double inlier_ratio, std::size_t sample_size,
                                              double recognised = 1.0) {
  const double clean = std::pow(inlier_ratio, static_cast<double>(sample_size)) * recognised;
  if (clean >= 1.0) return 0.0;
  if (clean < 1e-12) return std::numeric_limits<double>::infinity();
  return std::log(1.0 - confidence) / std::log1p(-clean);
}

}  // namespace detail

/// `s.over<N>(n)`: something that draws N out of n data, time after time, and knows when it has drawn enough.
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
    /// How many samples to draw if these are the inliers (ascending).
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

/// Samples of promising data first: from a set of the best data that grows until it is all of them.
/// O. Chum, J. Matas, "Matching with PROSAC: progressive sample consensus", CVPR 2005.
struct prosac {
  /// All data, from the most to the least promising (smallest descriptor distance first, say).
  /// @pre a permutation of 0 ... n - 1; it must live as long as RANSAC runs
  std::span<const std::uint32_t> best_first;
  /// After so many samples drawing is as with `uniform_sampling`.
  double samples_until_uniform = 200000.0;

  template <std::size_t N>
  class sampler {
   public:
    sampler(const prosac& p, std::size_t n) : order_{p.best_first}, pool_{std::min(N, n)} {
      assert(p.best_first.size() == n);
      // T_n for n = N: the number of samples of `samples_until_uniform` that lie in the first N data.
      in_pool_ = p.samples_until_uniform;
      for (std::size_t i = 0; i != N; ++i) in_pool_ *= static_cast<double>(N - i) / static_cast<double>(n - i);
    }
    [[nodiscard]] std::array<std::uint32_t, N> draw(random_bits& random) {
      ++drawn_;
      while (drawn_ > until_growth_ && pool_ < order_.size()) {
        const double next = in_pool_ * static_cast<double>(pool_ + 1) / static_cast<double>(pool_ + 1 - N);
        until_growth_ += static_cast<std::size_t>(std::ceil(next - in_pool_));
        in_pool_ = next;
        ++pool_;
      }
      std::array<std::uint32_t, N> sample{};
      if (drawn_ > until_growth_ || pool_ == N) {  // the pool is everything, or just one sample
        sample = detail::draw_sample<N>(random, pool_);
      } else {  // the newest, and others before it
        if constexpr (N > 1) {
          const auto others = detail::draw_sample<N - 1>(random, pool_ - 1);
          std::copy(others.begin(), others.end(), sample.begin());
        }
        sample[N - 1] = static_cast<std::uint32_t>(pool_ - 1);
      }
      for (std::uint32_t& i : sample) i = order_[i];
      return sample;
    }
    /// Enough once all data say so. (The stop by a prefix of the data needs ranks that can be trusted; this does not.)
    [[nodiscard]] double wanted(double confidence, std::span<const std::uint32_t> inliers, double recognised) const {
      return detail::wanted_iterations(
          confidence, static_cast<double>(inliers.size()) / static_cast<double>(order_.size()), N, recognised);
    }

   private:
    std::span<const std::uint32_t> order_;
    std::size_t pool_;
    std::size_t drawn_ = 0;
    std::size_t until_growth_ = 1;
    double in_pool_;
  };
  template <std::size_t N>
  [[nodiscard]] sampler<N> over(std::size_t n) const {
    return {*this, n};
  }
};

static_assert(sampling_order<uniform_sampling> && sampling_order<prosac>);

// -- giving up on bad models ------------------------------------------------------------------------------------------

/// While a model is scored, block by block: `begin()`, then `hopeless(inliers, data)` after each block (those of the
/// block), and `end(complete, inliers, data)` with the numbers of all blocks seen. `adopted(ratio)`: a new best model
/// has this ratio of inliers. `recognised()`: the probability that a model as good as the best is scored to its end.
template <class P>
concept preemption_test = std::copyable<P> && requires(P p, std::size_t n) {
  {p.begin()};
  { p.hopeless(n, n) } -> std::same_as<bool>;
  {p.end(bool{}, n, n)};
  {p.adopted(double{})};
  { p.recognised() } -> std::same_as<double>;
};

/// Scoring ends as soon as the score is worse than the best: nothing is lost, and little gained where there are many
/// outliers.
struct bail_out {
  static void begin() noexcept {}
  [[nodiscard]] static bool hopeless(std::size_t, std::size_t) noexcept { return false; }
  static void end(bool, std::size_t, std::size_t) noexcept {}
  static void adopted(double) noexcept {}
  [[nodiscard]] static double recognised() noexcept { return 1.0; }
};

/// Wald's sequential test: a model goes as soon as what has been seen of it is much likelier for a bad model than for
/// one as good as the best so far. The data must be in no particular order. Rejects a good model now and then; the
/// number of iterations makes up for it.
///
/// Source: J. Matas, O. Chum, "Randomized RANSAC with sequential probability ratio test", ICCV 2005.
struct sprt {
  sprt() = default;
  /// The time to make a model from a sample, in times to score one datum.
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

// -- making the best better -------------------------------------------------------------------------------------------

namespace detail {
/// What RANSAC shows of itself; never made.
struct any_ransac_run {
  static constexpr std::size_t sample_size = 1;
  std::span<const std::uint32_t> inliers() const;
  std::size_t refinements() const;
  bool refine(std::span<const std::uint32_t>);
  std::span<const std::uint32_t> draw_inliers(std::size_t, random_bits&);
};
}  // namespace detail

/// `o.operate(run, random)` is called whenever a model has become the best: `run.inliers()` are its inliers,
/// `run.refine(indices)` makes a model of those data, starting at the best, and says whether it has become the best,
/// `run.refinements()` is how often that is wanted at most, `run.draw_inliers(count, random)` are so many of the
/// inliers.
template <class O>
concept local_optimization = requires(const O& o, detail::any_ransac_run& run, random_bits& random) {
  o.operate(run, random);
};

/// None: the best is what a sample gives.
struct no_local_optimization {
  template <class Run>
  static void operate(Run&, random_bits&) noexcept {}
};

/// On the inliers, then on those of the outcome, as long as that helps.
struct iterated_refinement {
  template <class Run>
  static void operate(Run& run, random_bits&) {
    for (std::size_t k = 0; k < run.refinements(); ++k)
      if (!run.refine(run.inliers())) return;
  }
};

/// The same after refinements on random parts of the inliers, for estimators whose `refine` is led astray by few bad
/// inliers. O. Chum, J. Matas, J. Kittler, "Locally optimized RANSAC", DAGM 2003.
struct inner_sampling {
  std::size_t rounds = 10;
  std::size_t samples = 7;  ///< data in a part, in samples

  template <class Run>
  void operate(Run& run, random_bits& random) const {
    for (std::size_t k = 0; k != rounds; ++k) {
      const std::size_t part = std::min(samples * Run::sample_size, run.inliers().size() / 2);
      if (part > Run::sample_size) run.refine(run.draw_inliers(part, random));
    }
    iterated_refinement::operate(run, random);
  }
};

static_assert(local_optimization<no_local_optimization> && local_optimization<iterated_refinement> &&
              local_optimization<inner_sampling>);

}  // namespace orbis::optimize
