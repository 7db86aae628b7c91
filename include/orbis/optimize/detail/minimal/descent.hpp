// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Gauss-Newton for models with few unknowns.
#pragma once

#include <cmath>
#include <optional>
#include <utility>

namespace orbis::optimize::detail {

/// Takes at most `steps` steps from `state`. `sum_up(state)` returns the normal equations at a state, with the sum of
/// squares as their `cost`; `step(state, equations)` returns the next state, or empty if there is none. Stops when a
/// step does not reduce the cost by more than the rounding error. Returns empty if the initial cost is not finite.
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
