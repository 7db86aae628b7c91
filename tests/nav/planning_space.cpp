// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A yard of 10 x 10 m for a robot that is a point, with a wall along y = 5 that ends at x = 8.
struct yard {
  static constexpr int dimensions = 2;
  [[nodiscard]] static double resolution() { return 0.5; }
  [[nodiscard]] static bool is_inside(const vec3& p) {
    return p.x() >= 0.0 && p.x() < 10.0 && p.y() >= 0.0 && p.y() < 10.0;
  }
  [[nodiscard]] static std::optional<octree::voxel_key> key(const vec3& p) {
    if (!is_inside(p)) return std::nullopt;
    return octree::voxel_key{static_cast<std::uint32_t>(2.0 * p.x()), static_cast<std::uint32_t>(2.0 * p.y()), 0};
  }
  [[nodiscard]] static bool contains(const octree::voxel_key& k) { return k.x < 20 && k.y < 20 && k.z == 0; }
  [[nodiscard]] static vec3 center(const octree::voxel_key& k) { return {0.5 * k.x + 0.25, 0.5 * k.y + 0.25, 0.0}; }
  [[nodiscard]] static vec3 clamped(const vec3& p) {
    return {std::fmin(std::fmax(p.x(), 0.0), 9.99), std::fmin(std::fmax(p.y(), 0.0), 9.99), 0.0};
  }
  [[nodiscard]] static bool is_free(const vec3& a, const vec3& b) {
    if (!is_inside(a) || !is_inside(b)) return false;
    if ((a.y() < 5.0) == (b.y() < 5.0)) return true;
    const double t = (5.0 - a.y()) / (b.y() - a.y());
    return a.x() + t * (b.x() - a.x()) > 8.0;
  }
  [[nodiscard]] static bool is_free(const vec3& p) { return is_inside(p); }
  [[nodiscard]] static bool is_free(const octree::voxel_key& k) { return contains(k); }
  [[nodiscard]] static bool is_surely_free(const vec3&, const vec3&) { return false; }
  [[nodiscard]] static double density(const octree::voxel_key&) { return 1.0; }
  [[nodiscard]] static bool is_uniform() { return true; }
  [[nodiscard]] static vec3 placed(const vec3& p) { return {p.x(), p.y(), 0.0}; }
  [[nodiscard]] static vec3 on_ground(const vec3& p) { return {p.x(), p.y(), 1.5}; }
};
struct without_ground : yard {
  void on_ground(const vec3&) const {}
};
struct of_four_dimensions : yard {
  static constexpr int dimensions = 4;
};

using view = nav::planning_view<octree::occupancy_octree<>>;

}  // namespace

static_assert(nav::planning_space<yard> && !nav::inflatable_space<yard>);
static_assert(!nav::planning_space<without_ground> && !nav::planning_space<of_four_dimensions>);
static_assert(nav::inflatable_space<view> && nav::inflatable_space<nav::floor_view>);

TEST_CASE("A path is found in any planning space") {
  const nav::found_path path = nav::find_path(yard{}, {1.0, 4.0, 0.3}, {1.0, 6.0, 0.7});
  REQUIRE(path.status == nav::path_status::found);
  double most_x = 0.0;
  for (std::size_t i = 0; i != path.points.size(); ++i) {
    CHECK(path.points[i].z() == 1.5);
    most_x = std::fmax(most_x, path.points[i].x());
    if (i > 0) CHECK(yard::is_free(path.points[i - 1], path.points[i]));
  }
  CHECK(most_x > 8.0);
  const double shortest = 2.0 * std::hypot(7.0, 1.0);
  CHECK(path.length >= shortest);
  CHECK(path.length < 1.1 * shortest);
  CHECK(nav::find_path(yard{}, {1.0, 4.0, 0.0}, {11.0, 4.0, 0.0}).status == nav::path_status::goal_outside);
}
