// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of the exposure time from the motion blur of patches.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace orbis::slam::detail {

/// Compares exposure times of up to 32 ms by the correlation of patches that are blurred accordingly. Old evidence
/// decays, so that the estimate follows slow changes. The exposure time of a patch is assumed to be that of the image.
class exposure_estimation {
 public:
  static constexpr std::size_t count = 9;
  /// Returns the `i`-th exposure time to compare, seconds.
  [[nodiscard]] static constexpr double candidate(std::size_t i) noexcept { return 0.004 * static_cast<double>(i); }

  /// Adds the correlations of a patch in a frame, one per candidate. A patch has more effect the more its correlation
  /// depends on the exposure time.
  void add(const std::array<double, count>& correlations) noexcept {
    constexpr double memory = 0.999;
    weight_ = memory * weight_ + 1.0;
    for (std::size_t i = 0; i != count; ++i) sums_[i] = memory * sums_[i] + correlations[i];
  }

  /// Returns true if there is enough evidence for an estimate.
  [[nodiscard]] bool has_enough() const noexcept { return weight_ >= enough; }

  /// Returns the estimate, seconds: the best candidate, refined by a parabola; 0 until there is enough evidence.
  [[nodiscard]] double exposure() const noexcept {
    constexpr double clear = 0.002;  // gain of the mean correlation
    const auto best = static_cast<std::size_t>(std::max_element(sums_.begin(), sums_.end()) - sums_.begin());
    if (!has_enough() || sums_[best] - sums_[0] < clear * weight_) return 0.0;
    if (best + 1 == count) return candidate(best);
    const double before = sums_[best - 1] - sums_[best], after = sums_[best + 1] - sums_[best];
    const double curvature = before + after;
    return candidate(best) + (curvature < 0.0 ? 0.5 * (before - after) / curvature * candidate(1) : 0.0);
  }

 private:
  static constexpr double enough = 300.0;  // patches, of several frames

  std::array<double, count> sums_{};
  double weight_ = 0.0;
};

}  // namespace orbis::slam::detail
