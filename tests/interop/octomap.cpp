// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <limits>
#include <span>
#include <sstream>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/interop/octomap.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_map-inl.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/nav/next_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/replanning.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/nav/robot_trajectory.hpp>
#include <orbis/octree/files.hpp>
#include <orbis/octree/octants.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

[[nodiscard]] std::string ot_of(const octomap::OcTree& tree) {
  std::streambuf* const err = std::cerr.rdbuf(nullptr);  // OctoMap reports there
  std::ostringstream out;
  tree.write(out);
  std::cerr.rdbuf(err);
  std::cerr.clear();
  return out.str();
}

[[nodiscard]] octree::occupancy_octree<> some_map() {
  octree::occupancy_octree<> map{0.05};
  random_bits random{61};
  for (int scan = 0; scan != 8; ++scan) {
    std::vector<vec3f> points(500);
    for (vec3f& p : points)
      p = vec3f{static_cast<float>(random.normal()), static_cast<float>(random.normal()),
                static_cast<float>(random.normal())}
              .normalized();
    map.integrate(points, vec3f{0.1F, 0.0F, 0.0F});
  }
  return map;
}

}  // namespace

TEST_CASE("A map becomes the OctoMap tree with the same nodes and values") {
  const auto map = some_map();
  const auto tree = interop::to_octomap(map);
  REQUIRE(tree);
  CHECK(ot_of(*tree) == octree::ot_bytes(map));
  CHECK(tree->size() == map.size());
  CHECK(tree->size() == tree->calcNumNodes());
  CHECK(tree->getNumLeafNodes() == map.num_leaves());
  const octomap::OcTree fresh{0.05};
  CHECK(tree->getProbHitLog() == fresh.getProbHitLog());
  CHECK(tree->getProbMissLog() == fresh.getProbMissLog());
  CHECK(tree->getClampingThresMinLog() == fresh.getClampingThresMinLog());
  CHECK(tree->getClampingThresMaxLog() == fresh.getClampingThresMaxLog());
  CHECK(tree->getOccupancyThresLog() == fresh.getOccupancyThresLog());
}

TEST_CASE("A converted tree goes on like one that OctoMap made") {
  auto map = some_map();
  const auto tree = interop::to_octomap(map);
  octomap::Pointcloud cloud;
  std::vector<vec3f> points;
  random_bits random{62};
  for (int i = 0; i != 200; ++i) {
    points.emplace_back(static_cast<float>(random.uniform(-1, 1)), static_cast<float>(random.uniform(-1, 1)), 0.8F);
    cloud.push_back(points.back().x(), points.back().y(), points.back().z());
  }
  tree->insertPointCloud(cloud, {0.0F, 0.0F, 0.0F});
  map.integrate(points, vec3f{0.0F, 0.0F, 0.0F});
  CHECK(ot_of(*tree) == octree::ot_bytes(map));
}

TEST_CASE("An OctoMap tree becomes the same map and comes back as it was") {
  octomap::OcTree tree{0.1};
  random_bits random{63};
  for (int i = 0; i != 3000; ++i)
    tree.updateNode(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.below(2) == 0);
  const auto map = interop::from_octomap(tree);
  REQUIRE(map);
  CHECK(octree::ot_bytes(*map) == ot_of(tree));
  CHECK(ot_of(*interop::to_octomap(*map)) == ot_of(tree));
}

TEST_CASE("Leaves of every size survive the conversion") {
  // A pruned leaf at each depth, made by a file, since no scan fills an eighth of the world.
  for (int depth = 1; depth <= octree::default_tree_depth; ++depth) {
    std::string file =
        "# Octomap OcTree binary file\nid OcTree\nsize " + std::to_string(depth + 2) + "\nres 0.1\ndata\n";
    for (int d = 1; d != depth; ++d) file += std::string{"\x03\x00", 2};
    file += std::string{"\x06\x00", 2};
    const auto map = octree::read_bt(std::as_bytes(std::span{file}));
    REQUIRE(map);
    const auto tree = interop::to_octomap(*map);
    CHECK(ot_of(*tree) == octree::ot_bytes(*map));
    CHECK(octree::ot_bytes(interop::from_octomap(*tree).value()) == octree::ot_bytes(*map));
  }
}

TEST_CASE("Empty maps convert and values that are no numbers are refused") {
  CHECK(interop::to_octomap(octree::occupancy_octree<>{0.1})->size() == 0);
  octomap::OcTree tree{0.1};
  CHECK(interop::from_octomap(tree)->empty());
  tree.updateNode(0.0, 0.0, 0.0, true)->setLogOdds(std::numeric_limits<float>::quiet_NaN());
  const auto refused = interop::from_octomap(tree);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == errc::malformed);
}

namespace {

[[nodiscard]] octree::voxel_layer<octree::rgb_mean> some_colors(const octree::occupancy_octree<>& map) {
  octree::voxel_layer<octree::rgb_mean> colors;
  map.for_each_leaf([&](const auto& leaf) {
    if (!leaf.occupied) return;
    const std::uint32_t cells = octree::node_cells(map.tree_depth() - leaf.depth);
    for (std::uint32_t i = 0; i != cells * cells * cells; ++i) {
      const octree::voxel_key key{leaf.key.x + i % cells, leaf.key.y + i / cells % cells,
                                  leaf.key.z + i / cells / cells};
      // Two colours in patches of 4x4x4, so that some leaves have one colour and others several.
      const bool red = ((key.x >> 2U ^ key.y >> 2U ^ key.z >> 2U) & 1U) != 0;
      colors.make(key).update(red ? rgb8{200, 10, 10} : rgb8{static_cast<std::uint8_t>(key.x & 127U), 100, 30});
    }
  });
  return colors;
}

}  // namespace

TEST_CASE("A map with colours becomes a ColorOcTree in which every voxel has its own") {
  const auto map = some_map();
  const auto colors = some_colors(map);
  REQUIRE(colors.size() > 500);
  const auto tree = interop::to_octomap(map, colors);
  REQUIRE(tree);
  CHECK(tree->size() == tree->calcNumNodes());
  CHECK(tree->size() >= map.size());
  std::size_t colored = 0;
  for (auto it = tree->begin_leafs(), end = tree->end_leafs(); it != end; ++it) {
    const octree::voxel_key key{it.getKey()[0], it.getKey()[1], it.getKey()[2]};
    REQUIRE(map.log_odds(key) == it->getLogOdds());
    const auto* const color = colors.find(key);
    REQUIRE(it->isColorSet() == (color != nullptr));
    if (color == nullptr) continue;
    const auto c = it->getColor();
    REQUIRE(color->color() == rgb8{c.r, c.g, c.b});
    const auto cells = std::size_t{1} << (tree->getTreeDepth() - it.getDepth());
    colored += cells * cells * cells;
  }
  CHECK(colored == colors.size());
  // Without the colours it is the tree without colours.
  tree->prune();
  CHECK(tree->size() == map.size());
  const auto back = interop::from_octomap(*tree);
  REQUIRE(back);
  CHECK(octree::ot_bytes(back->map) == octree::ot_bytes(map));
}

TEST_CASE("Inner nodes of a ColorOcTree average their children's colours") {
  const auto map = some_map();
  const auto tree = interop::to_octomap(map, some_colors(map));
  for (auto it = tree->begin_tree(), end = tree->end_tree(); it != end; ++it) {
    if (it.isLeaf()) continue;
    REQUIRE(it->getColor() == it->getAverageChildColor());
    REQUIRE(it->getLogOdds() == it->getMaxChildLogOdds());
  }
}

TEST_CASE("A ColorOcTree comes back as the map and the colours it was made of") {
  const auto map = some_map();
  const auto colors = some_colors(map);
  const auto back = interop::from_octomap(*interop::to_octomap(map, colors));
  REQUIRE(back);
  CHECK(octree::ot_bytes(back->map) == octree::ot_bytes(map));
  CHECK(back->colors.size() == colors.size());
  colors.for_each([&](const octree::voxel_key& key, const octree::rgb_mean& color) {
    REQUIRE(back->colors.find(key) != nullptr);
    REQUIRE(back->colors.find(key)->color() == color.color());
  });
}

TEST_CASE("A ColorOcTree that OctoMap made is read as it is") {
  octomap::ColorOcTree tree{0.1};
  random_bits random{64};
  for (int i = 0; i != 3000; ++i) {
    const float x = static_cast<float>(random.uniform(-1, 1)), y = static_cast<float>(random.uniform(-1, 1)), z = 0.3F;
    tree.updateNode(x, y, z, random.below(3) != 0);
    tree.integrateNodeColor(x, y, z, static_cast<std::uint8_t>(random.below(256)), 7, 9);
  }
  const auto read = interop::from_octomap(tree);
  REQUIRE(read);
  std::size_t voxels = 0;
  for (auto it = tree.begin_leafs(), end = tree.end_leafs(); it != end; ++it) {
    const octree::voxel_key key{it.getKey()[0], it.getKey()[1], it.getKey()[2]};
    REQUIRE(read->map.log_odds(key) == it->getLogOdds());
    REQUIRE(read->colors.find(key) != nullptr);
    REQUIRE(read->colors.find(key)->color() == rgb8{it->getColor().r, it->getColor().g, it->getColor().b});
    voxels += std::size_t{1} << (3 * (tree.getTreeDepth() - it.getDepth()));
  }
  CHECK(read->colors.size() == voxels);
}

TEST_CASE("Colours without a map, maps without colours and coloured leaves of half the world") {
  const octree::voxel_layer<octree::rgb_mean> none;
  CHECK(interop::to_octomap(octree::occupancy_octree<>{0.1}, none)->size() == 0);
  const auto map = some_map();
  const auto plain = interop::to_octomap(map, none);
  CHECK(plain->size() == map.size());
  CHECK(interop::from_octomap(*plain)->colors.empty());
  CHECK(octree::ot_bytes(interop::from_octomap(*plain)->map) == octree::ot_bytes(map));

  octree::voxel_layer<octree::rgb_mean> elsewhere;
  elsewhere.make({1, 2, 3}).update({1, 2, 3});
  CHECK(interop::to_octomap(map, elsewhere)->size() == map.size());

  // One colour in an eighth of the world splits it down to the voxel, and nothing else.
  octree::occupancy_octree<> large{0.1};
  large.set_unknown_node({}, 1, 1.0F);
  const auto split = interop::to_octomap(large, elsewhere);
  CHECK(split->size() == 1 + 1 + 8 * 15);
  CHECK(split->search(octomap::OcTreeKey{1, 2, 3})->getColor() == octomap::ColorOcTreeNode::Color{1, 2, 3});
  auto one = interop::to_octomap(large, none);
  one->getNodeChild(one->getRoot(), 0)->setColor(1, 2, 3);
  const auto refused = interop::from_octomap(*one);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == errc::unsupported);
}

TEST_CASE("Planning reads an OctoMap tree in place, as the map that it is a copy of") {
  static_assert(nav::planning_map<octomap::OcTree>);
  octree::occupancy_octree<> map = some_map();
  map.set_unknown_node({32768 + 512, 32768, 32768}, 7, -0.5F);  // and a leaf of 512 voxels
  const auto tree = interop::to_octomap(map);
  std::size_t octants = 0, large = 0, wrong = 0;
  auto read = nav::map_access<octomap::OcTree>::octants(*tree);
  octree::octant_reader expected{map};
  nav::map_access<octomap::OcTree>::for_each_octant(
      *tree, [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
        ++octants;
        large += level == 9 ? 1U : 0U;
        wrong += s == expected(k) && s == read(k) && s.known != 0 ? 0U : 1U;
      });
  octree::for_each_octant(map, [&](const octree::voxel_key& k, int, const octree::octant_states& s) {
    wrong += read({k.x + 3, k.y + 1, k.z + 2}) == s ? 0U : 1U;
  });
  CHECK(octants > 500);
  CHECK(large == 1);
  CHECK(wrong == 0);
  CHECK(read({1, 2, 3}) == octree::octant_states{});
  for (const octree::occupancy unknown : {octree::occupancy::free, octree::occupancy::occupied}) {
    const nav::distance_field_options options{.reach = 0.4, .unknown = unknown};
    nav::distance_field theirs{*tree, options};
    const nav::distance_field ours{map, options};
    CHECK(theirs.voxels().brick_count() == ours.voxels().brick_count());
    const auto differences = [&] {
      std::size_t count = 0;
      ours.voxels().for_each_brick([&](const octree::voxel_key& low, auto values) {
        for (std::uint32_t i = 0; i != 512; ++i)
          count += theirs.voxels().squared({low.x + (i & 7U), low.y + (i >> 3U & 7U), low.z + (i >> 6U)}) != values[i];
      });
      return count;
    };
    CHECK(differences() == 0);
    theirs.update(*tree);
    CHECK(differences() == 0);
  }
  const auto theirs = nav::make_floor_map(*tree, {}, {.floor = -0.5});
  const auto ours = nav::make_floor_map(map, {}, {.floor = -0.5});
  REQUIRE((theirs.has_value() && ours.has_value()));
  CHECK(theirs->states == ours->states);
  CHECK(nav::find_floor(*tree) == nav::find_floor(map));
  // A tree without anything.
  const octomap::OcTree nothing{0.05};
  CHECK(nav::map_access<octomap::OcTree>::octants(nothing)({5, 5, 5}) == octree::octant_states{});
  CHECK(nav::distance_field{nothing}.voxels().brick_count() == 0);
}

namespace {

/// Free space from the origin on with boxes in it, and some voxels of which nothing is known; a large leaf beside it.
[[nodiscard]] octree::occupancy_octree<> boxes_in_space(std::uint64_t seed) {
  octree::occupancy_octree<> map{0.1};
  random_bits random{seed};
  const std::uint32_t o = map.grid().cells() / 2;
  const auto set = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z, float log_odds) {
    const octree::voxel_key k{o + x, o + y, o + z};
    map.edit_octant(k, [&](auto& voxels) {
      const auto i = octree::morton_code(k) & 63U;
      voxels.known |= std::uint64_t{1} << i;
      voxels.value[i] = log_odds;
    });
  };
  for (std::uint32_t z = 0; z != 16; ++z)
    for (std::uint32_t y = 0; y != 32; ++y)
      for (std::uint32_t x = 0; x != 32; ++x)
        if (random.below(500) != 0) set(x, y, z, -1.0F);
  for (int i = 0; i != 40; ++i) {
    const std::uint32_t x = random.below(29), y = random.below(29), z = random.below(13);
    for (std::uint32_t j = 0; j != 27; ++j) set(x + j % 3, y + j / 3 % 3, z + j / 9, 1.0F);
  }
  map.set_unknown_node({o + 64, o, o}, 10, 1.0F);   // of 64 voxels' edge
  map.set_unknown_node({o, o + 32, o}, 11, -1.0F);  // and a free one of 32
  return map;
}
[[nodiscard]] vec3 random_place(random_bits& random) {
  return {random.uniform(-0.5, 7.0), random.uniform(-0.5, 4.5), random.uniform(-0.3, 2.2)};
}

}  // namespace

TEST_CASE("What a robot sweeps meets the same in an OctoMap tree as in our octree") {
  using tree_access = nav::map_access<octomap::OcTree>;
  std::size_t met = 0, missed = 0, different = 0;
  for (std::uint64_t seed = 1; seed != 6; ++seed) {
    const auto map = boxes_in_space(seed);
    auto tree = interop::to_octomap(map);
    // Inner nodes that have not been updated do not matter.
    if (seed % 2 == 0) tree->getRoot()->setLogOdds(-2.0F);
    random_bits random{seed};
    const auto compare = [&](const auto& shape) {
      for (const octree::occupancy unknown : {octree::occupancy::free, octree::occupancy::occupied}) {
        const bool expected = octree::overlaps(map, shape, {.unknown = unknown});
        different += nav::detail::map_overlaps(*tree, shape, {.unknown = unknown}) == expected ? 0U : 1U;
        ++(expected ? met : missed);
      }
    };
    for (int i = 0; i != 1000; ++i) {
      const vec3 a = random_place(random);
      const vec3 b = i % 4 == 0 ? a : i % 4 == 1 ? random_place(random) : vec3{a + 0.1 * random_place(random)};
      const double radius = random.uniform(0.02, 0.3);
      compare(octree::capsule{a, b, radius});
      compare(octree::sphere{a, radius});
      compare(octree::bounding_box{a.cwiseMin(b), a.cwiseMax(b)});
      compare(nav::swept(nav::vertical_cylinder{radius, -0.1, 0.2}, a, b));
      compare(nav::swept(nav::vertical_capsule{radius, 0.0, 0.3}, a, b));
      const octree::voxel_key k = *map.grid().key(a);
      different += tree_access::state(*tree, k) == map.state(k) ? 0U : 1U;
    }
    // Across the border of the grid, and beyond it.
    const double edge = 0.1 * map.grid().cells() / 2;
    compare(octree::capsule{{edge - 0.2, 0.0, 0.0}, {edge + 0.2, 0.0, 0.0}, 0.1});
    compare(octree::sphere{{0.0, 0.0, -2.0 * edge}, 0.1});
  }
  CHECK(different == 0);
  CHECK(met > 10000);
  CHECK(missed > 10000);
  const octomap::OcTree nothing{0.1};
  const octree::sphere ball{vec3::Zero(), 0.2};
  CHECK(nav::detail::map_overlaps(nothing, ball, {.unknown = octree::occupancy::occupied}));
  CHECK_FALSE(nav::detail::map_overlaps(nothing, ball, {.unknown = octree::occupancy::free}));
  CHECK(tree_access::state(nothing, {1, 2, 3}) == octree::occupancy::unknown);
}

TEST_CASE("Paths and trajectories through an OctoMap tree are those through our octree") {
  const octree::occupancy unknown = GENERATE(octree::occupancy::occupied, octree::occupancy::free);
  std::size_t found = 0, corners = 0, different = 0, free = 0;
  for (std::uint64_t seed = 1; seed != 6; ++seed) {
    const auto map = boxes_in_space(seed);
    const auto tree = interop::to_octomap(map);
    const nav::distance_field_options options{.reach = 0.6, .unknown = unknown};
    const nav::distance_field our_field{map, options}, their_field{*tree, options};
    random_bits random{seed};
    const auto compare = [&](const auto& shape, const nav::planning_options& costs) {
      const nav::planning_view ours{map, our_field, shape, costs};
      const nav::planning_view theirs{*tree, their_field, shape, costs};
      const auto place = [&] {
        for (;;)
          if (const vec3 p = random_place(random); ours.is_free(p)) return p;
      };
      for (int i = 0; i != 200; ++i) {
        const vec3 a = random_place(random), b = random_place(random);
        const octree::voxel_key k = *map.grid().key(a);
        different += ours.is_free(a) == theirs.is_free(a) ? 0U : 1U;
        different += ours.is_free(a, b) == theirs.is_free(a, b) ? 0U : 1U;
        different += ours.is_free(k) == theirs.is_free(k) && ours.density(k) == theirs.density(k) ? 0U : 1U;
        free += theirs.is_free(a) ? 1U : 0U;
      }
      for (int i = 0; i != 3; ++i) {
        const vec3 a = place(), b = place();
        const nav::path_options how{.method = i == 0 ? nav::path_method::grid : nav::path_method::any_angle,
                                    .max_expanded = 20'000};
        const auto our_path = nav::find_path(ours, a, b, how);
        const auto their_path = nav::find_path(theirs, a, b, how);
        CHECK(their_path.status == our_path.status);
        CHECK(their_path.points == our_path.points);
        CHECK(their_path.cost == our_path.cost);
        if (their_path.status != nav::path_status::found) continue;
        ++found;
        corners += their_path.points.size() - 2;
        const auto our_motion = nav::make_trajectory(ours, our_path.points);
        const auto their_motion = nav::make_trajectory(theirs, their_path.points);
        CHECK(their_motion.duration() == our_motion.duration());
        CHECK(their_motion.pieces().size() == our_motion.pieces().size());
        CHECK(their_motion.at(1.0).position == our_motion.at(1.0).position);
      }
    };
    compare(nav::ball{0.12}, {});
    compare(nav::vertical_cylinder{0.1, -0.1, 0.2}, {});
    compare(nav::vertical_capsule{0.1, -0.05, 0.1}, {.clearance_weight = 2.0, .unknown_cost = 3.0});
  }
  CHECK(different == 0);
  CHECK(free > 300);
  CHECK(found > 20);
  CHECK(corners > 20);
}

TEST_CASE("A robot explores and keeps its path on an OctoMap tree") {
  auto map = boxes_in_space(1);
  const auto tree = interop::to_octomap(map);
  nav::distance_field our_field{map, {.reach = 0.6}}, their_field{*tree, {.reach = 0.6}};
  const nav::planning_view ours{map, our_field, 0.12};
  const nav::planning_view theirs{*tree, their_field, 0.12};
  random_bits random{3};
  vec3 from, to;
  nav::found_path path;
  vec3 between = vec3::Zero();  // on the path, away from its ends
  do {
    from = random_place(random), to = random_place(random);
    path = nav::find_path(ours, from, to);
    if (path.points.size() > 3) between = 0.5 * (path.points[1] + path.points[2]);
  } while (path.status != nav::path_status::found || path.points.size() < 4 || (between - from).norm() < 0.5 ||
           (between - to).norm() < 0.5);

  nav::frontiers frontiers{*tree};
  const auto places = nav::candidate_viewpoints(frontiers.clusters({.min_size = 1}), theirs.grid());
  REQUIRE(!places.empty());
  const camera::pinhole camera{64, 48, 40.0, 40.0, 31.5, 23.5};
  const nav::next_view_options options{.gain = {.pixel_step = 4}, .min_distance = 0.2};
  const auto our_view = nav::next_best_view(ours, places, camera, from, options);
  const auto their_view = nav::next_best_view(theirs, places, camera, from, options);
  REQUIRE(our_view.status == nav::next_view_status::found);
  CHECK(their_view.status == nav::next_view_status::found);
  CHECK(their_view.utility == our_view.utility);
  CHECK(their_view.path.points == our_view.path.points);

  // No log of changes: it is tested each time, and a new path is made when the tree blocks it.
  nav::replanner planner{to};
  const auto first = planner.update(theirs, from).points;
  CHECK(planner.update(theirs, from).points == first);
  CHECK(planner.planned() == 1);
  tree->updateNode(between.x(), between.y(), between.z(), 5.0F);
  their_field.update(*tree);
  const auto& second = planner.update(theirs, from);
  CHECK(planner.planned() == 2);
  REQUIRE(second.status == nav::path_status::found);
  CHECK(second.points != first);
  for (std::size_t i = 1; i != second.points.size(); ++i) CHECK(theirs.is_free(second.points[i - 1], second.points[i]));
}
