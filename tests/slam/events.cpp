// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/events.hpp>

#include "support/catch.hpp"

using namespace orbis;

static_assert(slam::to_string(slam::correction_kind::loop) == "loop");
static_assert(slam::to_string(slam::correction_kind::global_adjustment) == "global adjustment");
static_assert(slam::to_string(slam::correction_kind::merge) == "merge");
static_assert(slam::to_string(static_cast<slam::correction_kind>(9)) == "unknown");

TEST_CASE("Callbacks are empty until they are set, events refer to nothing until they are filled in") {
  const slam::listeners none;
  CHECK_FALSE((none.keyframe_made || none.keyframe_culled || none.map_corrected || none.state_changed));
  CHECK(slam::keyframe_event{}.id.keyframe == slam::no_id);
  const slam::correction_event e;
  CHECK(e.from.keyframe == slam::no_id);
  CHECK(e.to.keyframe == slam::no_id);
  CHECK(e.T_corrected_before.to_matrix() == se3{}.to_matrix());
}
