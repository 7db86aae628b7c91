// SPDX-License-Identifier: BSD-3-Clause
//
// Somebody who walks through a room leaves little of a trail in its live map, and nothing else is lost.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/moving_filter.hpp>
#include <orbis/octree/files.hpp>

#include "mapping/keyframes.hpp"
#include "mapping/memory_depths.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using octree_type = octree::occupancy_octree<>;
using live = mapping::live_map<octree_type, camera::pinhole, test::memory_depths>;
using filter = mapping::moving_filter<camera::pinhole>;
using depth_view = camera::depth_view<std::uint16_t>;

struct shot {
  std::uint64_t frame;
  image<std::uint16_t> depth;
  se3 T_world_camera;
};

constexpr double scale = 5000.0;

/// Keyframes of the room with or without a person, and the truth about it.
struct round_trip {
  io::synthetic_recording recording;
  std::vector<shot> shots;

  explicit round_trip(bool person)
      : recording{{.frames = 360, .width = 320, .height = 240, .scene = {.person = person}}} {
    for (std::size_t i = 0; i < recording.size(); i += 9)
      shots.push_back({i, recording.frame(i).value().depth, recording.T_world_camera(i)});
  }
  [[nodiscard]] camera::pinhole camera() const {
    return camera::pinhole{*recording.camera().model.get_if<camera::pinhole>()};
  }
};

struct quality {
  std::size_t ghosts = 0;    ///< occupied voxels that are more than two voxels from every surface
  std::size_t occupied = 0;  ///< the others
  double error = 0.0;        ///< of these: root mean square of the distance to the surface, metres
};

quality judge(const octree_type& map, const io::synthetic_recording& truth) {
  quality q;
  const double edge = map.resolution();
  map.for_each_leaf([&](const octree_type::leaf& leaf) {
    if (!leaf.occupied) return;
    const int cells = static_cast<int>(std::lround(leaf.size / edge));
    for (int i = 0; i != cells * cells * cells; ++i) {
      const vec3 cell = Eigen::Vector3i{i % cells, i / cells % cells, i / cells / cells}.cast<double>();
      const double d = truth.surface_distance(leaf.center + edge * (cell - vec3::Constant(0.5 * (cells - 1))));
      if (d > 2.0 * edge) {
        ++q.ghosts;
      } else {
        ++q.occupied;
        q.error += d * d;
      }
    }
  });
  q.error = std::sqrt(q.error / static_cast<double>(q.occupied));
  return q;
}

/// The live map of all keyframes; `moving`: with the filter.
template <class Policy>
live live_map_of(const Policy& policy, const round_trip& trip,
                 const std::optional<mapping::moving_filter_options>& moving) {
  live map{trip.camera(), {.resolution = 0.05, .integration = {.max_range = 4.0}}};
  std::optional<filter> judge;
  if (moving) judge.emplace(trip.camera(), *moving);
  for (const shot& s : trip.shots) {
    const depth_view depth{s.depth.view(), scale};
    if (judge)
      REQUIRE(judge->add_keyframe(policy, map, s.frame, depth, s.T_world_camera));
    else
      REQUIRE(map.add_keyframe(policy, s.frame, depth, s.T_world_camera));
    while (judge && judge->due() != 0) REQUIRE(judge->revise(policy, map));
    REQUIRE(map.correct(policy));
  }
  return map;
}

}  // namespace

TEST_CASE("of the trail of somebody who walks through the room nine voxels of ten are gone") {
  const round_trip quiet{false}, walked{true};
  const quality before = judge(live_map_of(seq, quiet, std::nullopt).map(), quiet.recording);
  const quality trail = judge(live_map_of(seq, walked, std::nullopt).map(), quiet.recording);
  const live quiet_map = live_map_of(seq, quiet, mapping::moving_filter_options{});
  const live map = live_map_of(seq, walked, mapping::moving_filter_options{});
  const quality without = judge(quiet_map.map(), quiet.recording), with = judge(map.map(), quiet.recording);
  CAPTURE(before.ghosts, trail.ghosts, without.ghosts, with.ghosts, before.occupied, without.occupied, with.occupied,
          before.error, without.error, with.error);
  CHECK(trail.ghosts > before.ghosts + 400);                                  // there is something to be done
  CHECK(with.ghosts <= before.ghosts + (trail.ghosts - before.ghosts) / 10);  // nine of ten voxels of it are gone
  CHECK(without.ghosts <= before.ghosts);
  CHECK(std::abs(with.error - before.error) < 0.001);
  CHECK(std::abs(without.error - before.error) < 0.001);
  // The room itself is not carved away.
  CHECK(static_cast<double>(without.occupied) > 0.995 * static_cast<double>(before.occupied));
  CHECK(static_cast<double>(with.occupied) > 0.97 * static_cast<double>(before.occupied));

  // Every image that shows the person is filtered, and hardly another one. And the map is that of the depth images
  // that it has, bit for bit.
  octree_type fresh{map.options().resolution};
  std::size_t shown = 0, filtered = 0;
  for (const shot& s : walked.shots) {
    image<std::uint16_t> depth;
    REQUIRE(map.depths().get(s.frame, depth));
    const image<std::uint16_t>& empty_room = quiet.shots[static_cast<std::size_t>(&s - walked.shots.data())].depth;
    const bool person = !std::ranges::equal(s.depth.pixels(), empty_room.pixels());
    CHECK((map.is_filtered(s.frame) || !person));
    shown += person ? 1 : 0;
    filtered += map.is_filtered(s.frame) ? 1 : 0;
    fresh.integrate(seq, depth_view{depth.view(), scale}, walked.camera(), s.T_world_camera, map.options().integration);
  }
  CHECK(shown > 3);
  CHECK(filtered <= shown + 2);
  CHECK(octree::ot_bytes(map.map()) == octree::ot_bytes(fresh));
  CHECK(octree::ot_bytes(live_map_of(par.with(3), walked, mapping::moving_filter_options{}).map()) ==
        octree::ot_bytes(fresh));
}

TEST_CASE("a map that is made of all keyframes keeps no more than one ghost voxel in fifty") {
  const round_trip quiet{false}, walked{true};
  const auto map_of = [&](const round_trip& trip, bool without_moving) {
    std::vector<mapping::keyframe<>> keyframes;
    for (const shot& s : trip.shots) keyframes.push_back({depth_view{s.depth.view(), scale}, {}, s.T_world_camera});
    mapping::map_options options{.dense = {.max_depth = 4.0F, .voxel_size = 0.01},
                                 .resolution = 0.05,
                                 .integration = {.max_range = 4.0},
                                 .unfiltered_octree = false};
    options.dense.flying_pixels.emplace();
    if (without_moving) options.moving.emplace();
    return mapping::build_map(par.with(2), keyframes, trip.camera(), options).value();
  };
  const auto room = map_of(quiet, true), trail = map_of(walked, false), map = map_of(walked, true);
  const quality before = judge(room.octree, quiet.recording), with_trail = judge(trail.octree, quiet.recording),
                after = judge(map.octree, quiet.recording);
  CAPTURE(before.ghosts, with_trail.ghosts, after.ghosts, before.occupied, after.occupied, before.error, after.error);
  CHECK(with_trail.ghosts > before.ghosts + 200);
  CHECK(after.ghosts <= before.ghosts + (with_trail.ghosts - before.ghosts) / 50);
  CHECK(std::abs(after.error - before.error) < 0.001);
  CHECK(static_cast<double>(after.occupied) > 0.99 * static_cast<double>(before.occupied));
  CHECK(map.moving.keyframes >= 4);
  CHECK(map.moving.pixels > 50000);
  CHECK(room.moving.pixels < 2000);
  CHECK(trail.moving.pixels == 0);
}

namespace {

/// A wall 2 m before a camera that stands, and a board 1 m before it in some of the images.
struct still_camera {
  camera::pinhole camera{{.width = 64, .height = 48, .fx = 55, .fy = 55, .cx = 31.5, .cy = 23.5}};
  live map{camera, {.resolution = 0.05}};
  filter moving{camera, {.keyframes = 6}};
  std::uint64_t next = 0;
  bool revises = true, corrects = true;  // after each keyframe

  void see(bool board, const se3& T_world_camera = {}) {
    image<std::uint16_t> depth(64, 48, static_cast<std::uint16_t>(2.0 * scale));
    for (int y = 12; board && y != 36; ++y)
      for (int x = 20; x != 44; ++x) depth(x, y) = static_cast<std::uint16_t>(scale);
    REQUIRE(moving.add_keyframe(seq, map, next++, depth_view{depth.view(), scale}, T_world_camera));
    while (revises && moving.due() != 0) REQUIRE(moving.revise(seq, map));
    if (corrects) REQUIRE(map.correct(seq));
  }
  /// How many pixels of the board's place a keyframe's image in the map has.
  [[nodiscard]] int pixels(std::uint64_t frame) const {
    image<std::uint16_t> depth;
    REQUIRE(map.depths().get(frame, depth));
    int n = 0;
    for (int y = 12; y != 36; ++y)
      for (int x = 20; x != 44; ++x) n += depth(x, y) != 0 ? 1 : 0;
    return n;
  }
};

constexpr int board_pixels = 24 * 24;

}  // namespace

TEST_CASE("what was seen once and is looked through is taken out as soon as there is evidence") {
  still_camera c;
  c.see(true);
  CHECK(c.pixels(0) == board_pixels);
  CHECK_FALSE(c.map.is_filtered(0));
  c.see(false);
  CHECK(c.pixels(0) < board_pixels / 4);  // all but cells that have the wall around them
  CHECK(c.map.is_filtered(0));
  CHECK(*c.moving.removed_share(0) > 0.1);
  CHECK_FALSE(c.map.is_filtered(1));
  CHECK(*c.moving.removed_share(1) == 0.0);
  CHECK(c.map.map().state(vec3{0.01, 0.01, 1.01}) != octree::occupancy::occupied);
  CHECK(c.map.map().state(vec3{0.01, 0.01, 2.01}) == octree::occupancy::occupied);
}

TEST_CASE("what comes and stays is shown once it has been seen more often than its place was empty") {
  still_camera c;
  c.see(false);
  c.see(false);
  c.see(true);
  CHECK(c.pixels(2) < board_pixels / 4);  // it may be somebody who walks by
  c.see(true);
  for (const std::uint64_t frame : {2U, 3U}) {
    CAPTURE(frame);
    CHECK(c.pixels(frame) < board_pixels / 4);
  }
  c.see(true);
  for (const std::uint64_t frame : {2U, 3U, 4U}) {
    CAPTURE(frame);
    CHECK(c.pixels(frame) == board_pixels);  // two others show it, two do not
  }
  c.see(true);
  CHECK(c.map.map().state(vec3{0.01, 0.01, 1.01}) == octree::occupancy::occupied);
}

TEST_CASE("keyframes are compared at corrected poses, though the map has not followed yet") {
  still_camera c;
  c.see(true);
  c.see(true);
  // All of it was half a metre behind where it was thought to be.
  const se3 corrected{so3{}, vec3{0, 0, -0.5}};
  c.corrects = false;
  CHECK(c.map.set_poses(std::vector<mapping::keyframe_position>{{0, corrected}, {1, corrected}}) == 2);
  CHECK(c.map.used_pose(0)->translation().z() == 0.0);
  CHECK(c.map.wanted_pose(0)->translation().z() == -0.5);
  CHECK_FALSE(c.map.wanted_pose(7));
  c.see(true, corrected);
  for (const std::uint64_t frame : {0U, 1U, 2U}) {
    CAPTURE(frame);
    CHECK(*c.moving.removed_share(frame) == 0.0);
    CHECK(c.pixels(frame) == board_pixels);
  }
}

TEST_CASE("judgements that no time was found for are made up for with the next keyframe") {
  still_camera prompt, late;
  late.revises = false;
  for (int i = 0; i != 20; ++i) {
    const bool board = i == 1 || i == 4 || i == 11 || i == 12 || i >= 15;
    prompt.see(board);
    late.see(board);
    CHECK(prompt.moving.due() == 0);
    CHECK(late.moving.due() == std::min<std::size_t>(static_cast<std::size_t>(i), 5));
  }
  while (late.moving.due() != 0) REQUIRE(late.moving.revise(seq, late.map));
  for (std::uint64_t frame = 0; frame != 20; ++frame) {
    CAPTURE(frame);
    CHECK(late.pixels(frame) == prompt.pixels(frame));
  }
  REQUIRE(late.moving.revise(seq, late.map));  // nothing is due
  late.moving.forget(19);
  CHECK(late.moving.due() == 0);
}

TEST_CASE("what is due to be judged by a keyframe that is forgotten is due no more") {
  still_camera c;
  c.see(true);
  c.see(true);
  c.revises = false;
  c.see(false);
  CHECK(c.moving.due() == 2);
  c.moving.forget(2);
  CHECK(c.moving.due() == 0);
  CHECK(c.pixels(0) == board_pixels);
  c.see(false);
  c.moving.forget(0);
  CHECK(c.moving.due() == 1);
  REQUIRE(c.moving.revise(seq, c.map));
  CHECK(c.moving.due() == 0);
}

TEST_CASE("what earlier keyframes say counts even if the newest is forgotten or has no place before it is asked") {
  for (const bool forgotten : {false, true}) {
    CAPTURE(forgotten);
    still_camera c;
    c.revises = false;
    c.see(true);
    c.see(false);
    if (forgotten) {
      c.see(false);
      c.moving.forget(2);
    } else {
      const se3 nowhere{so3{}, vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
      c.see(false, nowhere);
    }
    CHECK(c.pixels(0) == board_pixels);
    CHECK(c.moving.due() == 1);
    while (c.moving.due() != 0) REQUIRE(c.moving.revise(seq, c.map));
    CHECK(c.pixels(0) < board_pixels / 4);
  }
}

TEST_CASE("a keyframe that is forgotten is judged no more") {
  still_camera c;
  c.see(true);
  c.moving.forget(0);
  CHECK_FALSE(c.moving.removed_share(0));
  for (int i = 0; i != 4; ++i) c.see(false);
  CHECK(c.pixels(0) == board_pixels);
  c.moving.forget(17);  // never known
}

TEST_CASE("a keyframe without a place is neither judged nor asked") {
  still_camera c;
  const image<std::uint16_t> depth(64, 48, static_cast<std::uint16_t>(scale));
  const se3 nowhere{so3{}, vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  for (int i = 0; i != 3; ++i)
    REQUIRE(c.moving.add_keyframe(seq, c.map, c.next++, depth_view{depth.view(), scale}, nowhere));
  CHECK_FALSE(c.moving.removed_share(0));
  c.see(true);
  CHECK(c.pixels(3) == board_pixels);
  CHECK_FALSE(c.map.is_filtered(3));
}
