// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Robust losses for eight residuals at a time.
#pragma once

#include <array>
#include <cstddef>

#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis::optimize::detail {

/// `lanes_of_loss<Loss>::weigh(loss, s, cost, weight)` computes rho(s) and its derivative, up to rounding, for finite s
/// >= 0. Losses without a specialisation are evaluated lane by lane.
template <robust_loss Loss>
struct lanes_of_loss {
  template <camera::double_lanes L>
  static ORBIS_ALWAYS_INLINE void weigh(const Loss& loss, const L& squared, L& cost, L& weight) {
    values s, c, w;
    squared.store(s.data());
    weigh_each(loss, s, c, w);
    cost = L::load(c.data());
    weight = L::load(w.data());
  }

 private:
  using values = std::array<double, 8>;
  /// Not inlined, because the kernels are compiled for instruction sets that might round differently.
  [[gnu::noinline]] static void weigh_each(const Loss& loss, const values& squared, values& cost, values& weight) {
    for (std::size_t i = 0; i != squared.size(); ++i) {
      cost[i] = loss.cost(squared[i]);
      weight[i] = loss.weight(squared[i]);
    }
  }
};

template <>
struct lanes_of_loss<trivial> {
  template <camera::double_lanes L>
  static ORBIS_ALWAYS_INLINE void weigh(const trivial&, const L& squared, L& cost, L& weight) {
    cost = squared;
    weight = 1.0;
  }
};

template <>
struct lanes_of_loss<huber> {
  template <camera::double_lanes L>
  static ORBIS_ALWAYS_INLINE void weigh(const huber& loss, const L& squared, L& cost, L& weight) {
    const double bound = loss.width * loss.width;
    const auto inside = squared <= L(bound);
    if (all(inside)) {  // the common case: no square root, no division
      cost = squared;
      weight = 1.0;
      return;
    }
    const L pull = loss.width * simd::reciprocal_root(select(inside, L(1.0), squared));
    cost = select(inside, squared, 2.0 * (squared * pull) - bound);
    weight = select(inside, L(1.0), pull);
  }
};

template <>
struct lanes_of_loss<tukey> {
  template <camera::double_lanes L>
  static ORBIS_ALWAYS_INLINE void weigh(const tukey& loss, const L& squared, L& cost, L& weight) {
    const double bound = loss.width * loss.width;
    const L rest = select(squared < L(bound), 1.0 - squared * (1.0 / bound), L(0.0));
    weight = rest * rest;
    cost = (bound / 3.0) * (1.0 - weight * rest);
  }
};

}  // namespace orbis::optimize::detail
