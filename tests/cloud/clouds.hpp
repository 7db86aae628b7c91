// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The clouds that filters are tested on.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>

namespace orbis::test {

using points = std::vector<vec3f>;

inline points uniform_cloud(std::size_t n, std::uint64_t seed, double side = 1.0, double offset = 0.0) {
  random_bits random{seed};
  points out;
  for (std::size_t i = 0; i != n; ++i) {
    const double x = random.uniform();
    const double y = random.uniform();
    const double z = random.uniform();
    out.emplace_back((vec3{x, y, z} * side + vec3::Constant(offset)).cast<float>());
  }
  return out;
}

/// Points on a floor and two walls as a depth camera at the origin sees them: sparser and noisier
/// with range. `noise` is sigma at 1 m, metres.
inline points room_cloud(int width, int height, double noise, std::uint64_t seed) {
  random_bits random{seed};
  points out;
  for (int v = 0; v != height; ++v) {
    for (int u = 0; u != width; ++u) {
      const vec3 ray{(u - 0.5 * width) / (0.82 * width), (v - 0.5 * height) / (0.82 * width), 1.0};
      double z = 3.5;                                    // the wall ahead
      if (ray.y() > 0) z = std::min(z, 1.2 / ray.y());   // the floor
      if (ray.x() < 0) z = std::min(z, -1.5 / ray.x());  // the wall to the left
      z += noise * z * z * random.normal();
      out.emplace_back((ray * z).cast<float>());
    }
  }
  return out;
}

/// Every kind of cloud that a filter must take, by name.
inline std::vector<std::pair<std::string, points>> all_clouds() {
  std::vector<std::pair<std::string, points>> out;
  out.emplace_back("empty", points{});
  for (const std::size_t n : {1U, 2U, 3U, 10U, 11U, 12U, 50U, 51U, 52U}) {
    out.emplace_back("tiny " + std::to_string(n), uniform_cloud(n, 100 + n));
  }
  out.emplace_back("uniform", uniform_cloud(800, 1));
  out.emplace_back("room", room_cloud(32, 24, 0.002, 2));
  out.emplace_back("huge coordinates", uniform_cloud(500, 3, 50.0, 1e6));
  out.emplace_back("tiny extent", uniform_cloud(500, 4, 1e-20));

  points identical(400, vec3f{0.1F, -0.2F, 3.0F});
  out.emplace_back("identical", identical);
  identical.emplace_back(1.0F, 1.0F, 1.0F);
  out.emplace_back("identical and one", identical);

  random_bits random{5};
  points duplicates;
  const points some = uniform_cloud(200, 6);
  for (int i = 0; i != 800; ++i) duplicates.push_back(some[random.below(200)]);
  out.emplace_back("duplicates", duplicates);

  points grid;
  for (int x = 0; x != 9; ++x)
    for (int y = 0; y != 9; ++y)
      for (int z = 0; z != 9; ++z) grid.emplace_back(vec3{0.1 * x, 0.1 * y, 0.1 * z}.cast<float>());
  out.emplace_back("grid", grid);

  points plane = uniform_cloud(600, 7);
  for (vec3f& p : plane) p.z() = 0.25F;
  out.emplace_back("plane", plane);
  points line = uniform_cloud(500, 8);
  for (vec3f& p : line) p = vec3f{1.0F, 2.0F, 3.0F} * p.x();
  out.emplace_back("line", line);

  points clusters;
  for (int c = 0; c != 6; ++c) {
    const points cluster = uniform_cloud(20U << c, 9 + static_cast<std::uint64_t>(c), 0.01 * (c + 1), 2.0 * c);
    clusters.insert(clusters.end(), cluster.begin(), cluster.end());
  }
  out.emplace_back("clusters", clusters);

  points holes = uniform_cloud(700, 20);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < holes.size(); i += 3) holes[i].x() = nan;
  for (std::size_t i = 1; i < holes.size(); i += 31) holes[i].z() = i % 2 == 0 ? inf : -inf;
  out.emplace_back("not all finite", holes);
  out.emplace_back("none finite", points(60, vec3f{nan, 0.0F, 0.0F}));

  points far = uniform_cloud(600, 21);
  far.emplace_back(1e5F, -1e5F, 1e5F);
  out.emplace_back("one far away", far);
  return out;
}

/// Clouds that are hard on guesses: density that leaps, ties, magnitudes from one end to the other.
inline std::vector<std::pair<std::string, points>> hard_clouds() {
  std::vector<std::pair<std::string, points>> out;
  random_bits random{11};
  points nested;  // clusters within clusters
  for (int i = 0; i != 900; ++i) {
    const double scale = std::pow(2.0, -0.1 * i);
    nested.emplace_back((vec3{random.uniform(), random.uniform(), random.uniform()} * scale).cast<float>());
  }
  out.push_back({"nested", nested});

  points mixed = uniform_cloud(700, 12, 0.01);  // dense and thin, alternating along the curve
  const points thin = uniform_cloud(150, 13, 1.0);
  mixed.insert(mixed.end(), thin.begin(), thin.end());
  out.push_back({"dense within thin", mixed});

  points shell;  // all at almost the same distance from the one in the middle
  for (int i = 0; i != 800; ++i) {
    const vec3 v{random.normal(), random.normal(), random.normal()};
    shell.emplace_back(v.normalized().cast<float>());
  }
  shell.emplace_back(0.0F, 0.0F, 0.0F);
  out.push_back({"shell", shell});

  points copies;  // many copies of few points, and few copies of many
  for (int i = 0; i != 6; ++i) {
    const vec3f p{0.1F * static_cast<float>(i), 0.0F, 0.0F};
    copies.insert(copies.end(), 120, p);
    copies.push_back(p + vec3f{1e-3F, 0.0F, 0.0F});
  }
  out.push_back({"copies", copies});

  points line;
  for (int i = 0; i != 600; ++i) line.emplace_back(static_cast<float>(i), 0.0F, 0.0F);
  out.push_back({"even line", line});

  points huge;  // squares overflow between, but not within clusters
  for (int c = 0; c != 4; ++c) {
    const points cluster = uniform_cloud(30, 14 + static_cast<std::uint64_t>(c), 1e17);
    for (const vec3f& p : cluster) huge.push_back(p + vec3f{1e20F * static_cast<float>(c), 0.0F, 0.0F});
  }
  huge.emplace_back(3e38F, -3e38F, 3e38F);
  out.push_back({"overflowing", huge});
  return out;
}

}  // namespace orbis::test
