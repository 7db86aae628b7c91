// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Graduated non-convexity: a loss that starts wide, where the cost has one minimum, and narrows from
/// stage to stage while the estimate follows.
///
/// Sources: A. Blake, A. Zisserman, "Visual Reconstruction", MIT Press 1987; H. Yang, P. Antonante,
/// V. Tzoumas, L. Carlone, "Graduated non-convexity for robust spatial perception: from non-minimal
/// solvers to global outlier rejection", RA-L 5(2), 2020.
#pragma once

#include <cmath>
#include <concepts>

#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize {

/// A loss that a width sets.
template <class L>
concept scalable_loss = robust_loss<L> && requires(L& loss) {
  { loss.width } -> std::same_as<double&>;
};

/// Losses for the stages of a solution, `s.stages()` of them, at least one; beyond the last, `s.stage(k)`
/// is the last.
template <class S>
concept loss_schedule = std::copyable<S> && requires(const S& s, int k) {
  { s.stages() } -> std::convertible_to<int>;
  { s.stage(k) } -> robust_loss;
};

/// What solvers take: a loss, or a schedule of them.
template <class L>
concept loss_or_schedule = robust_loss<L> || loss_schedule<L>;

/// `last` with its width multiplied by `start`, then by less and less of it, down to itself.
template <scalable_loss Loss>
struct graduated {
  Loss last{};
  double start = 16.0;  ///< factor on the first width, at least 1; infinite is not allowed
  double shrink = 0.5;  ///< of the factor, from stage to stage; in (0, 1)

  [[nodiscard]] int stages() const noexcept {
    if (!(start > 1.0) || !std::isfinite(start) || !(shrink > 0.0 && shrink < 1.0)) return 1;
    return 1 + static_cast<int>(std::ceil(std::log(start) / -std::log(shrink) - 1e-9));
  }
  [[nodiscard]] Loss stage(int k) const noexcept {
    Loss loss = last;
    if (k + 1 < stages()) loss.width *= start * std::pow(shrink, k);
    return loss;
  }
};
template <class Loss>
graduated(Loss) -> graduated<Loss>;
template <class Loss>
graduated(Loss, double) -> graduated<Loss>;
template <class Loss>
graduated(Loss, double, double) -> graduated<Loss>;

/// How many stages a loss has, and which loss a stage uses; those of a loss that is none is itself.
template <loss_or_schedule L>
[[nodiscard]] int stages_of(const L& loss) {
  if constexpr (loss_schedule<L>)
    return loss.stages();
  else
    return 1;
}
template <loss_or_schedule L>
[[nodiscard]] auto stage_of(const L& loss, int k) {
  if constexpr (loss_schedule<L>)
    return loss.stage(k);
  else
    return loss;
}

static_assert(loss_schedule<graduated<truncated>> && !robust_loss<graduated<truncated>>);

}  // namespace orbis::optimize
