// SPDX-License-Identifier: BSD-3-Clause
//
// Outliers in a room, and a look at the chain that was chosen against them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <orbis/cloud/filter_chain.hpp>
#include <orbis/core/random.hpp>

#include "cloud/clouds.hpp"

namespace orbis::test {

/// Uniform points in the box of a room seen by `room_cloud`.
inline void add_uniform(points& cloud, std::size_t n, std::uint64_t seed) {
  random_bits random{seed};
  for (std::size_t i = 0; i != n; ++i) {
    const double x = random.uniform(-1.4, 1.8);
    const double y = random.uniform(-1.1, 1.1);
    cloud.emplace_back(vec3{x, y, random.uniform(0.4, 3.3)}.cast<float>());
  }
}

inline bool has_step(const cloud::filter_chain& chain, cloud::filter_mode mode) {
  return std::any_of(chain.begin(), chain.end(), [&](const auto& step) { return step_mode(step) == mode; });
}

}  // namespace orbis::test
