// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::ball;
using nav::vertical_capsule;
using nav::vertical_cylinder;
using octree::bounding_box;
using octree::occupancy;
using map_type = octree::occupancy_octree<>;

namespace {

vec3 random_vector(random_bits& random, double half) {
  return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}
/// How far a robot that stands at `p` is from a box, or how deep it is in it; about, but with the right sign.
double gap(const vertical_cylinder& s, const vec3& p, const bounding_box& b) {
  const vec3 nearest = p.cwiseMax(b.min).cwiseMin(b.max);
  const double beside = (p - nearest).head<2>().norm() - s.radius;
  return std::max({beside, b.min.z() - (p.z() + s.high), p.z() + s.low - b.max.z()});
}
double gap(const vertical_capsule& s, const vec3& p, const bounding_box& b) {
  const vec3 nearest = p.cwiseMax(b.min).cwiseMin(b.max);
  const double over = std::max({0.0, b.min.z() - (p.z() + s.high), p.z() + s.low - b.max.z()});
  return std::hypot((p - nearest).head<2>().norm(), over) - s.radius;
}
double gap(const ball& s, const vec3& p, const bounding_box& b) {
  return (p - p.cwiseMax(b.min).cwiseMin(b.max)).norm() - s.radius;
}

template <class Shape>
void check_sweeps(random_bits& random, const Shape& shape) {
  std::array<int, 2> seen{};
  for (int i = 0; i != 800; ++i) {
    const vec3 a = random_vector(random, 1.0), corner = random_vector(random, 1.0);
    vec3 b = i % 8 == 0 ? a : random_vector(random, 1.0);
    if (i % 3 == 0) b.z() = a.z();
    if (i % 5 == 0) b.head<2>() = a.head<2>();
    const bounding_box box{corner, corner + (random_vector(random, 0.3) + vec3::Constant(0.3))};
    double least = 1e9;
    constexpr int steps = 4000;
    for (int k = 0; k <= steps; ++k) least = std::min(least, gap(shape, a + (b - a) * k / steps, box));
    if (std::abs(least) < 2e-3) continue;  // may be less between two steps
    const bool is_touched = touches(swept(shape, a, b), box);
    CHECK(is_touched == (least < 0.0));
    ++seen[is_touched ? 1 : 0];
    const bounding_box around = bounds_of(swept(shape, a, b));
    if (is_touched) CHECK(touches(around, box));
  }
  CHECK(seen[0] > 50);
  CHECK(seen[1] > 50);
}

/// A map of boxes in free space, in a shell of what is unknown.
map_type rooms(random_bits& random) {
  map_type map{0.1};
  const auto fill = [&](const std::array<std::uint32_t, 3>& low, const std::array<std::uint32_t, 3>& size,
                        float value) {
    for (std::uint32_t z = low[2]; z != low[2] + size[2]; ++z)
      for (std::uint32_t y = low[1]; y != low[1] + size[1]; ++y)
        for (std::uint32_t x = low[0]; x != low[0] + size[0]; ++x) {
          const octree::voxel_key k{32768 + x, 32768 + y, 32768 + z};
          map.edit_octant(k, [&](octree::block<float>& b) {
            const auto i = octree::morton_code(k) & 63U;
            b.known |= std::uint64_t{1} << i;
            b.value[i] = value;
          });
        }
  };
  fill({0, 0, 0}, {40, 40, 24}, -1.0F);
  for (int i = 0; i != 25; ++i)
    fill({random.below(36), random.below(36), random.below(20)},
         {1 + random.below(4), 1 + random.below(4), 1 + random.below(4)}, 1.0F);
  return map;
}

template <class Shape>
void check_view(const map_type& map, const Shape& shape, occupancy unknown) {
  random_bits random{31};
  const nav::distance_field field{map, {.reach = 1.0, .unknown = unknown}};
  const nav::planning_view view{map, field, shape};
  std::array<int, 2> seen{};
  int sure = 0, found = 0;
  const auto draw = [&] { return vec3{random_vector(random, 2.0) + vec3{2.0, 2.0, 0.0}}; };
  for (int i = 0; i != 700; ++i) {
    const vec3 a = draw(), b = i % 3 == 0 ? a : i % 3 == 1 ? vec3{a + random_vector(random, 0.4)} : draw();
    const bool expected = !overlaps(map, swept(shape, a, b), {.unknown = unknown});
    ++seen[expected ? 1 : 0];
    CHECK(view.is_free(a, b) == expected);
    const bool is_sure = view.is_surely_free(a, b);
    sure += is_sure ? 1 : 0;
    if (is_sure) CHECK(expected);
    const octree::voxel_key k = *map.grid().key(a);
    CHECK(view.is_free(k) == !overlaps(map, swept(shape, view.center(k), view.center(k)), {.unknown = unknown}));
  }
  CHECK(seen[0] > 50);
  CHECK(seen[1] > 50);
  CHECK(sure > 10);
  for (int i = 0; i != 12; ++i) {
    vec3 a = draw(), b = draw();
    while (!view.is_free(a)) a = draw();
    while (!view.is_free(b)) b = draw();
    const auto path = nav::find_path(view, a, b, {.max_expanded = 20'000});
    for (std::size_t j = 1; j < path.points.size(); ++j) {
      const vec3 p = path.points[j - 1], way = path.points[j] - p;
      const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / 0.001)));
      for (int k = 0; k <= steps; ++k)
        REQUIRE_FALSE(overlaps(map, swept(shape, p + way * k / steps, p + way * k / steps), {.unknown = unknown}));
    }
    found += path.status == nav::path_status::found ? 1 : 0;
  }
  CHECK(found > 5);
}

}  // namespace

TEST_CASE("What shapes sweep is what they touch at some moment") {
  random_bits random{30};
  check_sweeps(random, ball{0.3});
  check_sweeps(random, vertical_capsule{0.2, 0.1, 0.5});
  check_sweeps(random, vertical_capsule{0.3, -0.2, -0.2});
  check_sweeps(random, vertical_cylinder{0.2, 0.0, 0.6});
  check_sweeps(random, vertical_cylinder{0.5, -0.3, -0.1});
}

TEST_CASE("Balls cover a shape, and smaller ones lie in it") {
  random_bits random{32};
  const auto check = [&](const auto& shape) {
    const nav::ball_cover cover = covering_balls(shape);
    REQUIRE(cover.count >= 1);
    CHECK(cover.count < 50);  // also of what is thin: each is looked at on each step
    CHECK(cover.inner > 0.0);
    const auto is_in = [&](const vec3& p) { return gap(shape, vec3{0, 0, 0}, {p, p}) <= 0.0; };
    for (int i = 0; i != 3000; ++i) {
      const vec3 p = random_vector(random, 1.2);
      double nearest = 1e9;
      for (int k = 0; k != cover.count; ++k)
        nearest = std::min(nearest, (p - vec3{0.0, 0.0, cover.low + k * cover.spacing}).norm());
      if (is_in(p)) CHECK(nearest <= cover.outer + 1e-12);
      if (nearest < cover.inner - 1e-12) CHECK(is_in(p));
    }
  };
  check(ball{0.4});
  check(vertical_capsule{0.2, 0.1, 0.9});
  check(vertical_capsule{0.2, 0.3, 0.3});
  check(vertical_cylinder{0.2, -0.4, 0.7});
  check(vertical_cylinder{0.6, 0.0, 0.1});
  check(vertical_cylinder{0.002, -0.5, 0.5});
  check(vertical_cylinder{1e-12, 0.0, 1.0});
  check(vertical_capsule{0.002, -0.5, 0.5});
  check(vertical_capsule{1e-12, 0.0, 1.0});
}

TEST_CASE("Whether a shape is free is what the exact tests of the map say, and paths of it are free") {
  random_bits random{33};
  const map_type map = rooms(random);
  for (const occupancy unknown : {occupancy::occupied, occupancy::free}) {
    check_view(map, ball{0.15}, unknown);
    check_view(map, vertical_capsule{0.12, -0.1, 0.3}, unknown);
    check_view(map, vertical_cylinder{0.15, -0.2, 0.2}, unknown);
  }
}
