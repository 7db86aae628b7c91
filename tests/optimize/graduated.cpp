// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <orbis/optimize/graduated.hpp>

#include "support/catch.hpp"

using namespace orbis::optimize;

TEST_CASE("A schedule starts wide, narrows and ends with the loss it was given") {
  const graduated schedule{geman_mcclure{2.0}, 16.0, 0.5};
  REQUIRE(schedule.stages() == 5);
  CHECK(schedule.stage(0).width == Approx(32.0));
  CHECK(schedule.stage(1).width == Approx(16.0));
  CHECK(schedule.stage(3).width == Approx(4.0));
  CHECK(schedule.stage(4).width == 2.0);
  CHECK(schedule.stage(100).width == 2.0);
  const graduated uneven{truncated{1.0}, 10.0, 0.7};
  for (int k = 1; k < uneven.stages(); ++k) CHECK(uneven.stage(k).width < uneven.stage(k - 1).width);
  CHECK(uneven.stage(uneven.stages() - 1).width == 1.0);
  CHECK(stages_of(schedule) == 5);
  CHECK(stage_of(schedule, 1).width == Approx(16.0));
}

TEST_CASE("A schedule that makes no sense is the loss alone, and so is a loss") {
  CHECK(graduated{cauchy{1.0}, 0.5}.stages() == 1);
  CHECK(graduated{cauchy{1.0}, std::numeric_limits<double>::infinity()}.stages() == 1);
  CHECK(graduated{cauchy{1.0}, std::numeric_limits<double>::quiet_NaN()}.stages() == 1);
  CHECK(graduated{cauchy{1.0}, 8.0, 1.0}.stages() == 1);
  CHECK(graduated{cauchy{3.0}, 8.0, 1.5}.stage(0).width == 3.0);
  CHECK(stages_of(huber{2.0}) == 1);
  CHECK(stage_of(huber{2.0}, 7).width == 2.0);
  STATIC_REQUIRE(loss_or_schedule<trivial> && !scalable_loss<trivial> && scalable_loss<huber>);
}
