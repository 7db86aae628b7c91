// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <vector>

#include <orbis/slam/detail/depth/surface_samples.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

/// A grid whose cells all look along the axis, but for the first `aside` ones.
surface grid(std::size_t aside) {
  surface s{4, 40, 30, std::vector<surface_cell>(1200)};
  for (std::size_t i = 0; i != s.cells.size(); ++i) {
    surface_cell& c = s.cells[i];
    c = {static_cast<float>(i), 0.0F, 2.0F, 0.0F, 0.0F, -1.0F, 2.0F};
    if (i < aside) c.nx = 0.8F, c.nz = -0.6F;
  }
  return s;
}

}  // namespace

TEST_CASE("Samples are spread over the directions of a surface: what is rare is all taken") {
  surface_sampler sampler;
  std::vector<surface_sample> samples;
  sampler.choose(grid(30), 200, samples);
  CHECK(samples.size() == 200);
  std::size_t aside = 0;
  for (const surface_sample& s : samples) aside += s.normal.x() > 0.5;
  CHECK(aside == 30);
  sampler.choose(grid(600), 200, samples);
  CHECK(samples.size() == 200);
  aside = 0;
  for (const surface_sample& s : samples) aside += s.normal.x() > 0.5;
  CHECK(aside == 100);
}

TEST_CASE("Samples are spread over the image, and are no more than there are") {
  surface_sampler sampler;
  std::vector<surface_sample> samples;
  sampler.choose(grid(0), 12, samples);
  REQUIRE(samples.size() == 12);
  for (std::size_t i = 0; i != 12; ++i) {
    CHECK(samples[i].point.x() == 50.0 + 100.0 * static_cast<double>(i));
    CHECK(samples[i].row == Catch::Approx((std::floor(samples[i].point.x() / 40.0) + 0.5) * 4.0 - 0.5));
  }
  sampler.choose(grid(0), 5000, samples);
  CHECK(samples.size() == 1200);
  sampler.choose(surface{}, 100, samples);
  CHECK(samples.empty());
}
