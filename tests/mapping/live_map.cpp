// SPDX-License-Identifier: BSD-3-Clause
//
// A live map is the map of its keyframes at the poses that they have now, whatever happened to them before.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/files.hpp>

#include "mapping/keyframes.hpp"
#include "mapping/memory_depths.hpp"
#include "support/catch.hpp"
#include "support/random_motion.hpp"

using namespace orbis;
using namespace std::chrono_literals;
using octree::ot_bytes;

namespace {

using octree_type = octree::occupancy_octree<>;
using live = mapping::live_map<octree_type, camera::pinhole, test::memory_depths>;
using depth_view = camera::depth_view<std::uint16_t>;

/// What the SLAM system believes: the keyframes of all maps, in the world of each.
struct belief {
  struct keyframe {
    image<std::uint16_t> depth;
    se3 T_world_camera;
    int map = 0;
  };
  test::seen_scene scene = test::edge_scene(24);
  std::map<std::uint64_t, keyframe> keyframes;
  int active = 0;

  [[nodiscard]] depth_view depth_of(const keyframe& k) const { return depth_view{k.depth.view(), 1000.0, 0.0F, 4.0F}; }
  [[nodiscard]] std::vector<mapping::keyframe_position> active_poses() const {
    std::vector<mapping::keyframe_position> all;
    for (const auto& [frame, k] : keyframes)
      if (k.map == active) all.push_back({frame, k.T_world_camera});
    return all;
  }
  /// The map made afresh of the active keyframes at `pose_of(frame, keyframe)`.
  template <class PoseOf>
  [[nodiscard]] octree_type fresh(const live& like, const PoseOf& pose_of) const {
    octree_type map{like.options().resolution};
    for (const auto& [frame, k] : keyframes)
      if (k.map == active) map.integrate(depth_of(k), scene.camera, pose_of(frame, k), like.options().integration);
    return map;
  }
  [[nodiscard]] octree_type fresh(const live& like) const {
    return fresh(like, [](std::uint64_t, const keyframe& k) { return k.T_world_camera; });
  }
};

/// The largest distance between where two poses see the pixels of an image.
double displacement(const belief& b, const belief::keyframe& k, const se3& used) {
  double largest = 0;
  const depth_view depth = b.depth_of(k);
  for (int y = 0; y != depth.height(); ++y)
    for (int x = 0; x != depth.width(); ++x) {
      const vec3 p = static_cast<double>(depth(x, y)) * *b.scene.camera.unproject(vec2{x, y});
      largest = std::max(largest, (used * p - k.T_world_camera * p).norm());
    }
  return largest;
}

/// A run of a SLAM system with everything that it can do to keyframes. Returns the map's bytes after every step.
template <class Policy>
std::vector<std::string> run(const Policy& policy, std::uint64_t seed, double tolerance,
                             const mapping::correction_limits& limits) {
  random_bits random{seed};
  belief b;
  live map{b.scene.camera, {.resolution = 0.08, .tolerance = tolerance, .keyframes_per_replay = 3}};
  std::vector<std::string> seen;
  std::size_t added = 0, corrected = 0;
  for (int step = 0; step != 50; ++step) {
    switch (random.below(9)) {
      case 0: {  // a loop closes: drift that grows towards the newest keyframe is taken out
        const se3 drift = test::random_motion(random, 0.1, 0.03);
        double part = 0;
        for (auto& [frame, k] : b.keyframes) {
          if (k.map == b.active) k.T_world_camera = se3::exp(part * drift.log()) * k.T_world_camera;
          part += 1.0 / static_cast<double>(b.keyframes.size());
        }
        break;
      }
      case 1:  // local adjustment: a little, most of it within the tolerance
        for (auto& [frame, k] : b.keyframes)
          if (random.below(2) == 0) k.T_world_camera = test::random_motion(random, 0.004, 0.002) * k.T_world_camera;
        break;
      case 2:  // a keyframe is redundant
        if (!b.keyframes.empty()) {
          const auto at = std::next(b.keyframes.begin(), random.below(static_cast<std::uint32_t>(b.keyframes.size())));
          CHECK(map.remove(at->first));
          CHECK_FALSE(map.contains(at->first));
          b.keyframes.erase(at);
        }
        break;
      case 3:  // the camera was lost, and another map begins; or it is back in the first one, and the two merge
        if (b.active == 0) {
          b.active = 1;
        } else {
          const se3 T = test::random_motion(random, 0.3, 0.2);
          for (auto& [frame, k] : b.keyframes) {
            if (k.map == 1) k.T_world_camera = T * k.T_world_camera;
            k.map = 0;
          }
          b.active = 0;
        }
        break;
      case 4:  // a filter changes its mind
        if (!b.keyframes.empty()) {
          auto& [frame, k] = *b.keyframes.begin();
          for (int y = 10; y != 30; ++y) k.depth(random.below(64), y) = 0;
          CHECK(map.set_depth(policy, frame, b.depth_of(k)));
        }
        break;
      case 5: {  // a filter takes pixels out of several keyframes
        std::vector<std::uint64_t> frames;
        for (const auto& [frame, k] : b.keyframes)
          if (random.below(3) == 0) frames.push_back(frame);
        const int column = static_cast<int>(random.below(60));
        const auto edit = [&](std::size_t i, image_view<std::uint16_t> pixels) {
          for (int y = 0; y != 48; ++y) pixels(column + static_cast<int>(i % 4), y) = 0;
        };
        CHECK(map.edit_depths(policy, frames, [&](std::size_t i, const depth_view& depth, const auto& pixels) {
          if (depth.pixels()(5, 5) == pixels(5, 5)) edit(i, pixels);
        }));
        for (std::size_t i = 0; i != frames.size(); ++i) {
          edit(i, b.keyframes[frames[i]].depth.view());
          CHECK(map.is_filtered(frames[i]));
        }
        break;
      }
      default:
        if (added != b.scene.depth.size()) {
          const std::uint64_t frame = 30 * (added ^ 1U);  // pairs come in the wrong order
          const se3 drifted = test::random_motion(random, 0.02, 0.01) * b.scene.poses[added];
          auto& k = b.keyframes[frame] = {b.scene.depth[added++], drifted, b.active};
          CHECK(map.add_keyframe(policy, frame, b.depth_of(k), k.T_world_camera));
        }
    }
    map.set_poses(b.active_poses(), mapping::unlisted::hide);
    for (int call = 0; map.pending() != 0 && (call != 2 || step % 4 == 3); ++call) {
      const auto progress = map.correct(policy, limits);
      REQUIRE(progress);
      CHECK(progress->keyframes + progress->bricks > 0);
      CHECK(progress->done == (map.pending() == 0));
      corrected += progress->keyframes;
      if (call > 1000) FAIL("corrections never end");
    }
    REQUIRE(map.size() == b.keyframes.size());
    if (map.pending() != 0) continue;
    const octree_type expected = b.fresh(map, [&](std::uint64_t frame, const belief::keyframe& k) {
      const std::optional<se3> used = map.used_pose(frame);
      REQUIRE(used);
      CHECK(displacement(b, k, *used) <= tolerance * 0.08 + 1e-12);
      return *used;
    });
    REQUIRE(ot_bytes(map.map()) == ot_bytes(expected));
    if (tolerance == 0) REQUIRE(ot_bytes(map.map()) == ot_bytes(b.fresh(map)));
    seen.push_back(ot_bytes(map.map()));
  }
  CHECK(corrected > 5);
  REQUIRE(map.finish(policy));
  CHECK(ot_bytes(map.map()) == ot_bytes(b.fresh(map)));
  seen.push_back(ot_bytes(map.map()));
  return seen;
}

}  // namespace

TEST_CASE("A live map is made of the present poses after any run of a SLAM system") {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const double tolerance : {0.0, 0.25, 2.0}) {
      const auto once = run(seq, seed, tolerance, {});
      const auto last = run(par.with(3), seed, tolerance, {.time = 0ns, .robot = vec3{1, 0, 0}}).back();
      CHECK(once.back() == last);
      CHECK(run(par.with(2), seed, tolerance, {}) == once);
    }
}

TEST_CASE("A finished live map is the map of all keyframes built at once") {
  auto scene = test::edge_scene(8);
  live map{scene.camera, {.resolution = 0.05}};
  random_bits random{4};
  for (std::size_t i = 0; i != 8; ++i) {
    const auto k = scene.keyframe(i);
    REQUIRE(map.add_keyframe(seq, i, k.depth, test::random_motion(random, 0.05, 0.05) * k.T_world_camera));
  }
  scene.poses[5] = se3{so3{}, vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::vector<mapping::keyframe_position> poses;
  for (std::size_t i = 0; i != 8; ++i) poses.push_back({i, scene.poses[i]});
  map.set_poses(poses);
  REQUIRE(map.finish(seq));
  CHECK_FALSE(map.used_pose(5));
  const auto built = mapping::build_map(
      seq, scene.keyframes(), scene.camera,
      {.dense = {.stride = 1, .max_depth = 1e9F}, .filter = {.kind = mapping::filter_kind::none}, .resolution = 0.05});
  REQUIRE(built);
  CHECK(built->skipped == 1);
  CHECK(ot_bytes(map.map()) == ot_bytes(built->octree));
}

TEST_CASE("Frames between keyframes are in a live map until they are too old or their keyframe moves") {
  const auto scene = test::edge_scene(12);
  live map{scene.camera, {.resolution = 0.05, .max_frames = 4}};
  std::size_t key = 0;  // the second keyframe
  const auto relative = [&](std::size_t i, std::size_t keyframe) {
    return scene.poses[keyframe].inverse() * scene.poses[i];
  };
  const auto add_frame = [&](std::size_t i, std::uint64_t keyframe) {
    return map.add_frame(seq, i, scene.keyframe(i).depth, keyframe, relative(i, keyframe));
  };
  // Keyframe 0 and those frames; what is no keyframe is placed from its keyframe, which is 3 from 4 on, and else 0.
  const auto with = [&](const std::vector<std::size_t>& frames) {
    octree_type expected{0.05};
    for (const std::size_t i : frames) {
      const std::size_t from = i == 0 || i == key ? i : i >= 4 && i != 7 ? key : 0;
      expected.integrate(scene.keyframe(i).depth, scene.camera,
                         from == i ? scene.poses[i] : scene.poses[from] * relative(i, from));
    }
    return ot_bytes(expected);
  };
  const auto now = [&] {
    REQUIRE(map.correct(seq));
    return ot_bytes(map.map());
  };
  CHECK_FALSE(add_frame(1, 0));
  REQUIRE(map.add_keyframe(seq, 0, scene.keyframe(0).depth, scene.poses[0]));
  CHECK_FALSE(add_frame(0, 0));  // a keyframe already
  for (const std::size_t i : {1U, 2U, 3U}) CHECK(add_frame(i, 0));
  CHECK(map.pending() == 0);  // the newest are in the map at once
  CHECK(now() == with({0, 1, 2, 3}));
  REQUIRE(map.add_keyframe(seq, 3, scene.keyframe(3).depth, scene.poses[3]));  // a frame becomes a keyframe
  key = 3;
  CHECK(map.frames() == 2);
  CHECK(now() == with({0, 1, 2, 3}));
  for (const std::size_t i : {4U, 5U}) CHECK(add_frame(i, 3));
  CHECK(now() == with({0, 1, 2, 3, 4, 5}));
  CHECK(add_frame(6, 3));  // one too many: some of the oldest go
  CHECK(map.frames() == 3);
  CHECK(now() == with({0, 3, 4, 5, 6}));
  CHECK(add_frame(7, 0));

  const se3 moved = se3{so3{}, vec3{0.2, 0, 0}} * scene.poses[3];
  map.set_poses(std::vector<mapping::keyframe_position>{{3, moved}});
  REQUIRE(map.correct(seq));
  CHECK(map.frames() == 1);
  map.set_poses(std::vector<mapping::keyframe_position>{{3, scene.poses[3]}});
  CHECK(now() == with({0, 3, 7}));
  CHECK(add_frame(8, 3));
  CHECK(map.remove(3));
  CHECK(now() == with({0, 7}));
  REQUIRE(map.finish(seq));
  CHECK(map.frames() == 0);
  CHECK(now() == with({0}));
}

TEST_CASE("A frame is placed from where its keyframe is in the map, not from where that is to be") {
  const auto scene = test::edge_scene(2);
  live map{scene.camera, {.resolution = 0.05, .tolerance = 1.0, .max_frames = 4}};
  REQUIRE(map.add_keyframe(seq, 0, scene.keyframe(0).depth, scene.poses[0]));
  const se3 moved = se3{so3{}, vec3{0.03, 0, 0}} * scene.poses[0], T_0_1 = scene.poses[0].inverse() * scene.poses[1];
  CHECK(map.set_poses(std::vector<mapping::keyframe_position>{{0, moved}}) == 0);  // within the tolerance
  CHECK(map.add_frame(seq, 1, scene.keyframe(1).depth, 0, T_0_1));
  octree_type expected{0.05};
  expected.integrate(scene.keyframe(0).depth, scene.camera, scene.poses[0]);
  expected.integrate(scene.keyframe(1).depth, scene.camera, scene.poses[0] * T_0_1);
  CHECK(ot_bytes(map.map()) == ot_bytes(expected));
}

TEST_CASE("What moved most and is close to the robot comes first") {
  const auto scene = test::wall_scene(4);
  live map{scene.camera, {.resolution = 0.05}};
  for (std::size_t i = 0; i != 4; ++i) REQUIRE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
  const auto shifted = [&](std::size_t i, double x, double turn) {
    return se3{so3::exp(vec3{0, turn, 0}), vec3{x, 0, 0}} * scene.poses[i];
  };
  const auto moved = [&](std::size_t i) {
    return (map.used_pose(i)->to_matrix() - scene.poses[i].to_matrix()).norm() > 0;
  };
  // A turn of a degree moves the wall by 3 cm; a quarter of a voxel is 1.25 cm.
  const std::vector<mapping::keyframe_position> poses{
      {0, shifted(0, 0.01, 0)}, {1, shifted(1, 0.02, 0)}, {2, shifted(2, 0, 0.05)}, {3, shifted(3, 0.05, 0)}};
  CHECK(map.set_poses(poses) == 3);
  REQUIRE(map.correct(seq, {.time = 0ns}));
  CHECK((moved(2) && !moved(1) && !moved(3)));
  REQUIRE(map.correct(seq, {.time = 0ns, .robot = vec3{-100, 0, 0}}));
  CHECK((moved(3) && !moved(1)));
  REQUIRE(map.correct(seq));
  CHECK((moved(1) && !moved(0)));
  CHECK(map.pending() == 0);
  CHECK(map.set_poses(poses) == 0);
  REQUIRE(map.finish(seq));
  CHECK(moved(0));
}

TEST_CASE("A live map tells which depth image was lost, and goes on without its keyframe") {
  const auto scene = test::wall_scene(3);
  live map{scene.camera, {.resolution = 0.05}, test::memory_depths{.images = {}, .lost = {1}}};
  for (std::size_t i = 0; i != 3; ++i) REQUIRE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
  std::vector<mapping::keyframe_position> poses;
  octree_type expected{0.05};
  for (std::size_t i = 0; i != 3; ++i) {
    poses.push_back({i, se3{so3{}, vec3{0, 0.1, 0}} * scene.poses[i]});
    if (i != 1) expected.integrate(scene.keyframe(i).depth, scene.camera, poses[i].T_world_camera);
  }
  map.set_poses(poses);
  const auto failed = map.correct(seq);
  REQUIRE_FALSE(failed);
  CHECK(failed.error().where == "frame 1");
  REQUIRE(map.correct(seq));
  CHECK(map.pending() == 0);
  CHECK(map.size() == 2);
  CHECK(ot_bytes(map.map()) == ot_bytes(expected));
  CHECK_FALSE(map.set_depth(seq, 1, scene.keyframe(1).depth));
  const auto edit_nothing = [](std::size_t, const depth_view&, const image_view<std::uint16_t>&) {};
  CHECK(map.edit_depths(seq, std::vector<std::uint64_t>{0, 1}, edit_nothing).error().code == errc::not_found);
  const auto stop = [](std::size_t, std::size_t) { return false; };
  CHECK(map.edit_depths(seq, std::vector<std::uint64_t>{0, 2}, edit_nothing, stop).error().code == errc::cancelled);

  live full{scene.camera, {.resolution = 0.05}, test::memory_depths{.images = {}, .lost = {}, .full = true}};
  CHECK_FALSE(full.add_keyframe(seq, 0, scene.keyframe(0).depth, scene.poses[0]));
  CHECK(full.contains(0));
  CHECK_FALSE(full.map().empty());
  CHECK_FALSE(full.edit_depths(seq, std::vector<std::uint64_t>{0}, edit_nothing));
  CHECK(full.contains(0));
}

TEST_CASE("Depth images of a live map are edited together or not at all") {
  const auto scene = test::wall_scene(6);
  const std::vector<std::uint64_t> all{0, 1, 2, 3, 4, 5};
  const auto edit = [](std::size_t i, const depth_view& depth, const image_view<std::uint16_t>& pixels) {
    for (int y = 0; y != 48; ++y)
      if (depth(8, y) > 0.0F) pixels(8 + static_cast<int>(i), y) = 0;
  };
  const auto edited = [&](std::size_t i) {
    auto depth = scene.depth[i];
    edit(i, depth_view{scene.depth[i].view(), 1000.0}, depth.view());
    return depth;
  };
  for (const unsigned threads : {1U, 4U}) {
    const auto policy = par.with(threads);
    live map{scene.camera, {.resolution = 0.05}};
    for (std::size_t i = 0; i != 6; ++i) REQUIRE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
    map.set_poses(std::vector<mapping::keyframe_position>{{2, se3{so3{}, vec3{std::nan(""), 0, 0}}}});
    REQUIRE(map.finish(seq));
    const auto before = ot_bytes(map.map());
    CHECK_THROWS_AS(map.edit_depths(policy, all,
                                    [&](std::size_t i, const depth_view& depth, const auto& pixels) {
                                      edit(i, depth, pixels);
                                      if (i == 0) throw std::runtime_error{"stop"};
                                    }),
                    std::runtime_error);
    for (const std::uint64_t frame : all) CHECK_FALSE(map.is_filtered(frame));
    REQUIRE(map.finish(seq));
    CHECK(ot_bytes(map.map()) == before);

    const std::size_t bytes = map.bytes();
    REQUIRE(map.edit_depths(policy, all, edit));
    CHECK(map.bytes() >= bytes + std::size_t{64} * 48 * 2 * threads);  // what is kept for the next time
    CHECK_FALSE(map.used_pose(2));                                     // it stays hidden
    map.set_poses(std::vector<mapping::keyframe_position>{{2, scene.poses[2]}});
    REQUIRE(map.finish(seq));
    octree_type expected{0.05};
    for (std::size_t i = 0; i != 6; ++i) {
      const auto depth = edited(i);
      CHECK(map.is_filtered(i));
      expected.integrate(depth_view{depth.view(), 1000.0}, scene.camera, scene.poses[i]);
    }
    CHECK(ot_bytes(map.map()) == ot_bytes(expected));
  }
  SECTION("one image is lost") {
    live map{scene.camera, {.resolution = 0.05}, test::memory_depths{.images = {}, .lost = {4}}};
    for (std::size_t i = 0; i != 6; ++i) REQUIRE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
    const auto lost = map.edit_depths(par.with(3), all, edit);
    REQUIRE_FALSE(lost);
    CHECK(lost.error().where == "frame 4");
    CHECK_FALSE(map.contains(4));
    for (const std::uint64_t frame : {0U, 1U, 2U, 3U, 5U}) CHECK(map.is_filtered(frame) == (frame < 3));
    REQUIRE(map.finish(seq));
    octree_type expected{0.05};
    for (std::size_t i = 0; i != 6; ++i) {
      const auto depth = i < 3 ? edited(i) : scene.depth[i];
      if (i != 4) expected.integrate(depth_view{depth.view(), 1000.0}, scene.camera, scene.poses[i]);
    }
    CHECK(ot_bytes(map.map()) == ot_bytes(expected));
  }
  SECTION("images that cannot be kept are told after all were edited") {
    live map{scene.camera, {.resolution = 0.05}, test::memory_depths{.images = {}, .lost = {}, .full = true}};
    for (std::size_t i = 0; i != 6; ++i) CHECK_FALSE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
    CHECK(map.edit_depths(par.with(2), all, edit).error().code == errc::write_failed);
    for (const std::uint64_t frame : all) CHECK(map.depths().images.at(frame) == edited(frame));
  }
}

TEST_CASE("A live map keeps its depth images compressed") {
  const auto scene = test::wall_scene(5);
  mapping::live_map<octree_type, camera::pinhole> map{scene.camera, {.resolution = 0.05}};
  octree_type expected{0.05};
  std::vector<mapping::keyframe_position> poses;
  for (std::size_t i = 0; i != 5; ++i) {
    REQUIRE(map.add_keyframe(seq, i, scene.keyframe(i).depth, scene.poses[i]));
    poses.push_back({i, se3{so3{}, vec3{0, 0.1, 0}} * scene.poses[i]});
    expected.integrate(scene.keyframe(i).depth, scene.camera, poses[i].T_world_camera);
  }
  map.set_poses(poses);
  REQUIRE(map.finish(par));
  CHECK(ot_bytes(map.map()) == ot_bytes(expected));
  CHECK(map.depths().size() == 5);
}
