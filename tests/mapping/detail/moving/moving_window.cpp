// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <optional>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/mapping/detail/moving/moving_window.hpp>
#include <orbis/mapping/keyframe.hpp>

#include "mapping/keyframes.hpp"
#include "support/catch.hpp"

using window = orbis::mapping::detail::moving_window<orbis::camera::pinhole, orbis::mapping::keyframe<>>;

TEST_CASE("keyframes come back in order once those after them were seen") {
  auto scene = orbis::test::wall_scene(6);
  for (int y = 12; y != 36; ++y)
    for (int x = 20; x != 44; ++x) scene.depth[2](x, y) = 1000;
  for (const std::size_t keyframes : {1U, 3U, 6U, 9U}) {
    orbis::mapping::moving_filter_options options;
    options.keyframes = keyframes;
    window judged{scene.camera, options};
    std::size_t next = 0;
    const auto take = [&] {
      while (const auto k = judged.pop()) {
        CHECK(k->number == next);
        CHECK(k->keyframe.depth.pixels().data() == scene.depth[next].view().data());
        CHECK(k->removed.empty() == (next != 2 || keyframes == 1));
        ++next;
      }
    };
    for (std::size_t i = 0; i != 6; ++i) {
      judged.push(orbis::par.with(2), scene.keyframe(i));
      take();
      CHECK(next == (i + 1 > keyframes ? i + 1 - keyframes : 0));
    }
    judged.finish();
    take();
    CHECK(next == 6);
  }
}

TEST_CASE("without options keyframes come back at once") {
  const auto scene = orbis::test::wall_scene(2);
  window judged{scene.camera, std::nullopt};
  CHECK_FALSE(judged.pop());
  for (std::size_t i = 0; i != 2; ++i) {
    judged.push(orbis::seq, scene.keyframe(i));
    const auto k = judged.pop();
    REQUIRE(k);
    CHECK(k->number == i);
    CHECK(k->removed.empty());
    CHECK_FALSE(judged.pop());
  }
  judged.finish();
  CHECK_FALSE(judged.pop());
}
