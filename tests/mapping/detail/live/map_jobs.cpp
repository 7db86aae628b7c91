// SPDX-License-Identifier: BSD-3-Clause
//
// What waits for a live map is merged where it says the same thing twice, and does the same as before.
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/mapping/detail/live/map_jobs.hpp>

#include "support/catch.hpp"

using namespace orbis;
using mapping::keyframe_position;
using mapping::unlisted;
using mapping::detail::map_job;
using mapping::detail::map_jobs;

namespace {

se3 at(double x) { return se3{so3{}, vec3{x, 0, 0}}; }

/// Keyframes, each with a place or hidden, as a live map would have them after the jobs.
struct model {
  std::map<std::uint64_t, std::optional<double>> keyframes;

  void apply(const map_job& j) {
    switch (j.kind) {
      case map_job::keyframe: keyframes[j.frame] = j.T.translation().x(); break;
      case map_job::removal: keyframes.erase(j.frame); break;
      case map_job::positions: {
        std::set<std::uint64_t> listed;
        for (const auto& p : j.poses) {
          if (!keyframes.contains(p.frame)) continue;
          keyframes[p.frame] = p.T_world_camera.translation().x();
          listed.insert(p.frame);
        }
        if (j.others == unlisted::hide)
          for (auto& [frame, x] : keyframes)
            if (!listed.contains(frame)) x.reset();
        break;
      }
      default: break;
    }
  }
};

}  // namespace

TEST_CASE("Merged jobs leave the keyframes where the jobs one by one leave them") {
  random_bits random{7};
  for (int round = 0; round != 500; ++round) {
    map_jobs jobs;
    model expected, merged;
    std::size_t pushed = 0, images = 0;
    for (int i = 0; i != 60; ++i) {
      map_job j{.frame = random.below(6)};
      const std::uint32_t kind = random.below(12);
      j.kind = kind == 0   ? map_job::keyframe
               : kind == 1 ? map_job::poll
               : kind < 5  ? map_job::removal
                           : map_job::positions;
      j.T = at(i);
      if (j.kind == map_job::positions) {
        for (std::uint32_t n = random.below(5); n != 0; --n)
          j.poses.push_back({random.below(6), at(i + 0.01 * static_cast<double>(n))});
        j.others = random.below(3) == 0 ? unlisted::hide : unlisted::keep;
      }
      images += j.has_image() ? 1U : 0U;
      expected.apply(j);
      jobs.push(j);
      ++pushed;
      CHECK(jobs.images() == images);
    }
    CHECK(jobs.size() < pushed);
    while (!jobs.empty()) merged.apply(jobs.pop());
    CHECK(jobs.images() == 0);
    REQUIRE(merged.keyframes == expected.keyframes);
  }
}

TEST_CASE("Poses and removals that nobody takes do not pile up") {
  map_jobs jobs;
  for (int i = 0; i != 1000; ++i) {
    jobs.push({.kind = map_job::positions, .poses = {{1, at(i)}, {2, at(i + 1)}, {1, at(i + 2)}}});
    jobs.push({.kind = map_job::removal, .frame = static_cast<std::uint64_t>(i % 3)});
  }
  CHECK(jobs.size() == 4);
  const map_job poses = jobs.pop();
  REQUIRE(poses.kind == map_job::positions);
  REQUIRE(poses.poses.size() == 2);
  CHECK(poses.poses[0].T_world_camera.translation().x() == 1001);
  CHECK(poses.poses[1].T_world_camera.translation().x() == 1000);
}

TEST_CASE("Frames between keyframes and the images of keyframes that are gone leave the queue") {
  map_jobs jobs;
  jobs.push({.kind = map_job::keyframe, .frame = 0});
  jobs.push({.kind = map_job::between, .frame = 1});
  jobs.push({.kind = map_job::between, .frame = 2});
  jobs.push({.kind = map_job::keyframe, .frame = 3});
  jobs.push({.kind = map_job::keyframe, .frame = 7});
  jobs.push({.kind = map_job::removal, .frame = 3});
  CHECK(jobs.pop_frame()->frame == 1);
  jobs.forget({0, 7});
  CHECK(jobs.images() == 2);
  CHECK(jobs.size() == 3);
  CHECK(jobs.pop().frame == 2);
  CHECK_FALSE(jobs.pop_frame());
  jobs.clear();
  CHECK((jobs.empty() && jobs.images() == 0));
}
