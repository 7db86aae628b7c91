// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/eval/ate.hpp>
#include <orbis/io/trajectory_file.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

namespace eval = orbis::eval;
using orbis::se3;
using orbis::so3;
using orbis::vec3;

TEST_CASE("the benchmark's own example has the published error") {
  ORBIS_NEEDS_DATA("trajectories");
  const auto folder = orbis::test::data_dir() / "trajectories";
  const auto reference = orbis::io::read_trajectory(folder / "freiburg1_xyz-groundtruth.txt").value();
  const auto estimate = orbis::io::read_trajectory(folder / "freiburg1_xyz-rgbdslam.txt").value();
  const auto error = eval::ate(estimate, reference).value();
  CHECK(error.translation.count == 786);
  CHECK(error.aligned.pairs == 786);
  CHECK(error.translation.rmse == Approx(0.013473).margin(5e-7));
  CHECK(error.translation.median < error.translation.rmse);
  CHECK(error.translation.max > error.translation.p95);
  // Within 0.01 s one pair fewer is found.
  CHECK(eval::ate(estimate, reference, {.max_time_difference = 0.01}).value().translation.count == 785);
  CHECK(eval::ate(estimate, reference, {.with_scale = true}).value().translation.rmse < error.translation.rmse);
}

TEST_CASE("the error does not depend on the frame of the estimate") {
  orbis::trajectory reference, estimate;
  const se3 T = se3(so3::exp(vec3(1, 2, 3)), vec3(4, 5, 6));
  for (int i = 0; i != 40; ++i) {
    const vec3 p(std::cos(0.1 * i), std::sin(0.2 * i), 0.1 * i);
    reference.push_back({0.1 * i, se3(so3{}, p)});
    // Alternating by 1 cm across the motion: that is the error.
    estimate.push_back({0.1 * i, T * se3(so3{}, p + vec3(0, 0, i % 2 == 0 ? 0.01 : -0.01))});
  }
  const auto error = eval::ate(estimate, reference).value();
  CHECK(error.translation.rmse == Approx(0.01).epsilon(0.02));
  CHECK(eval::ate(orbis::trajectory{}, reference).error().code == orbis::errc::no_data);
}
