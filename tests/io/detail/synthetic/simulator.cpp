// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include <orbis/core/execution.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/simulator.hpp>
#include <orbis/io/synthetic_options.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;

TEST_CASE("Rows without colours have the depth and the angles of those with them") {
  const io::synthetic_options o{.frames = 60, .seed = 5, .width = 160, .height = 120};
  const scene room{o.scene, o.seed};
  const camera_path path{o.path, o.seed, o.frames / o.fps};
  const simulator camera{std::make_shared<texture_set>(painted(room), 0.02), usual_intrinsics(o.width, o.height),
                         o.depth_scale, o.sensor, o.seed};
  const auto at = [&](double time) { return moment{room.solids_at(time), path.at(time)}; };
  const auto row_time = [](int y) { return 0.0002 * y; };
  for (const double time : {0.0, 0.7, 1.4}) {
    const exact_view whole = camera.exact_rows(seq, at, time, row_time);
    const exact_view surface = camera.exact_rows(seq, at, time, row_time, false);
    CHECK_FALSE(whole.color.empty());
    CHECK(surface.color.empty());
    CHECK(whole.depth == surface.depth);
    CHECK(whole.cosine == surface.cosine);
  }
}
