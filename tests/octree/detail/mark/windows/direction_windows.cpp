// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/mark/windows/direction_windows.hpp>

#include "support/catch.hpp"

using namespace orbis;
using octree::detail::direction_window;
using octree::detail::direction_windows;

namespace {

/// Directions of a camera's pixels, or all around.
[[nodiscard]] std::vector<vec3> directions(random_bits& random, bool all_around) {
  const so3 turned = so3::exp({random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)});
  std::vector<vec3> all;
  while (all.size() != 1000) {
    vec3 d{random.uniform(-0.6, 0.6), random.uniform(-0.4, 0.4), 1.0};
    if (all_around) d = vec3{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    if (d.norm() > 0.1) all.push_back(turned * d.normalized());
  }
  return all;
}

[[nodiscard]] vec3 axis(const direction_window& w, std::size_t i) {
  return vec3f{w.axes[i][0], w.axes[i][1], w.axes[i][2]}.cast<double>();
}

/// Whether a direction lies in a window.
[[nodiscard]] bool contains(const direction_window& w, float cell, const vec3& d) {
  const double z = axis(w, 2).dot(d), x = axis(w, 0).dot(d) / z, y = axis(w, 1).dot(d) / z;
  const auto within = [&](double at, float low, std::int32_t cells) {
    const double from = (at - static_cast<double>(low)) / static_cast<double>(cell);
    return from > -1e-3 && from < cells + 1e-3;
  };
  return w.width != 0 && z > 0.0 && within(x, w.min_x, w.width) && within(y, w.min_y, w.height);
}

}  // namespace

TEST_CASE("The rays of a camera lie in one window, which is not much larger than its image") {
  random_bits random{41};
  for (int run = 0; run != 20; ++run) {
    const auto sample = directions(random, false);
    direction_windows windows;
    windows.fit({sample, 1.0}, 100000, 0.01, 0.0, 1e9);
    std::size_t used = 0;
    for (const direction_window& w : windows.window) {
      if (w.width == 0) continue;
      ++used;
      CHECK(w.width >= w.height);
      for (const vec3& d : sample) REQUIRE(contains(w, windows.cell, d));
      CHECK(w.width * w.height < 1.3 * 120 * 80);
    }
    CHECK(used == 1);
    CHECK(windows.cell == Approx(0.01));
    CHECK(windows.spacing == Approx(std::sqrt(1.2 * 0.8 / 100000)).epsilon(0.2));
  }
}

TEST_CASE("Rays all around lie in six windows, each ray in one") {
  random_bits random{42};
  const auto sample = directions(random, true);
  direction_windows windows;
  windows.fit({sample, 1.0}, 100000, 0.01, 2.0, 16.0);
  std::uint32_t cells = 0;
  for (const direction_window& w : windows.window) {
    CHECK(w.begin == cells);
    CHECK(w.width > 0);
    CHECK(w.stride >= w.width + direction_window::padding);
    cells += static_cast<std::uint32_t>(w.stride * w.height) + direction_window::padding;
    CHECK(axis(w, 0).cross(axis(w, 1)).cross(axis(w, 2)).norm() < 1e-6);
  }
  CHECK(windows.cells == cells);
  for (const vec3& d : sample) {
    bool found = false;
    for (const direction_window& w : windows.window) found = found || contains(w, windows.cell, d);
    CHECK(found);
  }
}

TEST_CASE("However many rays there are, or however close together, there are not too many cells") {
  random_bits random{43};
  auto sample = directions(random, false);
  direction_windows windows;
  const auto check = [&] {
    windows.fit({sample, 1.0}, 1U << 24U, 0.0, 2.0, 16.0);
    CHECK(windows.cells < direction_windows::most_cells);
    CHECK(windows.cell >= 1e-4F);
    // Cells hold as many rays as wanted, or more.
    CHECK(static_cast<double>(windows.cell) > 1.4 * windows.spacing);
  };
  check();
  for (vec3& d : sample) d = sample[0];
  check();
  for (vec3& d : sample) d = vec3{d.x() + random.uniform(-1.0, 1.0), 0.0, 1.0}.normalized();  // a fan
  check();
}

TEST_CASE("The axes of windows are at right angles however the rays go") {
  random_bits random{44};
  direction_windows windows;
  for (const double spread : {0.0, 1e-17, 1e-16, 1e-15, 1e-12, 1e-8, 1e-4, 1.0})
    for (int run = 0; run != 50; ++run) {
      const auto at = [&](double half) { return random.uniform(-half, half); };
      const vec3 way = run == 0   ? vec3{1.0, 1.0, 1.0}
                       : run == 1 ? vec3{0.0, 0.0, -1.0}
                       : run == 2 ? vec3{1.0, 1.0, 0.0}
                                  : vec3{at(1.0), at(1.0), at(1.0)};
      std::vector<vec3> sample;
      for (int i = 0; i != 1000; ++i)
        sample.push_back((way.normalized() + vec3{at(spread), at(spread), at(spread)}).normalized());
      windows.fit({sample, 1.0}, 100000, 0.01, 2.0, 16.0);
      for (const direction_window& w : windows.window)
        for (std::size_t i = 0; i != 3; ++i) {
          REQUIRE(axis(w, i).norm() == Approx(1.0));
          REQUIRE(std::abs(axis(w, i).dot(axis(w, (i + 1) % 3))) < 1e-6);
        }
    }
}
