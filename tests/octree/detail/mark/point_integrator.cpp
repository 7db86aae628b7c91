// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/point_integrator.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinite = std::numeric_limits<float>::infinity();

using voxel = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;

/// A scan as sets of voxels.
struct observation {
  std::set<voxel> free{}, occupied{};
  std::size_t used = 0, truncated = 0, rejected = 0;
  friend bool operator==(const observation&, const observation&) = default;
};

[[nodiscard]] voxel tuple_of(const voxel_key& k) { return {k.x, k.y, k.z}; }

/// The same by the book: voxel by voxel, no masks, no windows, no threads.
struct reference {
  const voxel_grid& grid;
  float3 origin;
  const integration_options& options;
  observation seen{};

  void walk(const float3& end, const voxel_key& to) {
    const auto from = grid.key(origin);
    if (from) traverse_ray(grid, origin, *from, end, to, [&](const voxel_key& k) { seen.free.insert(tuple_of(k)); });
  }
  /// Where a ray that is too long ends.
  [[nodiscard]] float3 cut(const float3& p, double limit) const {
    const float3 ray = difference(p, origin);
    const auto n = static_cast<float>(length(ray));
    float3 end;
    for (std::size_t i = 0; i != 3; ++i) {
      const volatile float step = ray[i] / n * static_cast<float>(limit);
      end[i] = origin[i] + step;
    }
    return end;
  }
  void add(const float3& p) {
    const double limit = options.max_range;
    const double distance = length(difference(p, origin));
    const bool within = distance <= limit;
    const float3 end = within ? p : cut(p, limit);
    const auto to = grid.key(end);
    if (!to || !std::isfinite(static_cast<float>(distance))) {
      ++seen.rejected;
      return;
    }
    walk(end, *to);
    if (within) seen.occupied.insert(tuple_of(*to));
    ++(within ? seen.used : seen.truncated);
  }
  [[nodiscard]] float3 center(const voxel& v) const {
    const vec3 c = grid.center(voxel_key{std::get<0>(v), std::get<1>(v), std::get<2>(v)});
    return {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())};
  }
  void add_all(const std::vector<float3>& points) {
    std::set<voxel> hits;
    for (const float3& p : points) {
      if (options.mode == ray_mode::every_ray)
        add(p);
      else if (const auto to = grid.key(p))
        hits.insert(tuple_of(*to));
      else
        ++seen.rejected;
    }
    for (const voxel& v : hits) add(center(v));
  }
};

[[nodiscard]] observation expected(const voxel_grid& grid, const std::vector<float3>& points, const float3& origin,
                                   const integration_options& options) {
  reference r{grid, origin, options};
  r.add_all(points);
  for (const voxel& v : r.seen.occupied) r.seen.free.erase(v);
  return r.seen;
}

[[nodiscard]] observation observed(const scan_masks& masks, const integration_summary& summary) {
  observation seen;
  for (const scan_brick& b : masks.bricks()) {
    const voxel_key base = named_key(b.name);
    const auto key = [&](std::uint32_t place) {
      const voxel_key k = voxel_in_brick(place);
      return voxel{base.x + k.x, base.y + k.y, base.z + k.z};
    };
    auto free = b.free;
    for (std::size_t i = 0; i != 8; ++i) free[i] &= ~b.occupied[i];
    for_each_place(free, [&](std::uint32_t place) { seen.free.insert(key(place)); });
    for_each_place(b.occupied, [&](std::uint32_t place) { seen.occupied.insert(key(place)); });
  }
  seen.used = summary.used;
  seen.truncated = summary.truncated;
  seen.rejected = summary.rejected;
  return seen;
}

template <class Policy>
[[nodiscard]] observation marked(const Policy& policy, point_integrator& marker, const voxel_grid& grid,
                                 const std::vector<float3>& points, const float3& origin,
                                 const integration_options& options) {
  point_reader reader;
  const auto summary = marker.mark(policy, grid, reader.view(points), origin, options);
  return observed(marker.masks(), summary);
}

[[nodiscard]] std::vector<float3> random_scan(random_bits& random, std::size_t count, double half) {
  std::vector<float3> points(count);
  for (float3& p : points)
    for (float& c : p) c = static_cast<float>(random.uniform(-half, half));
  return points;
}

/// All options, in both modes and with several numbers of threads, against the reference.
void check(const voxel_grid& grid, const std::vector<float3>& points, const float3& origin,
           integration_options options) {
  point_integrator marker;
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    options.mode = mode;
    const observation want = expected(grid, points, origin, options);
    INFO("mode " << static_cast<int>(mode));
    CHECK((marked(seq, marker, grid, points, origin, options) == want));
    CHECK((marked(par.with(3), marker, grid, points, origin, options) == want));
  }
}

}  // namespace

TEST_CASE("A scan marks the voxels that its rays cross and its points hit") {
  random_bits random{191};
  for (const double resolution : {0.03, 0.1})
    for (const double max_range : {std::numeric_limits<double>::infinity(), 1.1, 0.0})
      check(voxel_grid{resolution}, random_scan(random, 700, 1.0), {0.13F, -0.21F, 0.35F}, {.max_range = max_range});
}

TEST_CASE("Points that are no numbers or absurd are rejected wherever they are") {
  random_bits random{192};
  auto points = random_scan(random, 300, 1.0);
  for (std::size_t i = 0; i < points.size(); i += 7) points[i][i % 3] = i % 2 == 0 ? not_a_number : infinite;
  for (std::size_t i = 3; i < points.size(); i += 17) points[i][i % 3] = -1e30F;
  for (std::size_t i = 5; i < points.size(); i += 17) points[i] = points[i - 1];
  check(voxel_grid{0.1}, points, {}, {});
  check(voxel_grid{0.1}, points, {0.5F, 0.5F, 0.5F}, {.max_range = 1.0});
  check(voxel_grid{0.1}, std::vector<float3>{}, float3{}, {});
  check(voxel_grid{0.1}, {float3{not_a_number, not_a_number, not_a_number}}, float3{}, {});

  point_integrator marker;
  const auto nowhere = marked(seq, marker, voxel_grid{0.1}, points, {not_a_number, 0.0F, 0.0F}, {});
  CHECK(nowhere.rejected == points.size());
  CHECK(nowhere.free.empty());
  CHECK(nowhere.occupied.empty());
}

TEST_CASE("An origin outside the grid marks points and no rays") {
  check(voxel_grid{0.1}, {{1.0F, 0.0F, 0.0F}, {3000.0F, 0.0F, 0.0F}}, {5000.0F, 0.0F, 0.0F}, {});
}

TEST_CASE("A scan of many points is the same for every number of threads") {
  random_bits random{196};
  const auto points = random_scan(random, 40000, 1.5);
  const voxel_grid grid{0.05};
  point_integrator marker;
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    const integration_options options{.max_range = 1.6, .mode = mode};
    const auto one = marked(seq, marker, grid, points, {}, options);
    CHECK((one == marked(par.with(2), marker, grid, points, {}, options)));
    CHECK((one == marked(par.with(5), marker, grid, points, {}, options)));
    CHECK((one == marked(seq, marker, grid, points, {}, options)));
  }
}

TEST_CASE("Points of any type and layout mark the same voxels") {
  struct survey_point {
    double z, y, x;
  };
  random_bits random{199};
  const voxel_grid grid{0.05};
  point_integrator marker;
  for (const std::size_t count : {0U, 1U, 15U, 16U, 17U, 255U, 256U, 700U, 5000U}) {
    const auto points = random_scan(random, count, 1.0);
    std::vector<survey_point> doubles;
    std::vector<std::array<float, 4>> padded;
    std::vector<vec3f> vectors;
    for (const float3& p : points) {
      doubles.push_back({static_cast<double>(p[2]), static_cast<double>(p[1]), static_cast<double>(p[0])});
      padded.push_back({p[0], p[1], p[2], not_a_number});
      vectors.emplace_back(p[0], p[1], p[2]);
    }
    for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
      const integration_options options{.mode = mode};
      const observation want = marked(seq, marker, grid, points, {}, options);
      const auto mark = [&](const auto& range) {
        point_reader reader;
        const auto summary = marker.mark(seq, grid, reader.view(range), float3{}, options);
        return observed(marker.masks(), summary);
      };
      CHECK((mark(points) == want));
      CHECK((mark(doubles) == want));
      CHECK((mark(padded) == want));
      CHECK((mark(vectors) == want));
    }
  }
}

TEST_CASE("The second of two equal scans allocates nothing") {
  random_bits random{198};
  const auto points = random_scan(random, 20000, 2.0);
  const voxel_grid grid{0.05};
  for (const ray_mode mode : {ray_mode::every_ray, ray_mode::discretized}) {
    point_integrator marker;
    const integration_options options{.max_range = 2.5, .mode = mode};
    const auto scan = [&] { return marker.mark(seq, grid, point_reader{}.view(points), float3{}, options); };
    scan();
    const std::size_t bytes = marker.memory_bytes();
    CHECK(bytes < (std::size_t{32} << 20U));
    const std::size_t before = test::allocations();
    scan();
    if (test::counts_allocations()) CHECK(test::allocations() == before);
    CHECK(marker.memory_bytes() == bytes);
  }
}
