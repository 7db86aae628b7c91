// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;

namespace {

/// Deviation of the green channel along a line on the floor.
double contrast(const texture_set& textures, double footprint) {
  double sum = 0, squares = 0;
  constexpr int n = 1000;
  for (int i = 0; i != n; ++i) {
    const double v = (textures.sample(0, 4, 0.5 + 0.004 * i, 2.0, footprint) >> 8U) & 0xffU;
    sum += v;
    squares += v * v;
  }
  return std::sqrt(squares / n - sum * sum / n / n);
}

const scene& room() {
  static const scene s{{.furniture = false}, 1};
  return s;
}

}  // namespace

TEST_CASE("detail fades with the distance and never returns") {
  const texture_set textures{painted(room()), 0.01};
  double last = contrast(textures, 0.001);
  CHECK(last > 15.0);
  for (double footprint = 0.01; footprint < 10.0; footprint *= 2.0) {
    const double now = contrast(textures, footprint);
    CHECK(now < last + 1.0);
    last = now;
  }
  CHECK(last < 4.0);
}

TEST_CASE("sampling is smooth in place and in footprint") {
  const texture_set textures{painted(room()), 0.01};
  for (int i = 0; i != 2000; ++i) {
    const double u = 0.3 + 0.001 * i, footprint = 0.011 + 0.00002 * i;
    const auto at = [&](double du, double df) {
      return static_cast<int>(textures.sample(0, 4, u + du, 1.5, footprint + df) & 0xffU);
    };
    CHECK(std::abs(at(0, 0) - at(0.0001, 0)) < 8);
    CHECK(std::abs(at(0, 0) - at(0, 0.00002)) < 4);
  }
}

TEST_CASE("samples off the edge of a face are those at its edge") {
  const texture_set textures{painted(room()), 0.01};
  CHECK(textures.sample(0, 0, -0.5, -0.5, 0.001) == textures.sample(0, 0, 0.0, 0.0, 0.001));
  CHECK(textures.sample(0, 0, 100.0, 100.0, 0.001) == textures.sample(0, 0, 200.0, 90.0, 0.001));
}

TEST_CASE("textures do not depend on who sees them first") {
  const texture_set a{painted(room()), 0.02}, b{painted(room()), 0.02};
  constexpr std::size_t samples = 200;
  std::vector<std::uint32_t> seen(6 * samples);
  for_each_index(par.with(4), seen.size(), 1, [&](std::size_t i) {  // all faces at once, from several threads
    const auto face = static_cast<int>(i % 6);
    const auto n = static_cast<double>(i / 6);
    seen[i] = b.sample(0, face, 0.02 * n, 0.01 * n, 0.02);
  });
  for (std::size_t i = seen.size(); i-- > 0;) {
    const auto n = static_cast<double>(i / 6);
    CHECK(a.sample(0, static_cast<int>(i % 6), 0.02 * n, 0.01 * n, 0.02) == seen[i]);
  }
}
