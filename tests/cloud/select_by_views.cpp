// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/cloud/select_by_views-inl.hpp>
#include <orbis/cloud/view_samples.hpp>

#include "cloud/room_outliers.hpp"
#include "cloud/views.hpp"
#include "support/catch.hpp"

using orbis::cloud::choice_status;
using orbis::cloud::filter_automatically;
using orbis::cloud::filter_mode;
using orbis::test::has_step;

TEST_CASE("views show what no density can") {
  // Somebody crosses in front of a wall; one of eight views is where it does not say.
  const auto seen = orbis::test::walked_past_wall();
  const auto alone = filter_automatically(orbis::par, seen.points, {.ranges = seen.ranges});
  const auto result = filter_automatically(orbis::par, seen.points, seen.views(), seen.camera, {.ranges = seen.ranges});
  INFO(to_string(result.choice.chain));
  REQUIRE(has_step(result.choice.chain, filter_mode::ray_evidence));
  const auto f1 = [&](const std::vector<std::uint32_t>& inliers) { return seen.f1_of_removal(inliers); };
  CHECK(f1(alone.inliers) < 0.3);
  CHECK(f1(result.inliers) > 0.9);
  const auto& step = std::get<orbis::cloud::ray_step>(result.choice.chain.front());
  CHECK(step.distrusted == std::vector<std::uint32_t>{5});
  CHECK(step.need_support);
  CHECK(result.choice.evidence.views == 8);

  const auto again = filter_automatically(orbis::seq, seen.points, seen.views(), orbis::camera::any_camera{seen.camera},
                                          {.ranges = seen.ranges});
  CHECK(again.inliers == result.inliers);
  CHECK(again.choice.evidence == result.choice.evidence);

  SECTION("whoever drew the samples of the views") {
    orbis::cloud::view_samples samples;
    for (const auto& view : seen.views()) samples.add(seen.camera, view);
    const auto drawn = filter_automatically(orbis::par.with(3), seen.points, seen.views(), seen.camera,
                                            {.ranges = seen.ranges, .samples = &samples});
    CHECK(drawn.inliers == result.inliers);
    CHECK(drawn.choice.evidence == result.choice.evidence);
  }
  SECTION("if there are too few to outvote one, all count") {
    auto few = seen.views();
    few.erase(few.begin(), few.begin() + 5);
    for (const std::size_t n : {3U, 1U}) {
      few.resize(n);
      std::size_t calls = 0;
      const auto watch = [&](std::size_t done, std::size_t total) {
        CHECK(done == ++calls);
        CHECK(total == n);
        return true;
      };
      const auto judged =
          filter_automatically(orbis::par, seen.points, few, seen.camera, {.ranges = seen.ranges}, watch);
      CHECK(calls == n);
      for (const auto& s : judged.choice.chain)
        if (const auto* rays = std::get_if<orbis::cloud::ray_step>(&s)) CHECK(rays->distrusted.empty());
    }
  }
  SECTION("unless it is cancelled") {
    int calls = 0;
    const auto stopped = filter_automatically(orbis::par, seen.points, seen.views(), seen.camera, {},
                                              [&](std::size_t, std::size_t) { return ++calls < 5; });
    CHECK(calls == 5);
    CHECK(stopped.choice.chain.empty());
    CHECK(stopped.choice.status == choice_status::cancelled);
    CHECK(stopped.inliers.size() == seen.points.size());
  }
}
