// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <span>

#include <orbis/slam/detail/loops/loop_fusion.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;
namespace fusion = slam::detail::loop_fusion;

namespace {

/// A map without drift that shows its first place twice.
struct scene {
  test::ring_world world{{.steps = 60, .drift = 0.0}};
  slam::map m = world.round(4);
  slam::detail::loop_match match;

  scene() {
    match.keyframe = 63;
    match.candidate = 3;
    match.T_candidate_keyframe = world.truth(3).inverse() * world.truth(63);
  }
};

}  // namespace

TEST_CASE("A snapshot has the landmarks that a keyframe and its neighbours observe, and finds them in a frame") {
  scene s;
  const auto taken = slam::detail::snapshot_around(s.m, 3, 5);
  CHECK(taken.keyframe == 3);
  REQUIRE(taken.landmarks.size() == taken.descriptors.size());
  CHECK(taken.landmarks.size() > s.m.at(3).size());
  CHECK(std::is_sorted(taken.landmarks.begin(), taken.landmarks.end(),
                       [](const auto& a, const auto& b) { return a.id < b.id; }));
  for (const auto& l : taken.landmarks) CHECK(l.position == s.m.landmark_at(l.id).position);

  const slam::frame f = s.world.look(63, s.world.truth(63));
  const auto matches = slam::detail::find_landmarks(taken, f, s.world.truth(63), s.world.rig, 4.0, 50);
  CHECK(matches.size() > 60);
  std::size_t wrong = 0;
  for (const auto& found : matches) {
    const auto& o = s.m.landmark_at(taken.landmarks[found.query].id).observations.front();
    wrong += s.world.point_of(o.keyframe, o.feature) != s.world.point_of(63U, found.train);
  }
  CHECK(wrong == 0);
}

TEST_CASE("Landmarks of both ends are found to be the same and fused, those of the candidate stay") {
  scene s;
  const slam::map before = s.m;
  const auto pairs = fusion::find_pairs(fusion::take(s.m, s.m, s.match, {}), s.world.rig, {});
  REQUIRE(pairs.size() > 100);
  for (const auto& p : pairs) {
    const auto& o = s.m.landmark_at(p.observed.landmark).observations.front();
    CHECK(s.world.point_of(o.keyframe, o.feature) == s.world.point_of(p.keyframe, p.observed.feature));
  }
  CHECK(test::same(before, s.m));
  const auto counts = fusion::fuse<features::binary_descriptor<256>>(s.m, pairs);
  CHECK(counts.fused > 50);
  CHECK(s.m.landmark_count() == before.landmark_count() - counts.fused);
  CHECK(s.m.covisibility().shared(63, 3) > 50);
  for (const auto& p : pairs) CHECK(s.m.has_landmark(p.observed.landmark));
  const auto valid = test::validate(s.m);
  CHECK((valid ? "" : valid.error().to_string()) == "");
  const auto again = fusion::fuse<features::binary_descriptor<256>>(s.m, pairs);
  CHECK(again.fused + again.observed == 0);
}

TEST_CASE("Fused part by part, a map is the same") {
  scene s;
  const auto pairs = fusion::find_pairs(fusion::take(s.m, s.m, s.match, {}), s.world.rig, {});
  slam::map parts = s.m;
  const auto whole = fusion::fuse<features::binary_descriptor<256>>(s.m, pairs);
  slam::detail::fusion_counts counts;
  std::size_t steps = 0;
  for (std::size_t at = 0; at < pairs.size(); at += 37, ++steps) {
    const auto some = std::span{pairs}.subspan(at, std::min<std::size_t>(37, pairs.size() - at));
    const auto part = fusion::fuse<features::binary_descriptor<256>>(parts, some);
    counts.fused += part.fused;
    counts.observed += part.observed;
  }
  CHECK(steps > 5);
  CHECK(counts.fused == whole.fused);
  CHECK(counts.observed == whole.observed);
  CHECK(test::same(s.m, parts));
  for (const auto& l : s.m.landmarks()) {
    const auto& other = parts.landmark_at(l.id);
    CHECK((l.descriptor == other.descriptor && l.normal == other.normal && l.max_distance == other.max_distance));
  }
}

TEST_CASE("Pairs whose keyframe or landmark is gone are left out") {
  scene s;
  const auto pairs = fusion::find_pairs(fusion::take(s.m, s.m, s.match, {}), s.world.rig, {});
  const slam::landmark_id removed = pairs.front().observed.landmark;
  s.m.remove_landmark(removed);
  s.m.erase_keyframe(63);
  fusion::fuse<features::binary_descriptor<256>>(s.m, pairs);
  CHECK_FALSE(s.m.has_landmark(removed));
  CHECK(test::validate(s.m));
}
