// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/options.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("stereo options follow from the focal length and the baseline") {
  slam::options settings;
  settings.seed = 7;
  const slam::options wide = slam::stereo_options(500.0, 0.2, settings);
  CHECK(wide.seed == 7);
  CHECK(wide.scale_is_measured);
  CHECK(wide.bf == Approx(100.0));
  CHECK(wide.min_depth == Approx(0.2));
  CHECK(wide.max_depth == Approx(100.0));  // a disparity of one pixel
  CHECK(wide.close_depth == Approx(8.0));
  const slam::options coarse = slam::stereo_options(20.0, 0.2);  // 40 baselines are beyond the range
  CHECK(coarse.close_depth == coarse.max_depth);
}

TEST_CASE("options of a camera without depth need no lengths, and keep the other settings") {
  slam::options settings;
  settings.seed = 7;
  settings.threads.enabled = true;
  const slam::options mono = slam::monocular_options(settings);
  CHECK(mono.seed == 7);
  CHECK(mono.threads.enabled);
  CHECK_FALSE(mono.scale_is_measured);
  CHECK_FALSE(mono.depth_term.enabled);
  CHECK_FALSE(mono.depth_term.recovers);
  CHECK_FALSE(mono.moving.enabled);
}

TEST_CASE("a triangulating depth camera is as exact as a stereo pair with a tenth of a pixel") {
  CHECK(slam::depth_camera_bf(580.0, 0.075) == Approx(435.0));
}
