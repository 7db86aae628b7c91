// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/detail/rays/ray_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::cloud::detail;

TEST_CASE("a view's pose keeps what float leaves of a large coordinate") {
  ray_view view;
  const se3 T{so3::exp(vec3{0.1, -0.2, 0.3}), vec3{1000.0001, -2.5, 3.0}};
  place(view, T);
  for (std::size_t a = 0; a != 3; ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    CHECK(std::abs(double{view.origin[a]} + double{view.origin_rest[a]} - T.translation()[row]) < 1e-8);
    for (std::size_t b = 0; b != 3; ++b)
      CHECK(view.rotation[a][b] == static_cast<float>(T.rotation_matrix()(static_cast<Eigen::Index>(b), row)));
  }
}

TEST_CASE("a view is asked about every block with a point that it may judge") {
  const camera::pinhole camera{64, 48, 50.0, 50.0, 31.5, 23.5};
  CHECK(*view_angle(camera) > std::atan2(32.0, 50.0));
  CHECK(*view_angle(camera) < 0.5 * std::numbers::pi);
  const image<float> wall(64, 48, 2.0F);
  depth_windows windows;
  windows.take(seq, camera::depth_view{wall}, 1);
  ray_view view;
  view.min_depth = 0.3F;
  view.max_depth = 5.0F;
  view.margin = 0.05F;
  const se3 T{so3::exp(vec3{0.0, 0.4, 0.0}), vec3{0.2, 0.1, -0.3}};
  place(view, T);
  block_test<camera::pinhole> test{camera};
  test.place(T, view, windows);

  random_bits random{11};
  std::size_t passed_over = 0;
  for (int i = 0; i != 4000; ++i) {
    point_blocks::box box;
    vec3 inside;
    for (std::size_t a = 0; a != 3; ++a) {
      box.low[a] = static_cast<float>(random.uniform(-4.0, 4.0));
      box.high[a] = box.low[a] + static_cast<float>(random.uniform(0.0, 0.5));
      inside[static_cast<Eigen::Index>(a)] = random.uniform(double{box.low[a]}, double{box.high[a]});
    }
    if (!test.says_nothing(box)) continue;
    ++passed_over;
    // Then the point is out of range or out of the image, or hidden behind the wall.
    const vec3 p = T.inverse() * inside;
    const bool in_range = p.z() > double{view.min_depth} && p.z() <= double{view.max_depth};
    const auto pixel = in_range ? camera.project(p) : std::nullopt;
    const bool seen = pixel && pixel->x() >= -0.5 && pixel->x() < 63.5 && pixel->y() >= -0.5 && pixel->y() < 47.5;
    CHECK((!seen || p.z() > 2.05));
  }
  CHECK(passed_over > 1000);
}
