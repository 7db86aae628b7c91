// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/voxel_layer.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

template <class Map>
void add_scans(Map& map, random_bits& random, int scans) {
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
  using model = octree::log_odds<>;
  ours.transform(
      [](float v) { return std::optional{octree::is_occupied<model>(v) ? model::clamp_max : model::clamp_min}; });
  theirs.toMaxLikelihood();
  theirs.prune();
  CHECK(ot_bytes(ours) == test::ot_of(theirs));
}

TEST_CASE("Values can be changed and forgotten all over the map") {
  random_bits random{42};
  occupancy_octree<> map{0.1};
  add_scans(map, random, 5);
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
  add_scans(map, random, 4);
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

TEST_CASE("A rolling window with a coordinate that is no number evicts nothing for it") {
  occupancy_octree<> map{0.1};
  map.integrate(std::vector<vec3f>{{1.0F, 2.0F, 0.5F}}, vec3f(0.0F, 0.0F, 0.0F), {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const vec3 far(100.0, 100.0, 100.0);
  CHECK(map.evict_outside({vec3(nan, -100.0, -100.0), vec3(nan, 100.0, 100.0)}, [](const auto&) {}) == 0);
  CHECK(map.evict_outside({far, far}, [](const auto&) {}) != 0);
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
  add_scans(map, random, 4);
  const occupancy_octree<> snapshot = map;
  const auto bytes = ot_bytes(snapshot);
  CHECK(snapshot.buffer_bytes() == 0);
  std::size_t shared = 0;
  map.for_each_leaf([&](const auto& leaf) {
    if (leaf.depth <= 13) return;
    REQUIRE(map.store().find(leaf.key) == snapshot.store().find(leaf.key));  // the same brick, not an equal one
    ++shared;
  });
  CHECK(shared > 100);
  add_scans(map, random, 4);
  CHECK(ot_bytes(snapshot) == bytes);
  CHECK(ot_bytes(map) != bytes);
  occupancy_octree<> fork = snapshot;
  add_scans(fork, random, 1);
  CHECK(ot_bytes(snapshot) == bytes);
}

TEST_CASE("Readers on other threads use snapshots while the writer goes on") {
  // The writer's map after each scan, and what a reader must find in it.
  constexpr int scans = 30;
  random_bits random{46};
  occupancy_octree<> map{0.05};
  std::mutex guard;
  std::pair<int, occupancy_octree<>> latest{0, map};
  std::vector<std::size_t> leaves(scans + 1), hits(scans + 1);
  std::atomic<bool> done{false};
  struct sight {
    int number;
    std::size_t leaves, hits;
  };
  std::vector<sight> seen[3];
  const auto rays_that_hit = [](const occupancy_octree<>& view) {
    std::size_t hit = 0;
    for (int i = 0; i != 50; ++i)
      hit +=
          view.cast_ray(vec3f{0.0F, 0.0F, 0.0F}, vec3f{1.0F, 0.02F * static_cast<float>(i), 0.1F}, 3.0, true) ? 1 : 0;
    return hit;
  };
  std::vector<std::jthread> readers;
  for (auto& mine : seen)
    readers.emplace_back([&mine, &guard, &latest, &done, &rays_that_hit] {
      while (!done) {
        std::unique_lock lock{guard};
        const auto [number, view] = latest;
        lock.unlock();
        mine.push_back({number, view.num_leaves(), rays_that_hit(view)});
      }
    });
  for (int i = 1; i <= scans; ++i) {
    add_scans(map, random, 1);
    leaves[static_cast<std::size_t>(i)] = map.num_leaves();
    hits[static_cast<std::size_t>(i)] = rays_that_hit(map);
    const std::lock_guard lock{guard};
    latest = {i, map};
  }
  done = true;
  readers.clear();
  for (const auto& mine : seen)
    for (const sight& s : mine) {
      REQUIRE(s.leaves == leaves[static_cast<std::size_t>(s.number)]);
      REQUIRE(s.hits == hits[static_cast<std::size_t>(s.number)]);
    }
  CHECK(hits.back() > 10);
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
      mirror.edit_octant(octant, [&](octree::block<float>& voxels) {
        for (std::uint64_t rest = mask; rest != 0; rest &= rest - 1) {
          const auto i = static_cast<std::uint32_t>(std::countr_zero(rest));
          const voxel_key in = morton_key(i);
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
      case 1:
        map.set_unknown_node({32768 + 400, 32768 + 8 * static_cast<std::uint32_t>(round), 32768}, 13, 0.5F);
        break;
      case 2: {
        const vec3 half = vec3::Constant(round == 2 ? 1.0 : 0.8);
        CHECK(map.evict_outside({-half, half}, [](const auto&) {}) > 0);
        add_scans(map, random, 2);
        break;
      }
      default: add_scans(map, random, 2); break;
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
  const auto summary = map.integrate(points, vec3f::Zero());
  CHECK(summary.occupied > 100);
  CHECK(summary.free == 0);  // all of them are saturated
  update();
  CHECK(sent == 0);

  const auto is_lost = [&] {  // the whole map has to be fetched
    const bool lost = map.changes().complete_since() > seen;
    seen = map.changes().revision();
    return lost;
  };
  map.set_unknown_node({0, 0, 0}, 8, 0.5F);
  CHECK(is_lost());
  map.transform([](float v) { return v == 0.5F ? std::nullopt : std::optional{v}; });  // the last large leaf goes
  CHECK(is_lost());
  CHECK_FALSE(is_lost());
  map.set_unknown_node({0, 0, 0}, 8, 0.5F);
  CHECK(is_lost());
  map.evict_outside({{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}}, [](const auto&) {});  // a large leaf with it
  CHECK(is_lost());
  CHECK(map.tracks_changes());
  map.clear();
  CHECK(is_lost());
  map.integrate(points, vec3f::Zero());
  CHECK_FALSE(is_lost());
  map = occupancy_octree<>{0.1};
  CHECK(is_lost());
  CHECK(map.tracks_changes());  // a moved-in map's own log says nothing to the readers of this one
  map.integrate(points, vec3f::Zero());
  CHECK_FALSE(is_lost());
  map = mirror;
  CHECK(is_lost());
  map.track_changes(false);
  CHECK_FALSE(map.tracks_changes());
  CHECK(is_lost());
  map.integrate(points, vec3f::Ones());
  CHECK(map.changes().memory_bytes() == 0);
  CHECK(is_lost());  // each time, as long as nothing is recorded
  map.clear();
  CHECK(is_lost());
  map = mirror;
  CHECK(is_lost());
  map.track_changes();
  CHECK(is_lost());
  const occupancy_octree<> copy = map;
  CHECK(copy.changes().revision() == 0);
}

TEST_CASE("What an edit leaves unknown is gone with its brick, and what it does not change is left alone") {
  occupancy_octree<> map{0.1};
  const voxel_key k{32768, 32768, 32768};
  map.edit_octant(k, [](octree::block<float>&) {});
  CHECK(map.empty());
  map.edit_octant(k, [](octree::block<float>& voxels) {
    for (std::size_t i = 0; i != 64; ++i) voxels.value[i] = 0.01F * static_cast<float>(i) - 1.0F;
    voxels.known = ~std::uint64_t{1};  // what the block says of its first voxel does not count
  });
  CHECK_FALSE(map.value(k));
  map.integrate(std::vector<vec3f>{{0.05F, 0.05F, 0.05F}}, vec3f{0.05F, 0.05F, 0.05F});
  CHECK(map.value(k) == log_odds<>::hit);
  map.edit_octant(k, [](octree::block<float>& voxels) {
    voxels.known = ~std::uint64_t{0};
    for (std::size_t i = 0; i != 64; ++i) voxels.value[i] = i % 2 == 0 ? 0.0F : -0.0F;
  });
  CHECK(map.num_leaves() == 1);
  map.edit_octant(k, [](octree::block<float>& voxels) { voxels.known = 0; });
  CHECK(map.empty());
  CHECK(map.num_leaves() == 0);

  map.set_unknown_node(k, 11, -0.5F);
  const std::size_t bytes = map.memory_bytes();
  map.edit_octant({k.x + 8, k.y + 4, k.z}, [](octree::block<float>& voxels) { CHECK(voxels.value[63] == -0.5F); });
  CHECK(map.memory_bytes() == bytes);
  map.edit_octant({k.x + 8, k.y + 4, k.z}, [](octree::block<float>& voxels) { voxels.value[63] = 0.5F; });
  CHECK(map.value(voxel_key{k.x + 11, k.y + 7, k.z + 3}) == 0.5F);
  CHECK(map.value(voxel_key{k.x + 10, k.y + 7, k.z + 3}) == -0.5F);
}

TEST_CASE("Pruning merges equal bricks and a scan through a saturated leaf does not split it") {
  occupancy_octree<> map{0.1};
  for (std::uint32_t i = 0; i != 512; ++i)
    map.set_unknown_node({32768 + 8 * (i % 8), 32768 + 8 * (i / 8 % 8), 32768 + 8 * (i / 64)}, 13,
                         log_odds<>::clamp_min);
  const occupancy_octree<> before = map;
  map.prune();
  CHECK(ot_bytes(map) == ot_bytes(before));
  CHECK(map.store().brick_count() == 0);
  CHECK(map.store().large_count() == 1);
  CHECK(map.memory_bytes() < before.memory_bytes() / 4);
  const std::size_t bytes = map.memory_bytes();
  const vec3f origin{0.5F, 0.5F, 0.5F}, far{1.0F, 6.7F, 1.0F};
  map.integrate(std::vector<vec3f>{far}, origin, {.max_range = 3.0});
  CHECK(map.memory_bytes() == bytes);
  map.integrate(std::vector<vec3f>{{1.0F, 2.0F, 1.0F}}, origin);
  CHECK(map.state(vec3{1.0, 2.0, 1.0}) == occupancy::free);
  CHECK(map.value(vec3{1.0, 2.0, 1.0}) == after_hit<log_odds<>>(log_odds<>::clamp_min));
  map.prune();
  CHECK(map.store().large_count() > 8);

  random_bits random{49};
  occupancy_octree<> room{0.1};
  add_scans(room, random, 8);
  const auto bytes_of_room = ot_bytes(room);
  room.prune();
  CHECK(ot_bytes(room) == bytes_of_room);
  room.prune();
  CHECK(ot_bytes(room) == bytes_of_room);
}

TEST_CASE("A moved-from map is empty and large leaves that come and go take no more memory") {
  occupancy_octree<> map{0.1};
  map.set_unknown_node({32768, 32768, 32768}, 8, 1.0F);
  occupancy_octree<> other = std::move(map);
  CHECK(map.empty());  // NOLINT(bugprone-use-after-move): that is what is promised
  CHECK_FALSE(map.store().has_large());
  CHECK(other.value(vec3{1.0, 1.0, 1.0}) == 1.0F);

  std::size_t most = 0;
  for (int i = 0; i != 3000; ++i) {
    const auto x = static_cast<std::uint32_t>(i % 50 + 1) * 256;
    other.set_unknown_node({32768 + x, 32768, 32768}, 10, 0.25F);
    const double left = 0.1 * (x - 10);
    other.evict_outside({{left, 0.0, 0.0}, {left + 10.0, 1.0, 1.0}}, [](const auto&) {});
    most = std::max(most, other.memory_bytes());
  }
  CHECK(other.store().large_count() == 1);
  CHECK(most < 20000);
}

TEST_CASE("Payload is evicted with its voxels by whoever keeps it") {
  random_bits random{50};
  occupancy_octree<> map{0.1};
  voxel_layer<std::uint32_t> layer;
  const auto points = test::shell_scan(random, 2000, vec3f::Zero());
  map.integrate(points, vec3f::Zero());
  for (const vec3f& p : points) ++layer.make(*map.grid().key(p));
  const std::size_t before = layer.size();
  map.evict_outside({{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}, [&](const auto& leaf) { layer.erase_brick(leaf.key); });
  CHECK(layer.size() < before);
  layer.for_each([&](const voxel_key& k, std::uint32_t) { REQUIRE(map.state(k) == occupancy::occupied); });
}
