// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/organised/pinhole_fit.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using octree::detail::float3;
using octree::detail::pinhole_fit;

namespace {

struct view {
  camera::pinhole camera;
  so3 rotation;
  float3 origin{};
  bool by_columns = false;
  int step = 1;            ///< from pixel to pixel that has a point
  double missing = 0.0;    ///< share of the pixels that have none, in holes
  double off_pixel = 0.0;  ///< how far rays are off, in pixels
};

[[nodiscard]] float3 point_at(const view& w, const vec3& ray, double z) {
  const vec3 p = w.rotation * vec3(ray * z);
  float3 at;
  for (std::size_t i = 0; i != 3; ++i)
    at[i] = static_cast<float>(static_cast<double>(w.origin[i]) + p[static_cast<int>(i)]);
  return at;
}

/// A wavy surface one to three metres away.
[[nodiscard]] std::vector<float3> points_of(random_bits& random, const view& w) {
  std::vector<float3> points;
  const int outer = w.by_columns ? w.camera.width() : w.camera.height();
  const int inner = w.by_columns ? w.camera.height() : w.camera.width();
  int hole = 0;
  for (int i = 0; i < outer; i += w.step)
    for (int k = 0; k < inner; k += w.step) {
      if (hole == 0 && random.uniform(0.0, 1.0) < w.missing / 15.0) hole = 30;
      if (hole > 0) {
        --hole;
        continue;
      }
      const vec2 pixel = w.by_columns ? vec2{i, k} : vec2{k, i};
      const vec2 off{random.uniform(-w.off_pixel, w.off_pixel), random.uniform(-w.off_pixel, w.off_pixel)};
      const double z = 2.0 + std::sin(0.02 * pixel.x()) * std::cos(0.03 * pixel.y());
      points.push_back(point_at(w, *w.camera.unproject(pixel + off), z));
    }
  return points;
}

[[nodiscard]] bool fit(pinhole_fit& f, const float3& origin, const std::vector<float3>& points, double limit = 10.0) {
  return f.fit(
      origin, points.size(), [&](std::size_t i) { return points[i]; }, limit);
}

/// The largest way from a point to the middle of a pixel, in pixels, and the share of the points outside the image.
struct distances {
  double worst = 0.0, outside = 0.0;
};
[[nodiscard]] distances distances_of(const pinhole_fit& f, const float3& origin, const std::vector<float3>& points) {
  distances all;
  for (const float3& p : points) {
    vec3 d;
    for (std::size_t i = 0; i != 3; ++i)
      d[static_cast<int>(i)] = static_cast<double>(p[i]) - static_cast<double>(origin[i]);
    const auto pixel = f.camera().project(f.rotation().inverse() * d);
    if (!pixel) return {std::numeric_limits<double>::infinity(), 1.0};
    for (int i = 0; i != 2; ++i) all.worst = std::max(all.worst, std::fabs((*pixel)[i] - std::round((*pixel)[i])));
    if (pixel->x() < -0.5 || pixel->x() > f.camera().width() - 0.5 || pixel->y() < -0.5 ||
        pixel->y() > f.camera().height() - 0.5)
      all.outside += 1.0 / static_cast<double>(points.size());
  }
  return all;
}

[[nodiscard]] view random_view(random_bits& random) {
  const auto at = [&](double half) { return random.uniform(-half, half); };
  const int width = 160 + static_cast<int>(random.below(500)), height = 120 + static_cast<int>(random.below(400));
  const double fx = width * random.uniform(0.5, 3.0), fy = fx * random.uniform(0.7, 1.4);
  view w{camera::pinhole{width, height, fx, fy, width * random.uniform(0.3, 0.7), height * random.uniform(0.3, 0.7)},
         so3::exp({at(2.0), at(2.0), at(2.0)})};
  for (float& c : w.origin) c = static_cast<float>(at(3.0));
  return w;
}

}  // namespace

TEST_CASE("The camera of an organised cloud is found from its points") {
  random_bits random{31};
  pinhole_fit f;
  for (int run = 0; run != 60; ++run) {
    view w = random_view(random);
    w.by_columns = run % 3 == 0;
    w.missing = run % 4 == 0 ? 0.4 : 0.0;
    w.step = run % 5 == 0 ? 2 : 1;
    const std::vector<float3> points = points_of(random, w);
    INFO("run " << run << ": " << points.size() << " points");
    REQUIRE(fit(f, w.origin, points));
    const auto& k = f.camera().k();
    const distances d = distances_of(f, w.origin, points);
    CHECK(d.worst <= f.error() * std::max(k.fx, k.fy));
    CHECK(d.outside < 0.002);
    CHECK(f.mean_z() == Approx(2.0).margin(0.3));
    // The image lies as the camera's or along its columns, and may be upside down.
    const double want = w.camera.k().fx / w.step, other = w.camera.k().fy / w.step;
    const auto same = [](double a, double b) { return std::fabs(a - b) < 1e-3 * b; };
    CHECK(((same(k.fx, want) && same(k.fy, other)) || (same(k.fx, other) && same(k.fy, want))));
    const vec3 z = f.rotation() * vec3::UnitZ(), want_z = w.rotation * vec3::UnitZ();
    CHECK((z - want_z).norm() < 1e-3);
  }
}

TEST_CASE("A camera is found although some points are missing, invalid, cut off or somewhere else") {
  random_bits random{32};
  pinhole_fit f;
  const view w = random_view(random);
  const std::vector<float3> all = points_of(random, w);
  std::vector<float3> points = all;
  for (std::size_t i = 0; i < points.size(); i += 1 + random.below(60))
    points[i][1] = std::numeric_limits<float>::quiet_NaN();
  CHECK(fit(f, w.origin, points));
  CHECK(fit(f, w.origin, all, 1.5));
  points = all;
  for (std::size_t i = 0; i < points.size(); i += 1 + random.below(400)) points[i] = {1.0F, 2.0F, 3.0F};
  CHECK(fit(f, w.origin, points));
}

TEST_CASE("Other clouds are no images of a pinhole camera") {
  random_bits random{33};
  pinhole_fit f;
  view w = random_view(random);
  SECTION("random points") {
    std::vector<float3> points(50000);
    for (float3& p : points)
      for (float& c : p) c = static_cast<float>(random.uniform(-2.0, 2.0));
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("rays a twentieth of a pixel off") {
    w.off_pixel = 0.05;
    CHECK_FALSE(fit(f, w.origin, points_of(random, w)));
  }
  SECTION("another origin") {
    const std::vector<float3> points = points_of(random, w);
    w.origin[0] += 0.01F;
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("points in any order") {
    std::vector<float3> points = points_of(random, w);
    for (std::size_t i = points.size(); i > 1; --i)
      std::swap(points[i - 1], points[random.below(static_cast<std::uint32_t>(i))]);
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("the rings of a laser scanner") {
    std::vector<float3> points;
    for (int ring = 0; ring != 64; ++ring)
      for (int i = 0; i != 1024; ++i) {
        const double up = 0.01 * (ring - 32), turn = 0.00613 * i;
        const vec3 d{std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn), std::sin(up)};
        points.push_back(point_at(w, d, 4.0));
      }
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("a lens with distortion") {
    const camera::radial_tangential lens{w.camera.k(), {.k1 = 0.05, .k2 = -0.01, .p1 = 0.001, .p2 = 0.0, .k3 = 0.0}};
    std::vector<float3> points;
    for (int v = 0; v != w.camera.height(); ++v)
      for (int u = 0; u != w.camera.width(); ++u)
        if (const auto ray = lens.unproject(vec2{u, v})) points.push_back(point_at(w, *ray, 2.0));
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("a second image between the pixels of the first one") {
    std::vector<float3> points = points_of(random, w);
    const auto& k = w.camera.k();
    w.camera = camera::pinhole{k.width, k.height, k.fx, k.fy, k.cx + 0.3, k.cy};
    const std::vector<float3> more = points_of(random, w);
    points.insert(points.end(), more.begin(), more.end());
    CHECK_FALSE(fit(f, w.origin, points));
  }
  SECTION("one place, one row, few points, none") {
    CHECK_FALSE(fit(f, w.origin, std::vector<float3>(5000, float3{1.0F, 2.0F, 3.0F})));
    CHECK_FALSE(fit(f, w.origin, std::vector<float3>(5000, w.origin)));
    std::vector<float3> points;
    for (int u = 0; u != 5000; ++u) points.push_back(point_at(w, {1e-4 * u, 0.1, 1.0}, 2.0));
    CHECK_FALSE(fit(f, w.origin, points));
    points.resize(20);
    CHECK_FALSE(fit(f, w.origin, points));
    CHECK_FALSE(fit(f, w.origin, {}));
    CHECK_FALSE(
        fit(f, w.origin, std::vector<float3>(5000, float3{std::numeric_limits<float>::quiet_NaN(), 0.0F, 1.0F})));
  }
}

TEST_CASE("A second camera takes no memory") {
  random_bits random{34};
  pinhole_fit f;
  view w = random_view(random);
  const std::vector<float3> points = points_of(random, w);
  CHECK(fit(f, w.origin, points));
  w.rotation = so3::exp({0.1, 0.2, 0.3});
  const std::vector<float3> more = points_of(random, w);
  const std::size_t bytes = f.memory_bytes(), before = test::allocations();
  const bool fits = fit(f, w.origin, more);
  if (test::counts_allocations()) CHECK(test::allocations() == before);
  CHECK(fits);
  CHECK(f.memory_bytes() == bytes);
}
