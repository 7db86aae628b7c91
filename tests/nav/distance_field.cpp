// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::distance_field;
using octree::occupancy;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;

/// Points on the walls of a room of 2 m, some of them missing, seen from inside.
std::vector<vec3f> scan_from(random_bits& random, const vec3& origin) {
  std::vector<vec3f> points;
  for (int i = 0; i != 300; ++i) {
    const vec3 direction{random.normal(), random.normal(), random.normal()};
    double t = 1e9;
    for (int axis = 0; axis != 3; ++axis)
      t = std::min(t, (std::copysign(1.0, direction[axis]) - origin[axis]) / direction[axis]);
    points.push_back((origin + t * direction).cast<float>());
  }
  return points;
}
void add_scan(map_type& map, random_bits& random) {
  const auto along = [&] { return random.uniform() * 1.2 - 0.6; };
  const vec3 origin{along(), along(), along()};
  map.integrate(seq, scan_from(random, origin), origin);
}

std::size_t differences(const distance_field& a, const distance_field& b) {
  std::size_t count = 0;
  const auto compare = [&](const distance_field& from, const distance_field& to) {
    from.voxels().for_each_brick([&](const voxel_key& low, auto values) {
      for (std::uint32_t i = 0; i != 512; ++i)
        count += to.voxels().squared({low.x + (i & 7U), low.y + (i >> 3U & 7U), low.z + (i >> 6U)}) != values[i];
    });
  };
  compare(a, b);
  compare(b, a);
  return count;
}

}  // namespace

TEST_CASE("A distance field follows its map, and is the one made afresh") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  random_bits random{unknown == occupancy::free ? 1U : 2U};
  map_type map{0.1};
  map.track_changes();
  const nav::distance_field_options options{.reach = 0.75, .unknown = unknown};
  distance_field field{map, options};
  const auto check = [&] {
    field.update(map);
    CHECK(differences(field, distance_field{map, options}) == 0);
  };
  check();
  for (int i = 0; i != 6; ++i) {
    add_scan(map, random);
    check();
  }
  // Some is forgotten, by voxels and by leaves.
  map.transform([](float v) { return v < -1.0F ? std::nullopt : std::optional{v}; });
  check();
  map.prune();
  add_scan(map, random);
  check();
  map.transform([](float v) { return std::optional{-v}; });
  check();
  map.clear();
  check();
  add_scan(map, random);
  map.changes().set_capacity(1);
  add_scan(map, random);
  check();
}

TEST_CASE("A field follows a map whose changes are not recorded all the time") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const nav::distance_field_options options{.reach = 0.5, .unknown = unknown};
  random_bits random{3};
  map_type map{0.1};
  const bool from_the_start = GENERATE(true, false);
  if (from_the_start) map.track_changes();
  distance_field field{map, options};
  const auto check = [&] {
    field.update(map);
    CHECK(differences(field, distance_field{map, options}) == 0);
  };
  for (int i = 0; i != 3; ++i) {
    add_scan(map, random);
    check();
  }
  map.track_changes();
  check();
  for (int round = 0; round != 2; ++round) {
    map.track_changes(false);
    for (int i = 0; i != 2; ++i) {
      add_scan(map, random);
      check();
    }
    const map_type before = map;
    map.clear();
    check();
    map = before;
    check();
    add_scan(map, random);
    map.track_changes();
    add_scan(map, random);
    check();
    add_scan(map, random);
    check();
  }
  for (const int scans : {1, 5, 50}) {  // moved in, with a log of its own that is behind, ahead
    map_type another{0.1};
    another.track_changes();
    for (int i = 0; i != scans; ++i) add_scan(another, random);
    map = std::move(another);
    check();
  }
  map_type level{0.1};  // or level
  level.track_changes();
  while (level.changes().revision() != map.changes().revision()) add_scan(level, random);
  map = std::move(level);
  check();
  const map_type away = std::move(map);
  check();  // NOLINT(bugprone-use-after-move): it is empty, and says so
}

TEST_CASE("A field follows a rolling window") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const nav::distance_field_options options{.reach = 0.5, .unknown = unknown};
  random_bits random{5};
  map_type map{0.1};
  map.track_changes();
  distance_field field{map, options};
  for (int i = 0; i != 6; ++i) {
    add_scan(map, random);
    if (i == 3) map.set_unknown_node({0, 0, 0}, 8, 0.5F);  // a large leaf
    field.update(map);
    const vec3 half = vec3::Constant(i % 2 == 0 ? 0.4 : 0.3);
    REQUIRE(map.evict_outside({-half, half}, [](const auto&) {}) > 0);
    field.update(map);
    CHECK(differences(field, distance_field{map, options}) == 0);
  }
}

TEST_CASE("A field follows copies of a map, whatever their revisions are") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const nav::distance_field_options options{.reach = 0.5, .unknown = unknown};
  random_bits random{6};
  map_type map{0.1};
  map.track_changes();
  struct snapshot {
    map_type map;
    std::uint64_t revision;
  };
  std::vector<snapshot> snapshots{{map, map.changes().revision()}};
  distance_field field{map.grid(), options};
  for (int i = 0; i != 12; ++i) {
    if (i % 3 == 2)
      map.transform([](float v) { return v < -1.0F ? std::nullopt : std::optional{v}; });
    else
      add_scan(map, random);
    snapshots.push_back({map, map.changes().revision()});
    if (i == 7) map.changes().set_capacity(20);
    if (i == 10) map.changes().forget_before(map.changes().revision() - 1);
    // The newest, or one before it, while the log knows more: also back in time.
    for (const std::size_t back : {2U, 1U, 3U}) {
      const snapshot& s = snapshots[snapshots.size() - std::min<std::size_t>(back, snapshots.size())];
      field.update(s.map, map.changes(), s.revision);
      CHECK(differences(field, distance_field{s.map, options}) == 0);
    }
    if (i % 4 != 3) continue;
    field.update(map);
    CHECK(differences(field, distance_field{map, options}) == 0);
  }
  distance_field all{snapshots.front().map, options};
  all.update_all(map);
  CHECK(differences(all, field) == 0);
}

TEST_CASE("Distances in metres, their gradient, and what they promise") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  random_bits random{4};
  map_type map{0.1};
  for (int i = 0; i != 6; ++i) add_scan(map, random);
  const distance_field field{map, {.reach = 0.6, .unknown = unknown}};
  const nav::distance_view view = field.view();
  for (int i = 0; i != 2000; ++i) {
    const auto along = [&] { return random.uniform() * 3.0 - 1.5; };
    const vec3 p{along(), along(), along()};
    const double d = field.distance(p);
    CHECK(view.distance(p) == d);
    CHECK((d >= 0.0 && d <= 0.6));
    // Nothing is nearer than the clearance says.
    const double clear = field.clearance(p);
    if (clear > 0.0) CHECK_FALSE(overlaps(map, octree::sphere{p, clear - 1e-9}, {.unknown = unknown}));
    if (const auto nearest = field.nearest_obstacle(p)) {
      const vec3 center = map.grid().center(*map.grid().key(p));
      CHECK(std::min(0.6, (*nearest - center).norm()) == Approx(d).margin(1e-12));
    } else {
      CHECK(d == 0.6);
    }
    // The value at a centre is the voxel's; the gradient is the derivative, where no cell's border is near.
    const vec3 center = map.grid().center(*map.grid().key(p));
    CHECK(field.distance_and_gradient(center).distance == Approx(field.distance(center)).margin(1e-9));
    const auto [value, gradient] = field.distance_and_gradient(p);
    for (int axis = 0; axis != 3; ++axis) {
      const double h = 1e-5, place = (p[axis] - 0.05) / 0.1;
      if (std::abs(place - std::round(place)) < 1e-3) continue;
      vec3 step = vec3::Zero();
      step[axis] = h;
      const double slope = (field.distance_and_gradient(vec3{p + step}).distance -
                            field.distance_and_gradient(vec3{p - step}).distance) /
                           (2 * h);
      CHECK(gradient[axis] == Approx(slope).margin(1e-6));
    }
    CHECK(view.distance_and_gradient(p).distance == value);
  }
  const double outside = unknown == occupancy::occupied ? 0.0 : 0.6;
  CHECK(field.distance(vec3{1e9, 0.0, 0.0}) == outside);
  CHECK(field.distance(vec3{std::nan(""), 0.0, 0.0}) == outside);
  CHECK(field.distance_and_gradient(vec3{1e9, 0.0, 0.0}).distance == outside);
  CHECK(field.clearance(vec3{1e9, 0.0, 0.0}) == 0.0);
}

TEST_CASE("Interpolated distances are continuous up to where the grid ends") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const int depth = GENERATE(5, 16, 21);
  constexpr double cell = 0.1, reach = 0.5;
  map_type map{cell, depth};
  const std::uint32_t cells = map.grid().cells();
  const double half = cells / 2;
  // What is known lies in the corners of the grid, of least and of greatest coordinates.
  random_bits random{9};
  const auto in_corner = [&] {
    const auto along = [&] { return random.below(2) == 0 ? random.below(12) : cells - 1 - random.below(12); };
    return voxel_key{along(), along(), along()};
  };
  for (int i = 0; i != 60'000; ++i) {
    const voxel_key k = in_corner();
    map.edit_octant(k, [&](octree::block<float>& b) {
      const auto at = octree::morton_code(k) & 63U;
      b.known |= std::uint64_t{1} << at;
      b.value[at] = random.uniform() < 0.02 ? 1.0F : -1.0F;
    });
  }
  const distance_field field{map, {.reach = reach, .unknown = unknown}};
  // The values of voxels, by the definition: whoever is not known counts as `unknown`, and so does the outside.
  const auto is_obstacle = [&](const voxel_key& k) {
    if (std::max({k.x, k.y, k.z}) >= cells) return unknown == occupancy::occupied;
    const auto v = map.store().value(k);
    return v ? *v > 0.0F : unknown == occupancy::occupied;
  };
  const auto by_definition = [&](const voxel_key& k) {
    int least = 26;
    for (int z = -5; z <= 5; ++z)
      for (int y = -5; y <= 5; ++y)
        for (int x = -5; x <= 5; ++x)
          if (x * x + y * y + z * z < least &&
              is_obstacle({k.x + static_cast<std::uint32_t>(x), k.y + static_cast<std::uint32_t>(y),
                           k.z + static_cast<std::uint32_t>(z)}))
            least = x * x + y * y + z * z;
    return std::min(reach, cell * std::sqrt(static_cast<double>(least)));
  };
  for (int i = 0; i != 200; ++i) {
    const voxel_key k = in_corner();
    CHECK(field.distance(k) == Approx(by_definition(k)).margin(1e-12));
  }
  const auto value = [&](std::array<std::int64_t, 3> at) {
    const auto most = static_cast<std::int64_t>(cells) - 1;
    for (std::int64_t& a : at) {
      if (a >= 0 && a <= most) continue;
      if (unknown == occupancy::occupied) return 0.0;
      a = std::clamp<std::int64_t>(a, 0, most);
    }
    return field.distance(voxel_key{static_cast<std::uint32_t>(at[0]), static_cast<std::uint32_t>(at[1]),
                                    static_cast<std::uint32_t>(at[2])});
  };
  const auto interpolated = [&](const vec3& p) {
    std::array<std::int64_t, 3> low{};
    vec3 part;
    for (int i = 0; i != 3; ++i) {
      const double at = p[i] / cell + half - 0.5;
      low[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(std::floor(at));
      part[i] = at - std::floor(at);
    }
    double sum = 0.0;
    for (int i = 0; i != 8; ++i) {
      const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
      sum += (x == 0 ? 1.0 - part[0] : part[0]) * (y == 0 ? 1.0 - part[1] : part[1]) *
             (z == 0 ? 1.0 - part[2] : part[2]) * value({low[0] + x, low[1] + y, low[2] + z});
    }
    return sum;
  };
  double worst = 0.0, worst_slope = 0.0, most = 0.0;
  for (int i = 0; i != 3000; ++i) {
    vec3 p = map.grid().center(in_corner());
    for (int axis = 0; axis != 3; ++axis) p[axis] += random.uniform(-0.05, 0.05);
    // Half of them between the centre of an outermost voxel and the edge, and what is outside if that is an obstacle.
    if (i % 2 == 0)
      p[i / 2 % 3] =
          (i % 4 == 0 ? cell : -cell) * (half - random.uniform(unknown == occupancy::free ? 0.0 : -1.0, 0.5));
    const auto [d, gradient] = field.distance_and_gradient(p);
    most = std::max(most, d);
    worst = std::max(worst, std::abs(d - interpolated(p)));
    for (int axis = 0; axis != 3; ++axis) {
      const double h = 1e-4, at = p[axis] / cell + half - 0.5;
      if (std::abs(at - std::round(at)) < 0.01) continue;  // there the derivative jumps
      vec3 step = vec3::Zero();
      step[axis] = h;
      const double slope = (interpolated(p + step) - interpolated(p - step)) / (2 * h);
      worst_slope = std::max(worst_slope, std::abs(gradient[axis] - slope));
    }
  }
  CHECK(worst < 1e-8);
  CHECK(worst_slope < 1e-4);
  CHECK(most > 0.15);
  // The obstacle nearest to a voxel at the edge, which may lie outside.
  std::size_t outside = 0;
  for (int i = 0; i != 500; ++i) {
    const vec3 p = map.grid().center(in_corner());
    const auto nearest = field.nearest_obstacle(p);
    CHECK(nearest.has_value() == (field.voxels().squared(*map.grid().key(p)) != nav::squared_distances::far));
    if (!nearest) continue;
    CHECK(std::min(reach, (*nearest - p).norm()) == Approx(field.distance(p)).margin(1e-6));
    if (nearest->cwiseAbs().maxCoeff() > half * cell) ++outside;
  }
  CHECK((outside != 0) == (unknown == occupancy::occupied));
  // Outside of the grid.
  const vec3 far_away = vec3::Constant(2.0 * half * cell);
  CHECK(field.distance_and_gradient(far_away).distance == (unknown == occupancy::free ? reach : 0.0));
  CHECK(field.distance_and_gradient(far_away).gradient.isZero());
}

TEST_CASE("Signed distances are negative inside of obstacles, by how far it is out of them") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  random_bits random{12};
  map_type map{0.1};
  map.track_changes();
  const nav::distance_field_options options{.reach = 0.5, .unknown = unknown};
  nav::distance_field_options swapped = options;
  swapped.inside = true;
  distance_field outside{map, options}, inside{map, swapped};
  const std::uint32_t o = map.grid().cells() / 2;
  const auto set = [&](const voxel_key& k, float value) {
    map.edit_octant(k, [&](octree::block<float>& b) {
      const auto at = octree::morton_code(k) & 63U;
      b.known |= std::uint64_t{1} << at;
      b.value[at] = value;
    });
  };
  for (int round = 0; round != 4; ++round) {
    add_scan(map, random);
    // A block that is solid, and less so each time.
    for (std::uint32_t i = 0; i != 729; ++i)
      set({o + i % 9, o + i / 9 % 9, o + i / 81}, i % 9 < static_cast<std::uint32_t>(9 - round) ? 1.0F : -1.0F);
    outside.update(map);
    inside.update(map);
    CHECK(differences(inside, distance_field{map, swapped}) == 0);
    const auto is_obstacle = [&](const voxel_key& k) {
      const auto v = map.store().value(k);
      return v ? *v > 0.0F : unknown == occupancy::occupied;
    };
    int wrong = 0;
    std::array<int, 2> seen{};
    for (int i = 0; i != 300; ++i) {
      const voxel_key k{o - 12 + random.below(24), o - 12 + random.below(24), o - 12 + random.below(24)};
      int least = 26;  // to the nearest voxel of the other kind, squared
      for (int j = 0; j != 1331; ++j) {
        const int x = j % 11 - 5, y = j / 11 % 11 - 5, z = j / 121 - 5;
        if (x * x + y * y + z * z < least &&
            is_obstacle({k.x + static_cast<std::uint32_t>(x), k.y + static_cast<std::uint32_t>(y),
                         k.z + static_cast<std::uint32_t>(z)}) != is_obstacle(k))
          least = x * x + y * y + z * z;
      }
      const double expected = (is_obstacle(k) ? -1.0 : 1.0) * std::min(0.5, 0.1 * std::sqrt(least));
      const double found = nav::signed_distance(outside, inside, map.grid().center(k)).distance;
      wrong += std::abs(found - expected) > 1e-9 ? 1 : 0;
      ++seen[is_obstacle(k) ? 1 : 0];
    }
    CHECK(wrong == 0);
    CHECK(std::min(seen[0], seen[1]) > 20);
  }
  // On a face of the block it is 0, and the gradient leads out.
  const vec3 face{0.6, 0.45, 0.45};
  const auto at_face = nav::signed_distance(outside.view(), inside.view(), face);
  CHECK(at_face.distance == Approx(0.0).margin(1e-9));
  CHECK(at_face.gradient.x() > 0.9);
  CHECK(nav::signed_distance(outside, inside, vec3{face - vec3{0.2, 0.0, 0.0}}).gradient.x() > 0.9);
}

namespace {

/// A scan inside of the leaf, or across its face: it splits it.
void scan_near(map_type& map, random_bits& random, const vec3& place) {
  std::vector<vec3f> points = scan_from(random, vec3::Zero());
  for (vec3f& p : points) p = 0.3F * p + place.cast<float>();
  map.integrate(seq, points, place);
}

/// The distance of a place to a cube's inside or outside by the definition, squared, in voxels.
std::uint16_t cube_distance(const voxel_key& k, const voxel_key& low, std::uint32_t cells, bool inside_is_obstacle,
                            int reach) {
  std::int64_t outside = 0, inside = std::numeric_limits<std::int64_t>::max();
  for (const auto& [at, first] : {std::pair{k.x, low.x}, {k.y, low.y}, {k.z, low.z}}) {
    const std::int64_t below = std::int64_t{first} - at, above = std::int64_t{at} - (std::int64_t{first} + cells - 1);
    const std::int64_t away = std::max<std::int64_t>({below, above, 0});
    outside += away * away;
    inside = std::min({inside, 1 - below, 1 - above});
  }
  const std::int64_t d = inside_is_obstacle ? outside : inside > 0 ? inside * inside : 0;
  return d > reach * reach ? nav::squared_distances::far : static_cast<std::uint16_t>(d);
}

}  // namespace

TEST_CASE("Of a large leaf the field stores what is near its faces") {
  const bool is_obstacle = GENERATE(false, true);
  const nav::distance_field_options options{.reach = 0.5,
                                            .unknown = is_obstacle ? occupancy::free : occupancy::occupied};
  const voxel_key low{32768, 32768 - 256, 32768};
  map_type map{0.1};
  map.track_changes();
  map.set_unknown_node(low, 8, is_obstacle ? 0.5F : -0.5F);  // 256 voxels' edge
  distance_field field{map, options};
  CHECK(field.is_complete());
  CHECK(field.voxels().brick_count() > 5000);
  CHECK(field.voxels().brick_count() < 6600);  // of 32'768
  random_bits random{8};
  std::size_t wrong = 0;
  for (int i = 0; i != 100'000; ++i) {
    const auto along = [&](std::uint32_t first) {  // most of them near a face
      const std::uint32_t off = random.below(2) == 0 ? 20 : 276;
      return first - 10 + random.below(off) + (random.below(2) == 0 ? 0 : 276 - off);
    };
    const voxel_key k{along(low.x), along(low.y), along(low.z)};
    const std::uint16_t expected = cube_distance(k, low, 256, is_obstacle, 5);
    wrong += field.voxels().squared(k) != expected ? 1U : 0U;
    const auto nearest = field.voxels().nearest(k);
    if (nearest.has_value() != (expected != nav::squared_distances::far)) ++wrong;
    if (nearest && !field.voxels().is_obstacle(*nearest)) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(differences(field, distance_field{map, options}) == 0);
  // What splits the leaf: in its middle, and across an edge. Then everything is compared with what is left of it.
  const vec3 middle{12.8, -12.8, 12.8};
  for (const vec3& place : {middle, vec3{25.6, -25.6, 10.0}}) {
    scan_near(map, random, place);
    field.update(map);
    CHECK(field.distance(place) < 0.5);
  }
  CHECK(differences(field, distance_field{map, options}) == 0);
  const distance_field followed = field;
  field.update_all(map);
  CHECK(differences(field, followed) == 0);
  const nav::distance_view before = field.view();
  // What makes it another one, or forgets it.
  map.transform([](float v) { return std::optional{-v}; });
  field.update(map);
  CHECK(differences(field, distance_field{map, options}) == 0);
  map.transform([](float v) { return std::optional{-v}; });
  field.update(map);
  CHECK(map.evict_outside({middle - vec3::Constant(3.0), middle + vec3::Constant(20.0)}, [](const auto&) {}) > 0);
  field.update(map);
  CHECK(differences(field, distance_field{map, options}) == 0);
  map.clear();
  field.update(map);
  CHECK(field.voxels().brick_count() == 0);
  CHECK(field.voxels().squared({low.x + 70, low.y + 64, low.z + 64}) == field.voxels().elsewhere());
  CHECK(before.voxels().squared({low.x + 70, low.y + 64, low.z + 64}) != before.voxels().elsewhere());
}

TEST_CASE("Large leaves beside each other, and ones that are too large") {
  const bool is_obstacle = GENERATE(false, true);
  nav::distance_field_options options{.reach = 0.3, .unknown = is_obstacle ? occupancy::free : occupancy::occupied};
  const float value = is_obstacle ? 0.5F : -0.5F;
  map_type map{0.1};
  map.set_unknown_node({32768, 32768, 32768}, 8, value);         // 256 voxels
  map.set_unknown_node({32768, 32768, 32768 - 256}, 8, value);   // below
  map.set_unknown_node({32768 + 256, 32768, 32768}, 11, value);  // 32 voxels
  const distance_field field{map, options};
  CHECK(field.is_complete());
  // Nothing is said on the side that the two have in common, but at its edge.
  const auto inner = is_obstacle ? std::uint16_t{0} : nav::squared_distances::far;
  CHECK_FALSE(field.voxels().is_stored({32768 + 100, 32768 + 100, 32768}));
  CHECK(field.voxels().squared({32768 + 100, 32768 + 100, 32768}) == inner);
  CHECK(field.voxels().squared({32768 + 100, 32768 + 100, 32767}) == inner);
  CHECK(field.voxels().squared({32768 + 255, 32768 + 16, 32768 + 16}) == inner);
  CHECK(field.voxels().squared({32768 + 255, 32768 + 100, 32768}) == (is_obstacle ? 0 : 1));
  CHECK(field.voxels().squared({32768 + 257, 32768 + 100, 32768}) == (is_obstacle ? 4 : 0));
  // All of the grid, or too much for the limit.
  map_type whole{0.1};
  whole.set_unknown_node({0, 0, 0}, 1, value);
  const distance_field none{whole, options};
  CHECK_FALSE(none.is_complete());
  CHECK(none.voxels().brick_count() == 0);
  for (const std::size_t most : {7000U, 11'000U}) {  // one of the two
    options.max_bricks = most;
    distance_field some{map, options};
    for (int i = 0; i != 2; ++i, some.update(map)) {
      CHECK_FALSE(some.is_complete());
      CHECK(some.voxels().brick_count() > 5000);
      CHECK(some.voxels().brick_count() < 9000);
      for (std::uint32_t z = 32768 - 256; !is_obstacle && z != 32768 + 256; ++z)
        CHECK(some.voxels().squared({32768 + 80, 32768 + 2, z}) <= field.voxels().squared({32768 + 80, 32768 + 2, z}));
    }
  }
  map.clear();
  distance_field empty{map, options};
  CHECK(empty.is_complete());
}
