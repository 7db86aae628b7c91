// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>

#include <orbis/core/simd/level.hpp>
#include <orbis/slam/detail/depth/surface.hpp>

#include "slam/detail/depth/planes.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::surface;
using slam::detail::surface_cell;

namespace {

surface surface_of(const image<float>& depth) {
  const auto rig = test::small_rig();
  slam::detail::surface_builder<camera::pinhole> builder;
  surface s;
  builder.build(rig.camera(), test::metres(depth), 1.0 / 400.0, 0.1, 10.0, s);
  return s;
}
std::size_t count(const surface& s) {
  return static_cast<std::size_t>(
      std::count_if(s.cells.begin(), s.cells.end(), [](const surface_cell& c) { return c.is_there(); }));
}

/// A lens with rays only up to a column.
struct half_lens {
  camera::pinhole inner;
  double last;  ///< pixels

  [[nodiscard]] int width() const { return inner.width(); }
  [[nodiscard]] int height() const { return inner.height(); }
  [[nodiscard]] std::optional<vec2> project(const vec3& p) const { return inner.project(p); }
  [[nodiscard]] std::optional<vec2> project(const vec3& p, matrix<2, 3>& jacobian) const {
    return inner.project(p, jacobian);
  }
  [[nodiscard]] std::optional<vec3> unproject(const vec2& pixel) const {
    return pixel.x() <= last ? inner.unproject(pixel) : std::nullopt;
  }
};

}  // namespace

TEST_CASE("The cells of a surface lie on the planes that a depth image shows, and know their directions") {
  const auto camera = test::small_rig().camera();
  const se3 pose(so3::exp(vec3(0.1, -0.2, 0.05)), vec3(0.1, 0.0, -0.2));
  const auto planes = test::corner();
  const surface s = surface_of(test::depth_of(planes, pose, camera));
  CHECK(s.step == 4);
  CHECK(s.columns == 80);
  CHECK(s.rows == 60);
  CHECK(count(s) > s.cells.size() * 7 / 10);
  std::size_t exact = 0;
  for (std::size_t i = 0; i != s.cells.size(); ++i) {
    const surface_cell& c = s.cells[i];
    if (!c.is_there()) continue;
    CHECK(std::abs(c.normal().norm() - 1.0) < 1e-5);
    CHECK(c.normal().dot(c.point()) < 0.0);  // towards the camera
    const vec3 p = pose * c.point(), n = pose.rotation() * c.normal();
    exact += std::any_of(planes.begin(), planes.end(), [&](const test::plane& q) {
      return std::abs(q.normal.dot(p) - q.distance) < 1e-4 && (q.normal + n).norm() < 1e-3 &&
             std::abs(c.measured - c.z) < 1e-4F;
    });
    const auto pixel = camera.project(c.point());
    REQUIRE(pixel);
    CHECK(s.at(*pixel) == &c);
    CHECK(std::abs(pixel->y() - s.pixel_row(i)) < 0.01);
  }
  CHECK(exact > count(s) * 9 / 10);  // the others lie across an edge
}

TEST_CASE("A surface has no cells where depth is missing or jumps or is out of range") {
  image<float> depth(320, 240);
  CHECK(count(surface_of(depth)) == 0);
  for (int v = 0; v != 240; ++v)
    for (int u = 0; u != 320; ++u) depth(u, v) = u < 162 ? 1.0F : 2.0F;
  const surface s = surface_of(depth);
  const auto row = [&](int column) { return s.cells[static_cast<std::size_t>(30 * 80 + column)]; };
  CHECK(row(39).is_there());
  CHECK(row(39).z == Catch::Approx(1.0));
  CHECK(!row(40).is_there());  // both sides
  CHECK(row(41).is_there());
  CHECK(row(41).z == Catch::Approx(2.0));
  CHECK(std::abs(row(41).nz + 1.0F) < 1e-4F);
  CHECK(s.at(vec2(-1.0, 3.0)) == nullptr);
  CHECK(s.at(vec2(320.0, 3.0)) == nullptr);
  for (int v = 0; v != 240; ++v)
    for (int u = 0; u != 320; ++u) depth(u, v) = 11.0F;
  CHECK(count(surface_of(depth)) == 0);
}

TEST_CASE("The cells are the same with every instruction set, also in the last columns") {
  const camera::pinhole camera{{332, 246, 262.5, 262.5, 165.5, 122.5}};  // 83 columns, no multiple of 8
  const se3 pose(so3::exp(vec3(0.1, -0.2, 0.05)), vec3(0.1, 0.0, -0.2));
  image<float> depth = test::depth_of(test::corner(), pose, camera);
  for (int v = 0; v != depth.height(); ++v)
    for (int u = 0; u != depth.width(); ++u) depth(u, v) *= (u * 7 + v * 13) % 11 == 0 ? 0.0F : 1.0F;
  surface expected;
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit(level);
    slam::detail::surface_builder<camera::pinhole> builder;
    surface s;
    builder.build(camera, test::metres(depth), 1.0 / 400.0, 0.1, 10.0, s);
    CHECK(s.columns == 83);
    std::size_t last = 0;
    for (int row = 0; row != s.rows; ++row) last += s.cells[static_cast<std::size_t>(row * 83 + 82)].is_there();
    CHECK(last > 40);
    if (expected.empty()) expected = s;
    CHECK(std::memcmp(s.cells.data(), expected.cells.data(), s.cells.size() * sizeof(surface_cell)) == 0);
  }
}

TEST_CASE("A cell at the edge of a lens needs no ray beyond its middle") {
  const auto camera = test::small_rig().camera();
  const image<float> depth = test::depth_of(test::wall(), se3{}, camera);
  const surface whole = surface_of(depth);
  surface half;
  slam::detail::surface_builder<half_lens> builder;
  builder.build(half_lens{camera, 161.7}, test::metres(depth), 1.0 / 400.0, 0.1, 10.0, half);
  const std::size_t last = 30 * 80 + 40;  // its middle is at column 161.5
  REQUIRE(half.cells[last].is_there());
  CHECK((half.cells[last].point() - whole.cells[last].point()).norm() < 1e-4);
  CHECK_FALSE(half.cells[last + 1].is_there());
}
