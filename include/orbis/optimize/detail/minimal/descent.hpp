// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gauss and Newton's steps for the few unknowns of a minimal model, as long as each is an improvement.
#pragma once

#include <cmath>
#include <optional>
#include <utility>

namespace orbis::optimize::detail {

/// From `state`, at most `steps` of them: `sum_up(state)` gives equations with a `cost`, the sum of squares there;
/// `step(state, equations)` an `optional` state one step on, empty where there is none. Ends where the cost does not
/// fall, or by no more than rounding. Empty where it is not finite at the start.
template <class State, class SumUp, class Step>
[[nodiscard]] std::optional<State> descend(State state, int steps, const SumUp& sum_up, const Step& step) {
  auto here = sum_up(state);
  if (!std::isfinite(here.cost)) return std::nullopt;
  for (int k = 0; k != steps; ++k) {
    const std::optional<State> next = step(state, here);
    if (!next) break;
    auto there = sum_up(*next);
    if (!(there.cost < here.cost)) break;
    const bool small = here.cost - there.cost <= 1e-12 * here.cost;
    state = *next;
    here = std::move(there);
    if (small) break;
  }
  return state;
}

}  // namespace orbis::optimize::detail
