// SPDX-License-Identifier: BSD-3-Clause
//
// A live map with a thread of its own: the same map, readers beside it, and a queue that tells what it leaves out.
#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdint>
#include <future>
#include <limits>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/live_map_thread.hpp>
#include <orbis/octree/files.hpp>

#include "mapping/keyframes.hpp"
#include "mapping/memory_depths.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace std::chrono_literals;
using mapping::unlisted;
using octree::ot_bytes;

namespace {

using octree_type = octree::occupancy_octree<>;
using live = mapping::live_map_thread<octree_type, camera::pinhole, test::memory_depths>;
using listeners = mapping::live_map_listeners<octree_type>;
using snapshot = mapping::live_map_snapshot<octree_type>;
using poses = std::vector<mapping::keyframe_position>;

poses shifted(const test::seen_scene& scene, std::size_t count, double x, double turn) {
  poses all;
  for (std::size_t i = 0; i != count; ++i)
    all.push_back({i, se3{so3::exp(vec3{0, turn, 0}), vec3{x, 0, 0}} * scene.poses[i]});
  return all;
}
octree_type fresh(const test::seen_scene& scene, const poses& at) {
  octree_type map{0.05};
  for (const auto& [frame, T] : at) map.integrate(scene.keyframe(frame).depth, scene.camera, T);
  return map;
}
bool add(live& map, const test::seen_scene& scene, std::size_t i) {
  return map.add_keyframe(i, scene.keyframe(i).depth, scene.poses[i]);
}

}  // namespace

TEST_CASE("Four readers see snapshots that stay as they are while the live map is corrected") {
  const auto scene = test::edge_scene(12);
  live map{scene.camera,
           {.map = {.resolution = 0.05, .tolerance = 0.0, .keyframes_per_replay = 2},
            .threads = 2,
            .correction_slice = 200us}};
  std::atomic<bool> done{false};
  std::atomic<std::size_t> looks{0}, changed{0}, unsettled{0}, backwards{0};
  std::vector<std::thread> readers;
  for (int r = 0; r != 4; ++r)
    readers.emplace_back([&, r] {
      std::uint64_t last = 0;
      while (!done) {
        const auto seen = r % 2 == 0 ? map.latest() : map.settled();
        if (seen->revision < last) ++backwards;
        last = seen->revision;
        const std::size_t leaves = seen->map.num_leaves();
        const std::string bytes = ot_bytes(seen->map);
        if (r % 2 == 1 && seen->pending != 0) ++unsettled;
        if (ot_bytes(octree_type{seen->map}) != bytes || seen->map.num_leaves() != leaves) ++changed;
        ++looks;
      }
    });
  for (std::size_t i = 0; i != 12; ++i) {
    CHECK(add(map, scene, i));
    map.set_poses(shifted(scene, i + 1, 0.01 * static_cast<double>(i), 0.01), unlisted::hide);
    map.set_robot(scene.poses[i].translation());
  }
  map.remove(4);
  for (int turn = 0; turn != 6; ++turn) {
    map.set_poses(shifted(scene, 12, 0.0, 0.01 * turn), unlisted::hide);
    std::this_thread::sleep_for(2ms);
  }
  map.wait();
  while (looks < 50) std::this_thread::yield();
  done = true;
  for (auto& r : readers) r.join();
  CHECK(changed == 0);
  CHECK(unsettled == 0);
  CHECK(backwards == 0);

  poses left = shifted(scene, 12, 0.0, 0.05);
  left.erase(left.begin() + 4);
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, left)));
  CHECK(map.latest()->keyframes == 11);
  CHECK(map.latest() == map.settled());
  CHECK(map.counters().keyframes == 12);
  CHECK(map.counters().corrections >= 1);
  CHECK(map.counters().most_waiting <= 16);
}

TEST_CASE("A live map in a thread asks for the poses itself, tells what it does, and its log makes the map") {
  const auto scene = test::edge_scene(6);
  std::mutex mutex;
  poses believed;
  bool news = false;
  std::vector<mapping::insertion_event> insertions;
  std::vector<mapping::live_correction_event> corrections;
  octree_type mirror{0.05};
  std::uint64_t seen = 0;
  std::atomic<std::size_t> voxels{0};
  listeners hear{
      .poll_poses =
          [&](mapping::keyframe_poses& now, bool always) {
            const std::lock_guard lock{mutex};
            if (news || always) now.poses = believed;
            return std::exchange(news, false) || always;
          },
      .inserted = [&](const auto& e) { insertions.push_back(e); },
      .corrected = [&](const auto& e) { corrections.push_back(e); },
      .published =
          [&](const snapshot& s, const octree::change_log& log) {
            log.for_each_since(seen, [&](const octree::voxel_key& octant, std::uint64_t mask) {
              voxels += static_cast<std::size_t>(std::popcount(mask));
              mirror.edit_octant(octant, [&](auto& b) {
                for (unsigned i = 0; i != 64; ++i) {
                  const auto in = octree::morton_key(i);
                  const auto v = s.map.value(octree::voxel_key{octant.x + in.x, octant.y + in.y, octant.z + in.z});
                  b.value[i] = v.value_or(0.0F);
                  b.known = (b.known & ~(std::uint64_t{1} << i)) | std::uint64_t{v.has_value()} << i;
                }
              });
            });
            seen = s.revision;
          }};
  live map{scene.camera, {.map = {.resolution = 0.05, .max_frames = 3}, .poll_interval = 1ms}, hear};
  for (std::size_t i = 0; i != 4; ++i) {
    const std::lock_guard lock{mutex};
    believed.push_back({i, scene.poses[i]});
    CHECK(add(map, scene, i));
  }
  CHECK(map.add_frame(4, scene.keyframe(4).depth, 3, scene.poses[3].inverse() * scene.poses[4]));
  map.wait();
  CHECK(map.latest()->frames == 1);
  {
    const std::lock_guard lock{mutex};
    believed = shifted(scene, 4, 0.1, 0.0);
    believed.erase(believed.begin() + 1);  // as if it belonged to another map
    news = true;
  }
  map.finish();
  CHECK(map.latest()->keyframes == 4);
  CHECK(map.latest()->frames == 0);
  const std::string now = ot_bytes(map.latest()->map);
  CHECK(now == ot_bytes(fresh(scene, believed)));
  auto& inner = map.stop();
  CHECK(ot_bytes(inner.map()) == now);
  CHECK(ot_bytes(mirror) == now);
  CHECK(voxels > 1000);
  REQUIRE(insertions.size() == 5);
  CHECK((insertions[2].frame == 2 && insertions[2].is_keyframe && insertions[2].milliseconds > 0));
  for (const auto& e : insertions) CHECK(e.delay_milliseconds >= e.milliseconds);
  CHECK((insertions[4].frame == 4 && !insertions[4].is_keyframe));
  CHECK_FALSE(add(map, scene, 5));  // stopped
}

TEST_CASE("Frames give way before keyframes where a live map falls behind, and each is told") {
  const auto scene = test::wall_scene(12);
  std::promise<void> begun, go;
  std::shared_future<void> wait_for_go = go.get_future().share();
  std::vector<mapping::overflow_event> left_out;
  listeners hear{.inserted =
                     [&](const mapping::insertion_event& e) {
                       if (e.frame != 0) return;
                       begun.set_value();
                       wait_for_go.wait();
                     },
                 .overflowed = [&](const auto& e) { left_out.push_back(e); }};
  live map{scene.camera, {.map = {.resolution = 0.05, .max_frames = 10}, .max_waiting = 3, .patience = 1ms}, hear};
  const auto add_frame = [&](std::size_t i) { return map.add_frame(i, scene.keyframe(i).depth, 0, se3{}); };
  REQUIRE(add(map, scene, 0));
  begun.get_future().wait();  // from now on the map's thread is busy
  for (const std::size_t i : {1U, 2U, 3U}) CHECK(add_frame(i));
  CHECK(left_out.empty());
  CHECK(add_frame(4));  // instead of 1
  CHECK(add(map, scene, 5));
  CHECK(add(map, scene, 6));
  CHECK(add(map, scene, 7));  // instead of 2, 3 and 4
  CHECK_FALSE(add_frame(8));
  CHECK_FALSE(add(map, scene, 9));
  using mapping::depth_use;
  std::vector<std::pair<std::uint64_t, depth_use>> told;
  for (const auto& e : left_out) told.emplace_back(e.frame, e.use);
  CHECK(told == std::vector<std::pair<std::uint64_t, depth_use>>{{1, depth_use::frame},
                                                                 {2, depth_use::frame},
                                                                 {3, depth_use::frame},
                                                                 {4, depth_use::frame},
                                                                 {8, depth_use::frame},
                                                                 {9, depth_use::keyframe}});
  go.set_value();
  map.wait();
  const auto counters = map.counters();
  CHECK(counters.keyframes == 4);
  CHECK(counters.frames == 0);
  CHECK(counters.dropped_frames == 5);
  CHECK(counters.dropped_keyframes == 1);
  CHECK(counters.most_waiting == 3);
  poses there;
  for (const std::uint64_t i : {0U, 5U, 6U, 7U}) there.push_back({i, scene.poses[i]});
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, there)));
}

TEST_CASE("A live map in a thread tells of lost depth images and goes on") {
  const auto scene = test::wall_scene(4);
  std::vector<std::string> where;
  listeners hear{.failed = [&](const error& e) { where.push_back(e.where); }};
  live map{scene.camera, {.map = {.resolution = 0.05}}, hear, test::memory_depths{.images = {}, .lost = {1, 2}}};
  for (std::size_t i = 0; i != 4; ++i) CHECK(add(map, scene, i));
  map.set_poses(shifted(scene, 4, 0.2, 0.0));
  map.wait();
  map.finish();
  poses there = shifted(scene, 4, 0.2, 0.0);
  there.erase(there.begin() + 1, there.begin() + 3);
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, there)));
  std::sort(where.begin(), where.end());
  CHECK(where == std::vector<std::string>{"frame 1", "frame 2"});
}

TEST_CASE("A live map tells which frames between keyframes it does not take") {
  const auto scene = test::wall_scene(4);
  std::vector<mapping::refusal_event> refused;
  listeners hear{.refused = [&](const auto& e) { refused.push_back(e); }};
  live map{scene.camera, {.map = {.resolution = 0.05, .max_frames = 3}}, hear};
  CHECK(add(map, scene, 0));
  for (const std::size_t i : {1U, 2U}) CHECK(map.add_frame(i, scene.keyframe(i).depth, i - 1, se3{}));
  map.wait();
  REQUIRE(refused.size() == 1);
  CHECK((refused[0].frame == 2 && refused[0].keyframe == 1));
  CHECK(map.counters().refused_frames == 1);
  CHECK(map.counters().frames == 1);
}

TEST_CASE("A live map's thread prepares depth images before they go in") {
  const auto scene = test::wall_scene(3);
  const auto caller = std::this_thread::get_id();
  bool elsewhere = true;
  std::vector<mapping::depth_use> uses;
  listeners hear{.prepare = [&](std::uint64_t, mapping::depth_use use, image_view<std::uint16_t> pixels) {
    elsewhere = elsewhere && std::this_thread::get_id() != caller;
    uses.push_back(use);
    for (int y = 0; y != pixels.height(); ++y)
      for (int x = 0; x != 20; ++x) pixels(x, y) = 0;
  }};
  live map{scene.camera, {.map = {.resolution = 0.05, .max_frames = 3}}, hear};
  CHECK(add(map, scene, 0));
  CHECK(map.add_frame(1, scene.keyframe(1).depth, 0, se3{}));
  map.wait();
  using mapping::depth_use;
  CHECK(elsewhere);
  CHECK(uses == std::vector{depth_use::keyframe, depth_use::frame});
  octree_type expected{0.05};
  image<std::uint16_t> pixels = scene.depth[0];
  for (int y = 0; y != pixels.height(); ++y)
    for (int x = 0; x != 20; ++x) pixels(x, y) = 0;
  expected.integrate(camera::depth_view<std::uint16_t>(pixels.view(), 1000.0), scene.camera, scene.poses[0]);
  map.finish();
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(expected));
}

TEST_CASE("A keyframe that comes with the pose of before a correction is judged at its pose of now") {
  const auto scene = test::wall_scene(3);
  std::mutex mutex;
  mapping::keyframe_poses now;
  listeners hear{.poll_poses = [&](mapping::keyframe_poses& told, bool) {
    const std::lock_guard lock{mutex};
    told = now;
    return true;
  }};
  // Nothing is asked for but what keyframes need.
  live map{
      scene.camera,
      {.map = {.resolution = 0.05, .tolerance = 0.0}, .poll_interval = 1h, .moving = mapping::moving_filter_options{}},
      hear};
  const auto tell = [&](std::uint64_t frame, const se3& T_world_camera) {
    const std::lock_guard lock{mutex};
    now.poses.push_back({frame, T_world_camera});
  };
  for (const std::size_t i : {0U, 1U}) {
    tell(i, scene.poses[i]);
    CHECK(add(map, scene, i));
  }
  map.wait();
  const se3 correction{so3{}, vec3{0, 0, -0.6}};
  {
    const std::lock_guard lock{mutex};
    for (auto& p : now.poses) p.T_world_camera = correction * p.T_world_camera;
  }
  map.wait();  // the map has followed
  tell(2, correction * scene.poses[2]);
  CHECK(add(map, scene, 2));  // tracked before the correction
  map.finish();
  const auto& inner = map.stop();
  for (const std::uint64_t frame : {0U, 1U, 2U}) CHECK_FALSE(inner.is_filtered(frame));
  CHECK(ot_bytes(inner.map()) == ot_bytes(fresh(scene, now.poses)));
}

TEST_CASE("However short a slice of time is, judgements and corrections come to their end") {
  const auto scene = test::wall_scene(4);
  live map{scene.camera,
           {.map = {.resolution = 0.05, .tolerance = 0.0},
            .correction_slice = 0us,
            .moving = mapping::moving_filter_options{}}};
  for (std::size_t i = 0; i != 4; ++i) CHECK(add(map, scene, i));
  const se3 correction{so3{}, vec3{0, 0, -0.6}};
  std::vector<mapping::keyframe_position> poses;
  for (std::size_t i = 0; i != 4; ++i) poses.push_back({i, correction * scene.poses[i]});
  map.set_poses(poses);
  map.wait();
  CHECK(map.latest()->pending == 0);
  CHECK(ot_bytes(map.stop().map()) == ot_bytes(fresh(scene, poses)));
}

TEST_CASE("A keyframe that is gone when its pose is asked for does not go in") {
  const auto scene = test::wall_scene(2);
  std::mutex mutex;
  int asked = 0;
  listeners hear{.poll_poses = [&](mapping::keyframe_poses& told, bool) {
    const std::lock_guard lock{mutex};
    told.poses.push_back({0, scene.poses[0]});
    if (++asked > 1) return true;
    told.removed.push_back(1);  // said once
    return true;
  }};
  live map{scene.camera,
           {.map = {.resolution = 0.05}, .poll_interval = 1h, .moving = mapping::moving_filter_options{}},
           hear};
  map.wait();  // the thread asks when it starts
  {
    const std::lock_guard lock{mutex};
    asked = 0;
  }
  CHECK(add(map, scene, 1));
  map.wait();
  CHECK(add(map, scene, 0));
  map.finish();
  CHECK(map.latest()->keyframes == 1);
  CHECK(map.counters().keyframes == 1);
  CHECK(ot_bytes(map.stop().map()) == ot_bytes(fresh(scene, {{0, scene.poses[0]}})));
}

TEST_CASE("Keyframes that will never come back lose their depth images, hidden ones keep them") {
  const auto scene = test::wall_scene(5);
  std::promise<void> begun, go;
  std::shared_future<void> wait_for_go = go.get_future().share();
  std::mutex mutex;
  mapping::keyframe_poses believed;
  listeners hear{.poll_poses =
                     [&](mapping::keyframe_poses& now, bool) {
                       const std::lock_guard lock{mutex};
                       now = believed;
                       return true;
                     },
                 .inserted =
                     [&](const mapping::insertion_event& e) {
                       if (e.frame != 2) return;
                       begun.set_value();
                       wait_for_go.wait();
                     }};
  live map{scene.camera, {.map = {.resolution = 0.05}}, hear};
  for (const std::size_t i : {0U, 1U, 2U}) CHECK(add(map, scene, i));
  begun.get_future().wait();
  CHECK(add(map, scene, 3));  // gone before the map has seen it
  CHECK(add(map, scene, 4));
  {
    const std::lock_guard lock{mutex};
    believed = {.poses = {{0, scene.poses[0]}, {4, scene.poses[4]}}, .removed = {1, 3}};
  }
  go.set_value();
  map.wait();
  map.finish();
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, {{0, scene.poses[0]}, {4, scene.poses[4]}})));
  const auto& images = map.stop().depths().images;
  CHECK(images.size() == 3);
  CHECK((images.contains(0) && images.contains(2) && images.contains(4)));
}

TEST_CASE("An exception on a live map's thread ends it in order") {
  const auto scene = test::wall_scene(6);
  const auto throws_at = [&](auto what, bool tells) {
    std::vector<std::string> told;
    listeners hear{.prepare =
                       [&](std::uint64_t frame, mapping::depth_use, image_view<std::uint16_t>) {
                         if (frame == 2) what();
                       },
                   .failed =
                       [&](const error& e) {
                         told.push_back(e.to_string());
                         if (!tells) throw 3;
                       }};
    live map{scene.camera, {.map = {.resolution = 0.05}, .max_waiting = 2, .patience = 60s}, hear};
    bool all = true;
    for (std::size_t i = 0; i != 6; ++i) all = add(map, scene, i) && all;  // nobody waits for a thread that ended
    map.wait();
    map.finish();
    CHECK_FALSE(add(map, scene, 5));
    CHECK_FALSE(all);
    const auto why = map.failure();
    REQUIRE(why);
    CHECK(why->code == errc::exception);
    map.stop();
    CHECK(told == std::vector{why->to_string()});
    // What readers see is what was there before.
    CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, {{0, scene.poses[0]}, {1, scene.poses[1]}})));
    return why->message;
  };
  CHECK(throws_at([] { throw std::bad_alloc{}; }, true) == std::bad_alloc{}.what());
  CHECK(throws_at([] { throw std::runtime_error{"a longer text than fits into a string itself"}; }, true) ==
        "a longer text than fits into a string itself");
  CHECK(throws_at([] { throw 3; }, false) == "unknown");

  live fine{scene.camera, {.map = {.resolution = 0.05}}};
  CHECK(add(fine, scene, 0));
  fine.finish();
  CHECK_FALSE(fine.failure());
}

TEST_CASE("A request to stop waits for nothing, ends the waiting, and the thread ends after its step") {
  const auto scene = test::wall_scene(3);
  std::promise<void> begun, go;
  std::shared_future<void> wait_for_go = go.get_future().share();
  listeners hear{.prepare = [&](std::uint64_t frame, mapping::depth_use, image_view<std::uint16_t>) {
    if (frame != 0) return;
    begun.set_value();
    wait_for_go.wait();
  }};
  live map{scene.camera, {.map = {.resolution = 0.05}}, hear};
  for (std::size_t i = 0; i != 3; ++i) CHECK(add(map, scene, i));
  auto waiting = std::async(std::launch::async, [&] { map.wait(); });
  begun.get_future().wait();
  map.request_stop();  // neither this nor the next two could end if they waited for the step
  waiting.get();
  CHECK_FALSE(add(map, scene, 2));
  go.set_value();
  CHECK(map.stop().size() == 1);
  CHECK_FALSE(map.failure());
}

TEST_CASE("Poses told while a live map is busy are those of the last call") {
  const auto scene = test::wall_scene(3);
  std::promise<void> begun, go;
  std::shared_future<void> wait_for_go = go.get_future().share();
  listeners hear{.inserted = [&](const mapping::insertion_event& e) {
    if (e.frame != 0) return;
    begun.set_value();
    wait_for_go.wait();
  }};
  live map{scene.camera, {.map = {.resolution = 0.05}}, hear};
  for (const std::size_t i : {0U, 1U, 2U}) CHECK(add(map, scene, i));
  begun.get_future().wait();
  for (int turn = 0; turn != 2000; ++turn)
    map.set_poses(
        {{static_cast<std::uint64_t>(turn % 3), shifted(scene, 3, 0.001 * turn, 0.0)[turn % 3].T_world_camera}});
  map.remove(1);
  go.set_value();
  map.finish();
  const poses last{{0, shifted(scene, 3, 0.001 * 1998, 0.0)[0].T_world_camera},
                   {2, shifted(scene, 3, 0.001 * 1997, 0.0)[2].T_world_camera}};
  CHECK(ot_bytes(map.latest()->map) == ot_bytes(fresh(scene, last)));
}
