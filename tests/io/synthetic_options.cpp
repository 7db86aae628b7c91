// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/io/synthetic_options.hpp>

#include "support/catch.hpp"

using namespace orbis;
using io::synthetic_recording;

TEST_CASE("un-projected ideal depth lies on a true surface") {
  const synthetic_recording room{
      {.frames = 12, .seed = 4, .width = 150, .height = 110, .sensor = io::synthetic_sensor_options::ideal()}};
  const auto settings = room.camera();
  for (std::size_t i = 0; i != room.size(); ++i) {
    const camera::rgbd_frame f = room.frame(i).value();
    const auto exact = room.exact(seq, i).value();
    for (int y = 0; y < 110; y += 3)
      for (int x = 0; x < 150; x += 3) {
        const vec3 ray = settings.model.unproject(vec2(x, y)).value();
        const double stored = f.depth(x, y) / settings.depth_scale;
        REQUIRE(stored > 0.0);
        const vec3 p = *f.T_world_camera * vec3(stored * ray);
        CHECK(room.scene().distance(p) < 0.5 / 5000.0 * ray.norm() + 1e-6);
        CHECK(room.scene().distance(*f.T_world_camera * vec3(static_cast<double>(exact.depth(x, y)) * ray)) < 1e-6);
      }
  }
}
