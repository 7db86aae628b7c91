// SPDX-License-Identifier: BSD-3-Clause
//
// After any calls, a history's map is the one made of its scans in order.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/files-inl.hpp>
#include <orbis/octree/scan_history-inl.hpp>

#include "octree/support.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"
#include "support/random_motion.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

const camera::pinhole small_camera{96, 72, 80.0, 80.0, 47.5, 35.5};

/// A wavy wall with a hole and a column in front of it.
image<float> wavy_depth(random_bits& random) {
  image<float> depth(96, 72);
  const double phase = random.uniform(0.0, 6.0), column = random.uniform(10.0, 80.0);
  for (int y = 0; y != 72; ++y)
    for (int x = 0; x != 96; ++x) {
      const double wall = 2.0 + 0.3 * std::sin(0.1 * x + phase) + 0.2 * std::cos(0.07 * y - phase);
      const bool hole = x > 60 && x < 70 && y > 20 && y < 40;
      depth(x, y) = hole ? 0.0F : static_cast<float>(std::abs(x - column) < 4 ? 1.1 : wall);
    }
  return depth;
}

struct view {
  image<float> depth;  ///< empty: points
  std::vector<vec3f> points;
  se3 T_world_camera;
};
view random_scan(random_bits& random) {
  const se3 pose = test::random_motion(random, 0.4, 0.5);
  if (random.below(4) != 0) return {wavy_depth(random), {}, pose};
  const vec3f origin = pose.translation().cast<float>();
  return {{}, test::shell_scan(random, 300, origin), pose};
}
template <class Policy, class Map, class... Frame>
void put(const Policy& policy, Map& map, const view& s, const integration_options& options, Frame... frame) {
  constexpr bool is_history = sizeof...(Frame) == 1;
  const auto call = [&](auto&&... what) {
    if constexpr (is_history)
      map.set(policy, frame..., what..., options);
    else
      map.integrate(policy, what..., options);
  };
  if (s.depth.empty())
    call(s.points, s.T_world_camera.translation());
  else
    call(camera::depth_view(s.depth), small_camera, s.T_world_camera);
}

template <class Octree>
Octree map_of(const std::map<std::uint64_t, view>& scans, const integration_options& options) {
  Octree map{0.1};
  for (const auto& [frame, s] : scans) put(seq, map, s, options);
  return map;
}

/// Follows a map by its change log alone.
template <class Octree>
class mirror {
 public:
  explicit mirror(const Octree& map) : copy_{map} {}
  /// Takes over what changed since the last time. Every voxel that the log names must differ if `exact`.
  void follow(const Octree& map, const change_log& log, bool exact) {
    using value = typename Octree::value_type;
    std::size_t same = 0;
    log.for_each_since(seen_, [&](const voxel_key& octant, std::uint64_t mask) {
      octree::block<value> now;
      for (unsigned i = 0; i != 64; ++i) {
        const voxel_key in = morton_key(i), k{octant.x + in.x, octant.y + in.y, octant.z + in.z};
        const auto v = map.value(k);
        now.value[i] = v.value_or(value{});
        now.known |= std::uint64_t{v.has_value()} << i;
        if ((mask >> i & 1U) != 0 && copy_.value(k) == v) ++same;
      }
      copy_.edit_octant(octant, [&](octree::block<value>& b) {
        for (unsigned i = 0; i != 64; ++i) {
          if ((mask >> i & 1U) == 0) continue;
          b.value[i] = now.value[i];
          b.known = (b.known & ~(std::uint64_t{1} << i)) | (now.known & std::uint64_t{1} << i);
        }
      });
    });
    if (exact) REQUIRE(same == 0);
    seen_ = log.revision();
    REQUIRE(ot_bytes(copy_) == ot_bytes(map));
  }

 private:
  Octree copy_;
  std::uint64_t seen_ = 0;
};

/// Any scans, changes, removals and replays.
template <class Model>
std::string check_random_calls(const parallel_policy& policy, std::uint64_t seed, std::size_t bricks,
                               const integration_options& options) {
  using octree_type = occupancy_octree<Model>;
  random_bits random{seed};
  random_bits budgets{mix64(bricks)};
  scan_history<octree_type> history{0.1};
  std::map<std::uint64_t, view> scans;
  mirror<octree_type> follower{history.map()};
  std::size_t replayed = 0;
  for (int step = 0; step != 60; ++step) {
    const std::uint64_t frame = 7 + random.below(12) * (std::uint64_t{1} << 40U);
    switch (random.below(4)) {
      case 0: REQUIRE(history.remove(frame) == (scans.erase(frame) != 0)); break;
      case 1:
        if (const auto at = scans.find(frame);
            at != scans.end()) {  // a small correction, or pixels that are not trusted
          if (!at->second.depth.empty() && random.below(2) == 0)
            for (int y = 10; y != 40; ++y) at->second.depth(30, y) = 0.0F;
          else
            at->second.T_world_camera = test::random_motion(random, 0.02, 0.01) * at->second.T_world_camera;
          put(policy, history, at->second, options, frame);
          break;
        }
        [[fallthrough]];
      default: scans[frame] = random_scan(random); put(policy, history, scans[frame], options, frame);
    }
    follower.follow(history.map(), history.changes(), true);
    if (budgets.below(3) == 0) {
      const std::size_t stale = history.stale_bricks();
      const std::size_t done = history.replay(policy, {.bricks = bricks});
      REQUIRE(done == std::min(stale, bricks));
      REQUIRE(history.stale_bricks() == stale - done);
      replayed += done;
      follower.follow(history.map(), history.changes(), true);
    }
    REQUIRE(history.size() == scans.size());
    REQUIRE(history.contains(frame) == scans.contains(frame));
    if (step % 10 == 9) {
      while (history.stale_bricks() != 0) replayed += history.replay(policy, {.bricks = bricks});
      follower.follow(history.map(), history.changes(), false);
      REQUIRE(ot_bytes(history.map()) == ot_bytes(map_of<octree_type>(scans, options)));
    }
  }
  CHECK(replayed > 100);
  return ot_bytes(history.map());
}

constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

struct doubtful : octomap_probabilities {
  static constexpr double hit = 0.6, clamp_max = 0.9;
};
using in_float = log_odds<>;
using unsure = sensor_model_from<doubtful>;

}  // namespace

TEMPLATE_TEST_CASE("A history's map is that of its scans in order, whatever happened to them", "", in_float, unsure) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const integration_options options{.max_range = seed == 1 ? 5.0 : 1.9};
    const std::string once = check_random_calls<TestType>(par.with(1), seed, all, options);
    for (const std::size_t bricks : {std::size_t{1}, std::size_t{17}})
      CHECK(check_random_calls<TestType>(par.with(1), seed, bricks, options) == once);
    CHECK(check_random_calls<TestType>(par.with(3), seed, 100, options) == once);
  }
}

TEST_CASE("A history's map is that of its scans in every mode of integration") {
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized})
    check_random_calls<log_odds<>>(par.with(2), 3, all, {.max_range = 1.9, .mode = mode});
}

TEST_CASE("The newest scan is in a history's map at once, an older one after a replay") {
  random_bits random{5};
  scan_history<> history{0.05};
  occupancy_octree<> map{0.05};
  for (std::uint64_t frame = 10; frame != 16; ++frame) {
    const view s{wavy_depth(random), {}, test::random_motion(random, 0.2, 0.2)};
    const auto got = history.set(seq, frame, camera::depth_view(s.depth), small_camera, s.T_world_camera);
    map.integrate(camera::depth_view(s.depth), small_camera, s.T_world_camera);
    const auto [free, occupied] = history.find_scan(frame)->counts();
    CHECK(got.free == free);
    CHECK(got.occupied == occupied);
    CHECK(history.stale_bricks() == 0);
    CHECK(ot_bytes(history.map()) == ot_bytes(map));
  }
  const std::string before = ot_bytes(history.map());
  const occupancy_octree<> snapshot = history.map();
  const view late{wavy_depth(random), {}, test::random_motion(random, 0.2, 0.2)};
  history.set(seq, 3, camera::depth_view(late.depth), small_camera, late.T_world_camera);
  CHECK(history.stale_bricks() > 10);
  history.replay(seq, {.time = std::chrono::nanoseconds{0}});  // does something even so
  CHECK(history.stale_bricks() > 0);
  history.replay(seq);
  CHECK(history.stale_bricks() == 0);
  CHECK(ot_bytes(history.map()) != before);
  CHECK(ot_bytes(snapshot) == before);
  CHECK(history.remove(3));
  history.replay(seq);
  CHECK(ot_bytes(history.map()) == before);
}

TEST_CASE("What stays as it was is not replayed, and nothing is left of a history without scans") {
  random_bits random{6};
  scan_history<> history{0.05};
  std::vector<view> scans;
  for (std::uint64_t frame = 0; frame != 5; ++frame) {
    scans.push_back(random_scan(random));
    put(seq, history, scans.back(), {}, frame);
  }
  const std::uint64_t revision = history.changes().revision();
  put(seq, history, scans[2], {}, std::uint64_t{2});
  CHECK(history.stale_bricks() == 0);
  CHECK(history.changes().revision() == revision);
  CHECK(history.replay(seq) == 0);
  const std::size_t bytes = history.bytes();
  for (int round = 0; round != 3; ++round) {
    for (std::uint64_t frame = 0; frame != 5; ++frame) CHECK(history.remove(frame));
    CHECK_FALSE(history.remove(0));
    history.replay(seq);
    CHECK(history.map().empty());
    CHECK(history.size() == 0);
    for (std::uint64_t frame = 5; frame != 0; --frame) put(seq, history, scans[frame - 1], {}, frame - 1);
    history.replay(seq);
  }
  CHECK(history.bytes() < 3 * bytes);
}

TEST_CASE("Marked voxels are packed without loss, and replaying allocates nothing") {
  random_bits random{8};
  scan_marker marker;
  scan_history<> history{0.05};
  scan voxels;
  occupancy_octree<> integrated{0.05}, applied{0.05};
  std::vector<view> scans;
  for (std::uint64_t frame = 0; frame != 8; ++frame) {
    scans.push_back({wavy_depth(random), {}, test::random_motion(random, 0.2, 0.2)});
    const auto& s = scans.back();
    const auto got =
        marker.mark(seq, history.grid(), camera::depth_view(s.depth), small_camera, s.T_world_camera, {}, voxels);
    occupancy_octree<> alone{0.05};
    alone.integrate(camera::depth_view(s.depth), small_camera, s.T_world_camera);
    std::size_t free = 0, occupied = 0;
    bool right = true;
    for (const auto& p : voxels.parts())
      voxels.for_each_octant(p, [&](unsigned octant, std::uint64_t f, std::uint64_t o) {
        right = right && (f & o) == 0;
        const voxel_key low = child_key(octree::detail::named_key(p.name), octant, 4);
        for (unsigned i = 0; i != 64; ++i) {
          const voxel_key in = morton_key(i);
          const auto v = alone.value(voxel_key{low.x + in.x, low.y + in.y, low.z + in.z});
          right = right && v.has_value() == (((f | o) >> i & 1U) != 0);
          if (v) ++(is_occupied<log_odds<>>(*v) ? occupied : free);
          right = right && (!v || is_occupied<log_odds<>>(*v) == ((o >> i & 1U) != 0));
        }
      });
    CHECK(right);
    CHECK(got.free == free);
    CHECK(got.occupied == occupied);
    CHECK(voxels.counts() == std::pair{free, occupied});
    const auto at_once = integrated.integrate(camera::depth_view(s.depth), small_camera, s.T_world_camera);
    const auto counted = applied.apply(voxels);
    CHECK(counted.free == at_once.free);
    CHECK(counted.occupied == at_once.occupied);
    CHECK(ot_bytes(applied) == ot_bytes(integrated));
    history.set(frame, voxels);
  }
  if (!test::counts_allocations()) return;
  const auto again = [&](std::uint64_t frame, double shift) {
    const se3 moved{so3{}, vec3{shift, 0, 0}};
    history.set(seq, frame, camera::depth_view(scans[frame].depth), small_camera, moved * scans[frame].T_world_camera);
  };
  for (const double shift : {0.03, 0.0, 0.03, 0.0}) {
    again(3, shift);
    history.replay(seq);
  }
  again(3, 0.03);
  const std::size_t before = test::allocations();
  CHECK(history.replay(seq) > 0);
  CHECK(test::allocations() == before);
}
