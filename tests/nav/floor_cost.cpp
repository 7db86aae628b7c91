// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/nav/floor_cost.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::floor_state;

namespace {

nav::floor_map random_floor(random_bits& random, int width, int height, int one_in) {
  nav::floor_map floor;
  floor.resolution = 0.05;
  floor.states = image<floor_state>(width, height, floor_state::free);
  for (floor_state& s : floor.states.pixels()) {
    if (random.below(10) == 0) s = floor_state::unknown;
    if (one_in != 0 && random.below(static_cast<std::uint32_t>(one_in)) == 0) s = floor_state::occupied;
  }
  return floor;
}
/// Over all pairs; below 0 if nothing is occupied.
double squared_distance(const nav::floor_map& floor, int x, int y) {
  double best = -1.0;
  for (int v = 0; v != floor.states.height(); ++v)
    for (int u = 0; u != floor.states.width(); ++u)
      if (const double d = (u - x) * (u - x) + (v - y) * (v - y);
          floor.states(u, v) == floor_state::occupied && (best < 0.0 || d < best))
        best = d;
  return best;
}

}  // namespace

TEST_CASE("Distances on the floor are those of all pairs, and costs follow from them") {
  random_bits random{1};
  for (const int one_in : {0, 3, 20, 200, 1000}) {
    CAPTURE(one_in);
    const nav::floor_map floor = random_floor(random, 61, 37, one_in);
    const image<float> squared = nav::squared_floor_distances(floor.states);
    const nav::inflation_options options{.radius = 0.15, .inflation_radius = 0.4, .cost_scaling = 5.0};
    const image<std::uint8_t> costs = nav::inflate(floor, options);
    std::size_t wrong = 0;
    for (int y = 0; y != 37; ++y)
      for (int x = 0; x != 61; ++x) {
        const double truth = squared_distance(floor, x, y);
        if (truth < 0.0) {
          wrong += squared(x, y) > 1e9F ? 0U : 1U;
        } else {
          wrong += static_cast<double>(squared(x, y)) == truth ? 0U : 1U;
        }
        const double d = truth < 0.0 ? 1e9 : 0.05 * std::sqrt(truth);
        const bool is_unknown = floor.states(x, y) == floor_state::unknown;
        const int expected = truth == 0.0                   ? 254
                             : truth > 0.0 && truth <= 9.0  ? 253  // three cells
                             : is_unknown                   ? 255
                             : truth > 0.0 && truth <= 64.0 ? static_cast<int>(252 * std::exp(-5.0 * (d - 0.15)))
                                                            : 0;
        wrong += costs(x, y) == expected ? 0U : 1U;
      }
    CHECK(wrong == 0);
  }
}

TEST_CASE("A road of sixty thousand cells has the costs of its ends") {
  nav::floor_map floor;
  floor.resolution = 0.05;
  floor.states = image<floor_state>(1, 60000, floor_state::free);
  floor.states(0, 100) = floor.states(0, 59000) = floor_state::occupied;
  const image<float> squared = nav::squared_floor_distances(floor.states);
  const auto costs = nav::inflate(floor, {.radius = 0.05, .inflation_radius = 0.05});
  for (const int y : {100, 59000})
    for (const int beside : {-1, 1}) {
      CHECK(squared(0, y + beside) == 1.0F);
      CHECK(costs(0, y + beside) == nav::floor_cost::inscribed);
    }
  CHECK(squared(0, 29550) == 29450.0F * 29450.0F);
  CHECK(costs(0, 29550) == nav::floor_cost::free_space);
}

TEST_CASE("A floor of one cell, and one of none") {
  nav::floor_map floor;
  CHECK(nav::inflate(floor).empty());
  floor.resolution = 0.1;
  floor.states = image<floor_state>(1, 1, floor_state::occupied);
  CHECK(nav::inflate(floor)(0, 0) == nav::floor_cost::lethal);
  floor.states(0, 0) = floor_state::unknown;
  CHECK(nav::inflate(floor)(0, 0) == nav::floor_cost::no_information);
}
