// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/view_samples.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

#include "cloud/views.hpp"
#include "support/catch.hpp"

using orbis::cloud::view_samples;

TEST_CASE("samples of a view lie on a grid over its image and know their tile") {
  const orbis::camera::pinhole camera{{.width = 80, .height = 60, .fx = 70, .fy = 70, .cx = 39.5, .cy = 29.5}};
  orbis::image<float> depth(80, 60, 2.0F);
  depth(42, 31) = 1.0F;  // a stray pixel, of the grid: 80 / 20 and 60 / 20 pixels apart
  depth(2, 1) = 0.0F;
  depth(6, 1) = std::numeric_limits<float>::quiet_NaN();
  const orbis::test::view view{orbis::camera::depth_view<float>(depth),
                               orbis::se3{orbis::so3{}, orbis::vec3{0.5, 0, 1}}};
  auto lost = view;
  lost.T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{0, std::numeric_limits<double>::infinity(), 0}};
  view_samples samples;
  samples.add(camera, view);
  REQUIRE(samples.points().size() == 400 - 3);
  REQUIRE(samples.tiles_by_point().size() == 400 - 3);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i != samples.points().size(); ++i) {
    const orbis::vec3 seen = samples.points()[i].cast<double>() - orbis::vec3{0.5, 0, 1};
    const auto pixel = camera.project(seen);
    REQUIRE(pixel);
    const auto tile = static_cast<std::uint32_t>(pixel->y() / 15) * 4 + static_cast<std::uint32_t>(pixel->x() / 20);
    wrong += seen.z() != 2.0 || samples.tiles_by_point()[i] != tile ? 1 : 0;
  }
  CHECK(wrong == 0);

  // Views without samples are counted.
  samples.add(camera, lost);
  samples.skip();
  CHECK(samples.views() == 3);
  CHECK(samples.points().size() == 400 - 3);
  samples.add(camera, view);
  CHECK(samples.views() == 4);
  CHECK(samples.points().size() == 2 * (400 - 3));
  CHECK(samples.tiles_by_point()[400 - 3] == 3 * 16 + samples.tiles_by_point()[0]);
}

TEST_CASE("samples of a view may be more than its pixels") {
  const orbis::camera::pinhole camera{{.width = 7, .height = 5, .fx = 7, .fy = 7, .cx = 3, .cy = 2}};
  const orbis::image<float> depth(7, 5, 2.0F);
  const orbis::test::view view{orbis::camera::depth_view<float>(depth), orbis::se3{}};
  for (const int across : {1, 3, 20}) {
    view_samples samples{{}, across};
    samples.add(camera, view);
    CHECK(samples.points().size() == static_cast<std::size_t>(across * across));
    CHECK(*std::max_element(samples.tiles_by_point().begin(), samples.tiles_by_point().end()) < 16);
  }
}
