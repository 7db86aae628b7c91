// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/files.hpp>

#include "mapping/keyframes.hpp"
#include "support/catch.hpp"

using orbis::mapping::build_map;
using orbis::mapping::filter_kind;

namespace {

using leaf = std::tuple<double, double, double, double, float>;

template <class Octree>
std::vector<leaf> leaves_of(const Octree& octree) {
  std::vector<leaf> out;
  octree.for_each_leaf([&](const auto& l) {
    out.emplace_back(l.center.x(), l.center.y(), l.center.z(), l.size, static_cast<float>(l.log_odds));
  });
  return out;
}

/// Occupied leaves well before the wall.
template <class Octree>
std::size_t floating(const Octree& octree) {
  std::size_t n = 0;
  octree.for_each_leaf([&](const auto& l) { n += l.occupied && l.center.z() < 1.8 ? 1 : 0; });
  return n;
}

}  // namespace

TEST_CASE("a map is the keyframes' surviving points each seen from its own place") {
  const auto scene = orbis::test::wall_scene(4, 20);
  const auto keyframes = scene.keyframes();
  for (const double voxel : {0.0, 0.03}) {
    for (const auto kind : {filter_kind::none, filter_kind::statistical, filter_kind::radius, filter_kind::automatic}) {
      const orbis::mapping::map_options options{.dense = {.stride = 1, .voxel_size = voxel},
                                                .filter = {.kind = kind, .statistical = {.neighbors = 20}}};
      const auto map = build_map(orbis::par, keyframes, scene.camera, options);
      REQUIRE(map.has_value());
      INFO("voxel " << voxel << ": " << to_string(map->filter.mode));
      CHECK(map->filter.points == map->cloud.size());
      CHECK(map->filter.removed == map->cloud.size() - map->filtered_cloud().size());
      CHECK(map->insert_ms.size() == keyframes.size());
      CHECK(map->insert_ms_unfiltered.size() == keyframes.size());
      CHECK(map->filter.kind == kind);

      orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, options.dense};
      for (const auto& k : keyframes) dense.add_keyframe(orbis::seq, k);
      orbis::octree::occupancy_octree<> unfiltered{options.resolution};
      for (std::size_t i = 0; i != keyframes.size(); ++i) {
        unfiltered.integrate(dense.measurements(orbis::seq, keyframes[i], i),
                             keyframes[i].T_world_camera.translation());
      }
      REQUIRE(map->unfiltered_octree.has_value());
      CHECK(leaves_of(*map->unfiltered_octree) == leaves_of(unfiltered));
      if (kind == filter_kind::none) {
        CHECK(leaves_of(map->octree) == leaves_of(unfiltered));
        CHECK(map->filter.removed == 0);
      } else {
        CHECK(map->filter.removed > 0);
        CHECK(3 * floating(map->octree) < 2 * floating(*map->unfiltered_octree));
      }
    }
  }
}

TEST_CASE("a map is the same under every policy") {
  const auto scene = orbis::test::wall_scene(3, 20);
  const auto alone = build_map(orbis::seq, scene.keyframes(), scene.camera);
  REQUIRE(alone.has_value());
  for (const unsigned threads : {2U, 5U}) {
    const auto together = build_map(orbis::par.with(threads), scene.keyframes(), scene.camera);
    REQUIRE(together.has_value());
    CHECK(together->cloud.points == alone->cloud.points);
    CHECK(together->filtered_cloud().points == alone->filtered_cloud().points);
    CHECK(together->filtered_cloud().colors == alone->filtered_cloud().colors);
    CHECK(leaves_of(together->octree) == leaves_of(alone->octree));
  }
}

TEST_CASE("bad keyframes are skipped or refused") {
  auto scene = orbis::test::wall_scene(2);
  using orbis::errc;
  CHECK(build_map(orbis::seq, std::vector<orbis::mapping::keyframe<>>{}, scene.camera).error().code == errc::no_data);
  CHECK(build_map(orbis::seq, scene.keyframes(), scene.camera, {.resolution = 0}).error().code ==
        errc::invalid_argument);
  CHECK(build_map(orbis::seq, scene.keyframes(), scene.camera, {.dense = {.stride = 0}}).error().code ==
        errc::invalid_argument);
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const orbis::mapping::map_options& bad :
       {orbis::mapping::map_options{.resolution = inf}, orbis::mapping::map_options{.integration = {.max_range = -1.0}},
        orbis::mapping::map_options{.dense = {.flying_pixels = orbis::cloud::flying_pixel_options{.reach = 9}}},
        orbis::mapping::map_options{.dense = {.voxel_size = -0.1}},
        orbis::mapping::map_options{.filter = {.statistical = {.neighbors = 0}}},
        orbis::mapping::map_options{.filter = {.automatic = {.neighbors = 0}}},
        orbis::mapping::map_options{.filter = {.log_statistical = {.neighbors = 0}}},
        orbis::mapping::map_options{.filter = {.cluster = {.neighbors = 0}}},
        orbis::mapping::map_options{.filter = {.cluster = {.min_gap = -1}}},
        orbis::mapping::map_options{.filter = {.ray_evidence = {.window = -1}}},
        orbis::mapping::map_options{.moving = orbis::mapping::moving_filter_options{.keyframes = 0}},
        orbis::mapping::map_options{.moving = orbis::mapping::moving_filter_options{.slant = -1}},
        orbis::mapping::map_options{.moving = orbis::mapping::moving_filter_options{.grow = -1}},
        orbis::mapping::map_options{.dense = {.voxel_size = inf}},
        orbis::mapping::map_options{.filter = {.radius = {.radius = -0.1}}}})
    CHECK(build_map(orbis::seq, scene.keyframes(), scene.camera, bad).error().code == errc::invalid_argument);
  const orbis::camera::pinhole other{{.width = 32, .height = 24, .fx = 30, .fy = 30, .cx = 16, .cy = 12}};
  CHECK(build_map(orbis::seq, scene.keyframes(), other).error().code == errc::invalid_argument);

  const auto one = build_map(orbis::seq, orbis::test::wall_scene(1).keyframes(), scene.camera);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.poses[1] = orbis::se3{orbis::so3{}, orbis::vec3{nan, 0, 0}};
  const auto map = build_map(orbis::seq, scene.keyframes(), scene.camera);
  REQUIRE(map.has_value());
  CHECK(map->skipped == 1);
  CHECK(map->cloud.points == one->cloud.points);
}

TEST_CASE("keyframes that are skipped leave no gap in a batch or in a live map, and every keyframe is counted") {
  struct numbered : orbis::mapping::keyframe<> {
    std::uint64_t frame = 0;
  };
  auto scene = orbis::test::wall_scene(7, 20);
  for (int y = 12; y != 36; ++y)
    for (int x = 20; x != 44; ++x) scene.depth[3](x, y) = 1000;  // is there for one keyframe
  for (const std::size_t i : {0U, 4U})
    scene.poses[i] = orbis::se3{orbis::so3{}, orbis::vec3{std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  std::vector<numbered> all, finite;
  for (std::size_t i = 0; i != scene.depth.size(); ++i) {
    all.push_back({scene.keyframe(i), 10 * i});
    if (i != 0 && i != 4) finite.push_back(all.back());
  }
  std::size_t last = 0, total = 0;
  const auto watch = [&](std::size_t done, std::size_t of) {
    CHECK(done > last);
    last = done;
    total = of;
    return true;
  };
  using octree = orbis::octree::occupancy_octree<>;
  for (const double voxel : {0.0, 0.03}) {
    for (const int stride : {1, 5}) {  // 5 divides neither side of the image
      orbis::mapping::map_options options{.dense = {.stride = stride, .voxel_size = voxel}};
      options.moving.emplace();
      options.dense.flying_pixels.emplace();
      const auto expected = build_map(orbis::seq, finite, scene.camera, options);
      REQUIRE(expected.has_value());
      CHECK(expected->moving.pixels > 300);
      last = 0;
      const auto batch = build_map(orbis::seq, all, scene.camera, options, watch);
      CHECK(last == total);
      orbis::mapping::live_map<octree, orbis::camera::pinhole> live{scene.camera, {.resolution = options.resolution}};
      last = 0;
      const auto grown = build_map(orbis::par.with(3), all, live, options, watch);
      CHECK(last == total);
      for (const auto* map : {&batch, &grown}) {
        REQUIRE(map->has_value());
        CHECK((*map)->skipped == 2);
        CHECK((*map)->insert_ms.size() == 5);
        CHECK((*map)->cloud.points == expected->cloud.points);
        CHECK((*map)->inliers == expected->inliers);
        CHECK((*map)->flying_pixels.removed == expected->flying_pixels.removed);
        CHECK(orbis::octree::ot_bytes(*(*map)->unfiltered_octree) ==
              orbis::octree::ot_bytes(*expected->unfiltered_octree));
        CHECK(orbis::octree::ot_bytes((*map)->octree) == orbis::octree::ot_bytes(expected->octree));
      }
      options.unfiltered_octree = false;
      const auto filtered = build_map(orbis::seq, all, scene.camera, options);
      REQUIRE(filtered.has_value());
      CHECK_FALSE(filtered->unfiltered_octree.has_value());
      CHECK(orbis::octree::ot_bytes(filtered->octree) == orbis::octree::ot_bytes(expected->octree));
    }
  }
  // Of a keyframe that is skipped, too, the images have the camera's size.
  for (const std::size_t at : {2U, 4U}) {
    auto wrong = all;
    wrong[at].color = {};
    CHECK(build_map(orbis::seq, wrong, scene.camera).has_value());
    const orbis::image<orbis::rgb8> small(32, 24);
    wrong[at].color = small;
    CHECK(build_map(orbis::seq, wrong, scene.camera).error().code == orbis::errc::invalid_argument);
    wrong = all;
    const orbis::image<std::uint16_t> low(32, 24, 1000);
    wrong[at].depth = orbis::camera::depth_view<std::uint16_t>{low.view(), 1000.0};
    CHECK(build_map(orbis::seq, wrong, scene.camera).error().code == orbis::errc::invalid_argument);
  }
}

namespace {

/// A keyframe that owns its images, can only be moved, and counts how many there are.
struct owning {
  struct counted {
    std::size_t* alive;
    explicit counted(std::size_t& n) : alive{&n} { ++n; }
    counted(counted&& other) noexcept : alive{other.alive} { other.alive = nullptr; }
    counted& operator=(counted&&) = delete;
    ~counted() { *(alive != nullptr ? alive : &unused) -= 1; }
    std::size_t unused = 1;
  };
  orbis::image<std::uint16_t> pixels;
  orbis::camera::depth_view<std::uint16_t> depth;
  orbis::image_view<const orbis::rgb8> color;
  orbis::se3 T_world_camera;
  counted count;
};

/// Makes its keyframes when their turn comes.
struct made_anew {
  const orbis::test::seen_scene* scene;
  std::size_t* alive;
  std::size_t* most;

  struct iterator {
    using iterator_category = std::forward_iterator_tag;
    using value_type = owning;
    using difference_type = std::ptrdiff_t;
    using reference = owning;
    const made_anew* of = nullptr;
    std::size_t at = 0;
    owning operator*() const {
      const auto k = of->scene->keyframe(at);
      owning out{of->scene->depth[at], k.depth, k.color, k.T_world_camera, owning::counted{*of->alive}};
      out.depth = orbis::camera::depth_view<std::uint16_t>{out.pixels.view(), 1000.0};
      *of->most = std::max(*of->most, *of->alive);
      return out;
    }
    iterator& operator++() {
      ++at;
      return *this;
    }
    iterator operator++(int) { return {of, at++}; }
    bool operator==(const iterator& other) const { return at == other.at; }
  };
  [[nodiscard]] iterator begin() const { return {this, 0}; }
  [[nodiscard]] iterator end() const { return {this, size()}; }
  [[nodiscard]] std::size_t size() const { return scene->depth.size(); }
};

}  // namespace

TEST_CASE("a range may make its keyframes anew, and few of them are kept") {
  auto scene = orbis::test::wall_scene(9, 20);
  for (const bool lost : {false, true}) {
    if (lost)  // nothing waits for what comes after
      for (std::size_t i = 2; i != 9; ++i)
        scene.poses[i] = orbis::se3{orbis::so3{}, orbis::vec3{std::numeric_limits<double>::quiet_NaN(), 0, 0}};
    for (const bool moving : {false, true}) {
      orbis::mapping::map_options options;
      if (moving) options.moving.emplace().keyframes = 3;
      std::size_t alive = 0, most = 0;
      const auto map = build_map(orbis::seq, made_anew{&scene, &alive, &most}, scene.camera, options);
      REQUIRE(map.has_value());
      CHECK(alive == 0);
      CHECK(most == (!moving ? 1 : lost ? 3 : 4));
      const auto kept = build_map(orbis::seq, scene.keyframes(), scene.camera, options);
      REQUIRE(kept.has_value());
      CHECK(orbis::octree::ot_bytes(map->octree) == orbis::octree::ot_bytes(kept->octree));
      CHECK(map->cloud.points == kept->cloud.points);
    }
  }
}

TEST_CASE("a map without flying pixels says how many there were") {
  const auto scene = orbis::test::edge_scene(3);
  const orbis::mapping::map_options plain{.dense = {.stride = 1}, .filter = {.kind = filter_kind::none}};
  auto options = plain;
  options.dense.flying_pixels.emplace();
  const auto map = build_map(orbis::par, scene.keyframes(), scene.camera, options);
  const auto all = build_map(orbis::par, scene.keyframes(), scene.camera, plain);
  REQUIRE(map.has_value());
  REQUIRE(all.has_value());
  CHECK(map->flying_pixels.removed > 150);
  CHECK(map->flying_pixels.removed < 300);
  CHECK(map->flying_pixels.valid == all->cloud.size());
  CHECK(map->cloud.size() == map->flying_pixels.valid - map->flying_pixels.removed);
  CHECK(map->filter.removed == 0);
  CHECK(all->flying_pixels.valid == 0);
  const auto between = [](const auto& octree) {
    std::size_t n = 0;
    octree.for_each_leaf([&](const auto& l) { n += l.occupied && l.center.z() > 1.2 && l.center.z() < 1.7 ? 1 : 0; });
    return n;
  };
  CHECK(between(all->octree) > 20);
  CHECK(between(map->octree) == 0);
}

TEST_CASE("a keyframe's pose may be anything that converts to one") {
  struct place {
    orbis::se3 pose;
    operator orbis::se3() const { return pose; }  // NOLINT(google-explicit-constructor)
  };
  struct placed {
    orbis::camera::depth_view<std::uint16_t> depth;
    orbis::image_view<const orbis::rgb8> color;
    place T_world_camera;
  };
  const auto scene = orbis::test::wall_scene(1);
  const auto plain = scene.keyframe(0);
  const std::vector<placed> keyframes{{plain.depth, plain.color, {plain.T_world_camera}}};
  const auto map = build_map(orbis::seq, keyframes, scene.camera);
  REQUIRE(map.has_value());
  CHECK(map->cloud.points == build_map(orbis::seq, scene.keyframes(), scene.camera)->cloud.points);
}

TEST_CASE("keyframes without any depth make an empty map") {
  auto scene = orbis::test::wall_scene(1);
  scene.depth[0] = orbis::image<std::uint16_t>(64, 48, 0);
  const auto map = build_map(orbis::seq, scene.keyframes(), scene.camera);
  REQUIRE(map.has_value());
  CHECK(map->cloud.empty());
  CHECK(map->filtered_cloud().empty());
  CHECK(map->octree.empty());
}

TEST_CASE("building a map can be watched and stopped") {
  const auto scene = orbis::test::wall_scene(3);
  std::size_t last = 0;
  std::size_t calls = 0;
  const auto watch = [&](std::size_t done, std::size_t total) {
    last = done;
    ++calls;
    return done <= total;
  };
  REQUIRE(build_map(orbis::seq, scene.keyframes(), scene.camera, {}, watch).has_value());
  // Added to the cloud and to the octree before the filter, filtered by what they see, added to the octree after it.
  CHECK(last == 9);
  CHECK(calls == 9);
  for (const std::size_t stop : {1U, 3U, 4U, 6U, 8U, 9U}) {
    const auto until = [&](std::size_t done, std::size_t) { return done < stop; };
    const auto map = build_map(orbis::seq, scene.keyframes(), scene.camera, {}, until);
    REQUIRE_FALSE(map.has_value());
    CHECK(map.error().code == orbis::errc::cancelled);
  }
}

TEST_CASE("a filter by rays is watched and stopped like the rest") {
  const auto scene = orbis::test::wall_scene(3);
  for (const bool ghosts : {false, true}) {
    const orbis::mapping::map_options options{
        .filter = {.kind = filter_kind::ray_evidence, .ray_evidence = {.resolve_ghosts = ghosts}}};
    std::size_t calls = 0;
    const auto watch = [&](std::size_t done, std::size_t total) {
      CHECK(done == ++calls);
      CHECK(total == (ghosts ? 12U : 9U));
      return true;
    };
    REQUIRE(build_map(orbis::seq, scene.keyframes(), scene.camera, options, watch).has_value());
    CHECK(calls == (ghosts ? 12U : 9U));
    for (const std::size_t stop : {4U, 6U}) {
      calls = 0;
      const auto until = [&](std::size_t, std::size_t) { return ++calls < stop; };
      const auto map = build_map(orbis::seq, scene.keyframes(), scene.camera, options, until);
      REQUIRE_FALSE(map.has_value());
      CHECK(map.error().code == orbis::errc::cancelled);
      CHECK(calls == stop);
    }
  }
}

TEST_CASE("a live map of the same depth images and poses is the same map") {
  const auto scene = orbis::test::wall_scene(5, 20);
  const auto keyframes = scene.keyframes();
  for (const int stride : {1, 2}) {
    const orbis::mapping::map_options options{
        .dense = {.stride = stride, .voxel_size = 0.02, .flying_pixels = orbis::cloud::flying_pixel_options{}},
        .filter = {.kind = filter_kind::statistical, .statistical = {.neighbors = 20}}};
    const auto map = build_map(orbis::par, keyframes, scene.camera, options);
    REQUIRE(map.has_value());
    CHECK(map->filter.removed > 0);
    orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, options.dense};
    for (const auto& k : keyframes) dense.add_keyframe(orbis::seq, k);
    const auto selection = dense.select(map->inliers);

    // Keyframes come in another order and elsewhere; later they are corrected, and after that the filter decides.
    using octree = orbis::octree::occupancy_octree<>;
    orbis::mapping::live_map<octree, orbis::camera::pinhole> live{scene.camera, {.resolution = options.resolution}};
    std::vector<orbis::mapping::keyframe_position> poses;
    for (const std::size_t i : {std::size_t{3}, std::size_t{0}, std::size_t{4}, std::size_t{1}, std::size_t{2}}) {
      const auto& k = keyframes[i];
      const auto depth = dense.masked_depth(orbis::seq, k, i);
      const orbis::se3 drifted{k.T_world_camera.rotation(), k.T_world_camera.translation() + orbis::vec3{0.1, 0, 0.2}};
      REQUIRE(live.add_keyframe(orbis::seq, i, orbis::mapping::view_like(k.depth, depth.view()), drifted).has_value());
      poses.push_back({i, k.T_world_camera});
    }
    live.set_poses(poses);
    REQUIRE(live.finish(orbis::par).has_value());
    CHECK(orbis::octree::ot_bytes(live.map()) == orbis::octree::ot_bytes(*map->unfiltered_octree));
    for (std::size_t i = 0; i != keyframes.size(); ++i) {
      const auto depth = dense.masked_depth(orbis::seq, keyframes[i], i, selection);
      REQUIRE(live.set_depth(orbis::seq, i, orbis::mapping::view_like(keyframes[i].depth, depth.view())).has_value());
    }
    REQUIRE(live.finish(orbis::par).has_value());
    CHECK(orbis::octree::ot_bytes(live.map()) == orbis::octree::ot_bytes(map->octree));
    CHECK(orbis::octree::ot_bytes(map->octree) != orbis::octree::ot_bytes(*map->unfiltered_octree));

    // The same in one call, by a live map that lacks a keyframe and has one too many.
    struct numbered : orbis::mapping::keyframe<> {
      std::uint64_t frame = 0;
    };
    std::vector<numbered> named;
    for (std::size_t i = 0; i != keyframes.size(); ++i) named.push_back({keyframes[i], 10 * i});
    orbis::mapping::live_map<octree, orbis::camera::pinhole> grown{scene.camera, {.resolution = options.resolution}};
    orbis::mapping::keyframe_points reader;
    const orbis::camera::ray_table rays{scene.camera};
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
      const auto& k = keyframes[i];
      const auto depth =
          reader.masked(orbis::seq, k.depth, rays,
                        {.max_depth = options.dense.max_depth, .flying_pixels = options.dense.flying_pixels});
      REQUIRE(grown
                  .add_keyframe(orbis::seq, i == 0 ? 7 : 10 * i, orbis::mapping::view_like(k.depth, depth.view()),
                                orbis::se3{})
                  .has_value());
    }
    auto unordered = named;
    std::swap(unordered[1], unordered[2]);
    CHECK(build_map(orbis::par, unordered, grown, options).error().code == orbis::errc::invalid_argument);
    const auto built = build_map(orbis::par, named, grown, options);
    REQUIRE(built.has_value());
    CHECK(dense.cloud().points == map->cloud.points);
    CHECK(built->cloud.points == map->cloud.points);
    CHECK(built->inliers == map->inliers);
    CHECK(orbis::octree::ot_bytes(*built->unfiltered_octree) == orbis::octree::ot_bytes(*map->unfiltered_octree));
    CHECK(orbis::octree::ot_bytes(built->octree) == orbis::octree::ot_bytes(map->octree));
  }
}

TEST_CASE("a map without what moved is the same under every policy, by a live map, and from depth in metres") {
  // A wall, and a board before it in one of five images.
  auto scene = orbis::test::wall_scene(5);
  for (int y = 12; y != 36; ++y)
    for (int x = 20; x != 44; ++x) scene.depth[2](x, y) = 1000;
  struct numbered : orbis::mapping::keyframe<> {
    std::uint64_t frame = 0;
  };
  std::vector<numbered> keyframes;
  for (std::size_t i = 0; i != 5; ++i) keyframes.push_back({scene.keyframe(i), i});
  const orbis::mapping::map_options options{.moving = orbis::mapping::moving_filter_options{},
                                            .filter = {.kind = filter_kind::none}};
  std::size_t calls = 0;
  const auto count = [&](std::size_t done, std::size_t total) {
    CHECK(done == ++calls);
    CHECK(total == 10);
    return true;
  };
  const auto map = build_map(orbis::seq, keyframes, scene.camera, options, count);
  REQUIRE(map.has_value());
  CHECK(calls == 10);
  CHECK(map->moving.keyframes == 1);
  CHECK(map->moving.pixels > 300);
  const auto board = [](const auto& m) { return m.octree.state(orbis::vec3{0.2, 0.15, 0.8}); };
  CHECK(board(*map) != orbis::octree::occupancy::occupied);
  auto without = options;
  without.moving.reset();
  const auto whole = build_map(orbis::seq, keyframes, scene.camera, without);
  REQUIRE(whole.has_value());
  CHECK(whole->cloud.size() > map->cloud.size() + 100);

  for (const unsigned threads : {2U, 5U}) {
    const auto again = build_map(orbis::par.with(threads), keyframes, scene.camera, options);
    REQUIRE(again.has_value());
    CHECK(again->cloud.points == map->cloud.points);
    CHECK(again->moving.pixels == map->moving.pixels);
    CHECK(orbis::octree::ot_bytes(again->octree) == orbis::octree::ot_bytes(map->octree));
  }
  for (const std::size_t stop : {1U, 5U, 6U})
    CHECK(build_map(orbis::seq, keyframes, scene.camera, options,
                    [&](std::size_t done, std::size_t) { return done < stop; })
              .error()
              .code == orbis::errc::cancelled);

  // By a live map; and what an end in between leaves in it does not come into the next map.
  using octree = orbis::octree::occupancy_octree<>;
  orbis::mapping::live_map<octree, orbis::camera::pinhole> live{scene.camera, {.resolution = options.resolution}};
  const auto built = build_map(orbis::par, keyframes, live, options);
  REQUIRE(built.has_value());
  CHECK(orbis::octree::ot_bytes(*built->unfiltered_octree) == orbis::octree::ot_bytes(*map->unfiltered_octree));
  CHECK(orbis::octree::ot_bytes(built->octree) == orbis::octree::ot_bytes(map->octree));
  auto sooner = options;
  sooner.moving->keyframes = 2;
  for (const std::size_t stop : {4U, 8U}) {
    orbis::mapping::live_map<octree, orbis::camera::pinhole> stopped{scene.camera, {.resolution = options.resolution}};
    CHECK_FALSE(build_map(orbis::seq, keyframes, stopped, sooner, [&](std::size_t done, std::size_t) {
                  return done < stop;
                }).has_value());
    CHECK(stopped.size() == (stop == 4 ? 2 : 5));
    const auto rebuilt = build_map(orbis::seq, keyframes, stopped, without);
    REQUIRE(rebuilt.has_value());
    CHECK(orbis::octree::ot_bytes(*rebuilt->unfiltered_octree) == orbis::octree::ot_bytes(*whole->unfiltered_octree));
  }

  // Metres instead of millimetres.
  std::vector<orbis::image<float>> metres;
  for (const auto& depth : scene.depth) {
    metres.emplace_back(64, 48);
    for (int y = 0; y != 48; ++y)
      for (int x = 0; x != 64; ++x) metres.back()(x, y) = 0.001F * static_cast<float>(depth(x, y));
  }
  std::vector<orbis::mapping::keyframe<orbis::camera::depth_view<float>>> in_metres;
  for (std::size_t i = 0; i != 5; ++i)
    in_metres.push_back({orbis::camera::depth_view<float>(metres[i].view()), {}, scene.poses[i]});
  const auto same = build_map(orbis::seq, in_metres, scene.camera, options);
  REQUIRE(same.has_value());
  CHECK(same->moving.keyframes == 1);
  CHECK(same->moving.pixels == map->moving.pixels);
}
