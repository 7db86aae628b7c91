// SPDX-License-Identifier: BSD-3-Clause
#include "camera_check.hpp"

#include <vector>

#include "support/catch.hpp"

using orbis::slam::calibrated_parameter;

TEST_CASE("A lens has distortion where it is determined and explains the images two percent better") {
  app::lens_comparison lens{
      .pinhole_focal = 547.2, .lens_focal = 525.9, .pinhole_rms = 0.223, .lens_rms = 0.215, .is_determined = true};
  CHECK(lens.has_distortion());
  CHECK(
      app::describe(lens) ==
      "a lens with distortion fits the images better (error 0.215 instead of 0.223 standard deviations), with a focal "
      "length of 526 instead of 547 pixels: see --distortion");
  lens.is_determined = false;
  CHECK_FALSE(lens.has_distortion());
  CHECK(app::describe(lens).starts_with("the motion does not determine whether the lens has distortion"));
  lens.is_determined = true;
  lens.lens_rms = 0.221;
  CHECK_FALSE(lens.has_distortion());
}

TEST_CASE("Another focal length is one that has changed by more than its deviation, whatever was held") {
  std::vector<calibrated_parameter> found{{"fx", 525.0, 547.0, 0.8, false}, {"cx", 320.0, 320.0, 0.0, true}};
  CHECK(app::has_other_focal_length(found));
  CHECK_FALSE(app::find_doubt(found));
  found[1] = {"cx", 320.0, 321.0, 0.5, false};
  const auto doubt = app::find_doubt(found);
  REQUIRE(doubt);
  CHECK(doubt->given == 525.0);
  CHECK(doubt->found == 547.0);
  found[0].deviation = 4.0;
  CHECK_FALSE(app::has_other_focal_length(found));
  found[0] = {"fx", 525.0, 528.0, 0.1, false};
  CHECK_FALSE(app::has_other_focal_length(found));
  found[0] = {"fx", 525.0, 525.0, 0.0, true};
  CHECK_FALSE(app::has_other_focal_length(found));
}
