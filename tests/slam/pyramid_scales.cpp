// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/slam/pyramid_scales.hpp>

#include "support/catch.hpp"

using orbis::slam::pyramid_scales;

TEST_CASE("The scale of a level is a power of the factor, in the table and beyond") {
  const pyramid_scales scales(20, 1.3);
  CHECK(scales.levels() == 20);
  for (const int octave : {0, 1, 7, 15, 16, 19, -1}) {
    CHECK(scales.scale(octave) == std::pow(1.3, octave));
    CHECK(scales.information(octave) == 1.0 / (scales.scale(octave) * scales.scale(octave)));
  }
}
