// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <bit>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/octree/occupancy_octree.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

template <class Map>
void scan(Map& map, random_bits& random, int scans) {
  for (int i = 0; i != scans; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.4)[0];
    map.integrate(test::shell_scan(random, 600, origin), origin);
  }
}

}  // namespace

TEST_CASE("Maximum likelihood is OctoMap's") {
  random_bits random{41};
  occupancy_octree<> ours{0.1};
  octomap::OcTree theirs{0.1};
  for (int i = 0; i != 6; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.4)[0];
    const auto points = test::shell_scan(random, 600, origin);
    ours.integrate(points, origin);
    test::insert(theirs, points, origin, {});
  }
  ours.to_maximum_likelihood();
  theirs.toMaxLikelihood();
  theirs.prune();
  CHECK(ot_bytes(ours) == test::ot_of(theirs));
}

TEST_CASE("Values can be changed and forgotten all over the map") {
  random_bits random{42};
  occupancy_octree<> map{0.1};
  scan(map, random, 5);
  const occupancy_octree<> before = map;
  map.transform([](float v) { return v < -1.0F ? std::nullopt : std::optional{v * 0.5F}; });
  std::size_t halved = 0, forgotten = 0;
  for (int i = 0; i != 50000; ++i) {
    const vec3f p = test::random_points(random, 1, 2.2)[0];
    const auto v = before.value(p);
    REQUIRE(map.value(p) == (!v || *v < -1.0F ? std::nullopt : std::optional{*v * 0.5F}));
    halved += v && *v >= -1.0F ? 1 : 0;
    forgotten += v && *v < -1.0F ? 1 : 0;
  }
  CHECK(halved > 1000);
  CHECK(forgotten > 100);
  map.transform([](float) { return std::optional<float>{}; });
  CHECK(map.empty());
  CHECK(map.num_leaves() == 0);
}

TEST_CASE("A rolling window evicts what lies outside and takes it back") {
  random_bits random{43};
  occupancy_octree<> map{0.05};
  scan(map, random, 4);
  map.set_unknown_node({32768 + 1024, 32768, 32768}, 10, -0.5F);  // a large leaf, 51 m away
  const auto whole = ot_bytes(map);
  const std::size_t leaves = map.num_leaves();
  const bounding_box window{{-0.5, -0.4, -0.3}, {0.6, 0.7, 0.8}};

  std::vector<occupancy_octree<>::leaf> evicted;
  const std::size_t bricks = map.evict_outside(window, [&](const auto& leaf) { evicted.push_back(leaf); });
  CHECK(bricks > 10);
  CHECK(evicted.size() > 1000);
  CHECK(map.num_leaves() < leaves);
  for (const auto& leaf : evicted) {
    REQUIRE(map.state(leaf.center) == occupancy::unknown);
    REQUIRE(((leaf.center.array() + leaf.size / 2 < window.min.array() + 1e-9).any() ||
             (leaf.center.array() - leaf.size / 2 > window.max.array() - 1e-9).any()));
  }
  map.for_each_leaf([&](const auto& leaf) {
    // A brick stays if any of it is in the window.
    const double brick = 8 * map.resolution();
    REQUIRE((leaf.center.array() > window.min.array() - brick).all());
    REQUIRE((leaf.center.array() < window.max.array() + brick).all());
  });
  CHECK(map.evict_outside(window, [](const auto&) { FAIL("nothing is left to evict"); }) == 0);

  for (const auto& leaf : evicted) map.set_unknown_node(leaf.key, leaf.depth, leaf.log_odds);
  CHECK(ot_bytes(map) == whole);
}

TEST_CASE("Memory stays bounded behind a rolling window") {
  random_bits random{44};
  occupancy_octree<> map{0.1};
  std::size_t most = 0, after_ten = 0;
  for (int i = 0; i != 60; ++i) {
    const vec3f origin{2.0F * static_cast<float>(i), 0.0F, 0.0F};
    auto points = test::random_points(random, 300, 2.0);
    for (vec3f& p : points) p += origin;
    map.integrate(points, origin);
    const vec3 o = origin.cast<double>();
    map.evict_outside({o - vec3::Constant(3.0), o + vec3::Constant(3.0)}, [](const auto&) {});
    most = std::max(most, map.memory_bytes());
    if (i == 10) after_ten = most;
  }
  CHECK(most < after_ten + after_ten / 2);
}

TEST_CASE("A copy is a snapshot that does not change and costs little memory of its own") {
  random_bits random{45};
  occupancy_octree<> map{0.05};
  scan(map, random, 4);
  const occupancy_octree<> snapshot = map;
  const auto bytes = ot_bytes(snapshot);
  CHECK(snapshot.buffer_bytes() == 0);
  scan(map, random, 4);
  CHECK(ot_bytes(snapshot) == bytes);
  CHECK(ot_bytes(map) != bytes);
  occupancy_octree<> fork = snapshot;
  scan(fork, random, 1);
  CHECK(ot_bytes(snapshot) == bytes);
}

TEST_CASE("Readers on other threads use snapshots while the writer goes on") {
  // The writer's map after each scan, and what a reader must find in it.
  constexpr int scans = 30;
  random_bits random{46};
  occupancy_octree<> map{0.05};
  std::mutex guard;
  std::pair<int, occupancy_octree<>> latest{0, map};
  std::vector<std::size_t> leaves(scans + 1);
  std::atomic<bool> done{false};
  std::vector<std::pair<int, std::size_t>> seen[3];
  std::vector<std::jthread> readers;
  for (auto& mine : seen)
    readers.emplace_back([&mine, &guard, &latest, &done] {
      while (!done) {
        std::unique_lock lock{guard};
        const auto [number, view] = latest;
        lock.unlock();
        std::size_t hits = 0;
        for (int i = 0; i != 50; ++i)
          hits += view.cast_ray(vec3f{0.0F, 0.0F, 0.0F}, vec3f{1.0F, 0.02F * static_cast<float>(i), 0.1F}, 3.0, true) ? 1 : 0;
        mine.emplace_back(number, view.num_leaves() + (hits > 50 ? 1 : 0));
      }
    });
  for (int i = 1; i <= scans; ++i) {
    scan(map, random, 1);
    leaves[static_cast<std::size_t>(i)] = map.num_leaves();
    const std::lock_guard lock{guard};
    latest = {i, map};
  }
  done = true;
  readers.clear();
  for (const auto& mine : seen)
    for (const auto& [number, count] : mine) REQUIRE(count == leaves[static_cast<std::size_t>(number)]);
}

TEST_CASE("Maps of integers are maps too and take less memory") {
  random_bits random{47};
  occupancy_octree<> floats{0.05};
  occupancy_octree<log_odds<std::int16_t>> shorts{0.05};
  occupancy_octree<log_odds<std::int8_t>> bytes{0.05};
  for (int i = 0; i != 8; ++i) {
    const vec3f origin = test::random_points(random, 1, 0.4)[0];
    const auto points = test::shell_scan(random, 1500, origin);
    floats.integrate(points, origin);
    shorts.integrate(points, origin);
    bytes.integrate(points, origin);
  }
  CHECK(shorts.memory_bytes() < floats.memory_bytes());
  CHECK(bytes.memory_bytes() < shorts.memory_bytes());
  std::size_t known = 0, differ = 0;
  for (int i = 0; i != 50000; ++i) {
    const vec3f p = test::random_points(random, 1, 2.2)[0];
    const auto v = floats.log_odds(p);
    REQUIRE(shorts.log_odds(p).has_value() == v.has_value());
    REQUIRE(bytes.log_odds(p).has_value() == v.has_value());
    if (!v) continue;
    ++known;
    REQUIRE(std::abs(*shorts.log_odds(p) - *v) < 0.02F);
    REQUIRE(std::abs(*bytes.log_odds(p) - *v) < 0.2F);
    differ += floats.state(p) != shorts.state(p) ? 1 : 0;
  }
  CHECK(known > 5000);
  CHECK(differ < known / 100);
}

TEST_CASE("A deeper tree holds what lies further away") {
  occupancy_octree<> usual{0.01}, deep{0.01, 21};
  const std::vector<vec3f> points{{8000.0F, 0.0F, 1.0F}};
  const vec3f origin{7999.0F, 0.0F, 1.0F};
  CHECK(usual.integrate(points, origin).rejected == 1);
  const auto summary = deep.integrate(points, origin);
  CHECK(summary.rejected == 0);
  CHECK(summary.free > 90);
  CHECK(deep.state(points[0]) == occupancy::occupied);
  CHECK(deep.state(vec3{7999.5, 0.0, 1.0}) == occupancy::free);
  CHECK(deep.cast_ray(origin, vec3f{1.0F, 0.0F, 0.0F}));
  int occupied = 0;
  deep.for_each_leaf([&](const auto& leaf) { occupied += leaf.occupied && leaf.depth == 21 ? 1 : 0; });
  CHECK(occupied == 1);
}

TEST_CASE("A mirror that applies the logged changes stays the same map") {
  random_bits random{48};
  occupancy_octree<> map{0.1}, mirror{0.1};
  std::uint64_t seen = 0;
  map.track_changes();
  std::size_t sent = 0, known = 0;
  const auto update = [&] {
    map.changes().for_each_since(seen, [&](const voxel_key& octant, std::uint64_t mask) {
      sent += static_cast<std::size_t>(std::popcount(mask));
      mirror.edit_octant(octant, [&](block<float>& voxels) {
        for (std::uint64_t rest = mask; rest != 0; rest &= rest - 1) {
          const auto i = static_cast<std::uint32_t>(std::countr_zero(rest));
          const voxel_key in = voxel_in_brick(i);
          const auto v = map.value(voxel_key{octant.x + in.x, octant.y + in.y, octant.z + in.z});
          voxels.value[i] = v.value_or(0.0F);
          voxels.known = (voxels.known & ~(std::uint64_t{1} << i)) | std::uint64_t{v.has_value()} << i;
        }
      });
    });
    seen = map.changes().revision();
    map.changes().forget_before(seen);
    REQUIRE(ot_bytes(mirror) == ot_bytes(map));
  };
  for (int round = 0; round != 12; ++round) {
    switch (round % 4) {
      case 0: map.transform([](float v) { return v > 2.0F ? std::nullopt : std::optional{v * 0.75F}; }); break;
      case 1: map.set_unknown_node({32768 + 400, 32768 + 8 * static_cast<std::uint32_t>(round), 32768}, 13, 0.5F); break;
      default: scan(map, random, 2); break;
    }
    update();
    known += map.num_leaves();
  }
  CHECK(sent > 1000);
  CHECK(known > 1000);

  // In a room that is known already hardly anything changes, and no more than that is sent.
  const auto points = test::shell_scan(random, 600, vec3f::Zero());
  for (int i = 0; i != 20; ++i) map.integrate(points, vec3f::Zero());
  update();
  sent = 0;
  CHECK(map.integrate(points, vec3f::Zero()).free > 1000);
  update();
  CHECK(sent == 0);

  map.set_unknown_node({0, 0, 0}, 8, 0.5F);
  CHECK(map.changes().complete_since() > seen);  // too large for the log: fetch the whole map
  map.track_changes(false);
  map.integrate(points, vec3f::Ones());
  CHECK(map.changes().memory_bytes() == 0);
}
