// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/cluster-inl.hpp>
#include <orbis/cloud/cluster.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::cluster_filter;
using orbis::cloud::cluster_inliers;
using orbis::cloud::cluster_options;
using orbis::cloud::cluster_result;
using orbis::test::points;

namespace {

/// A wall of points 1 cm apart, and a ball of `size` points `distance` in front of it.
points wall_and_ball(std::size_t size, double distance) {
  points out;
  for (int x = 0; x != 60; ++x)
    for (int y = 0; y != 60; ++y) out.emplace_back(0.01F * static_cast<float>(x), 0.01F * static_cast<float>(y), 2.0F);
  orbis::random_bits random{size};
  for (std::size_t i = 0; i != size; ++i) {
    const orbis::vec3 offset{random.uniform(), random.uniform(), -random.uniform()};
    out.push_back((orbis::vec3{0.3, 0.3, 2.0 - distance} + 0.02 * offset).cast<float>());
  }
  return out;
}

/// Components by flood fill over the links, written down plainly.
std::vector<std::uint32_t> reference_components(const points& cloud, const cluster_options& options) {
  const auto table = orbis::cloud::all_knn(orbis::seq, cloud, options.neighbors);
  const auto spacing = orbis::test::mean_distances_of(table, options.neighbors);
  std::vector<std::vector<std::uint32_t>> links(cloud.size());
  for (std::uint32_t i = 0; i != cloud.size(); ++i) {
    for (const auto& [j, distance] : table[i]) {
      const float limit = std::min(spacing[i], spacing[j]);
      if (distance > static_cast<float>(options.reach) * limit) continue;
      links[i].push_back(j);
      links[j].push_back(i);
    }
  }
  std::vector<std::uint32_t> component(cloud.size(), cluster_result::none);
  std::uint32_t next = 0;
  for (std::uint32_t i = 0; i != cloud.size(); ++i) {
    if (component[i] != cluster_result::none || !orbis::test::finite(cloud[i])) continue;
    std::vector<std::uint32_t> open{i};
    component[i] = next;
    while (!open.empty()) {
      const std::uint32_t at = open.back();
      open.pop_back();
      for (const std::uint32_t j : links[at]) {
        if (component[j] != cluster_result::none) continue;
        component[j] = next;
        open.push_back(j);
      }
    }
    ++next;
  }
  return component;
}

/// What `separate` makes of a cloud without the points that are `gone`. `spacing`: empty for the mean distance.
cluster_result separated(const points& cloud, const std::vector<char>& gone, const std::vector<float>& spacing,
                         const cluster_options& options = {}) {
  namespace detail = orbis::cloud::detail;
  const detail::neighbor_graph graph{
      orbis::par, detail::make_leaves(orbis::par, orbis::cloud::detail::viewed_points{cloud}, options.neighbors + 1),
      cloud.size(), options.neighbors};
  std::vector<float> spacings = graph.mean_distance(orbis::par, options.neighbors);
  std::vector<char> left_out(graph.size(), 0);
  const std::vector<std::uint32_t> place = graph.places(cloud.size());
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    if (!gone.empty()) left_out[place[i]] = gone[i];
    if (!spacing.empty()) spacings[place[i]] = spacing[i];
  }
  return detail::numbered(
      detail::separate(orbis::par, graph, left_out, spacings, options), cloud.size(),
      [&](std::size_t i) { return left_out[place[i]] != 0 ? -1 : static_cast<std::int64_t>(place[i]); },
      [](std::size_t) { return false; });
}

}  // namespace

TEST_CASE("components are those of a flood fill, under every policy") {
  auto clouds = orbis::test::all_clouds();
  clouds.emplace_back("wall and ball", wall_and_ball(25, 0.3));
  points bits = orbis::test::room_cloud(60, 45, 0.004, 5);  // many small components, among them copies
  for (std::size_t i = 0; i != 60; ++i) bits.push_back(bits[40 * i]);
  clouds.emplace_back("bits", bits);
  for (const auto& [name, cloud] : clouds) {
    for (const double reach : {0.0, 1.1, 3.0}) {
      INFO(name << " reach " << reach);
      const cluster_options options{.neighbors = 6, .reach = reach};
      const auto alone = cluster_filter(orbis::seq, cloud, options);
      CHECK(alone.component == reference_components(cloud, options));
      std::vector<std::uint32_t> sizes(alone.sizes.size(), 0);
      for (const std::uint32_t c : alone.component) {
        if (c != cluster_result::none) ++sizes[c];
      }
      CHECK(sizes == alone.sizes);
      for (const unsigned threads : {2U, 7U}) {
        const auto together = cluster_filter(orbis::par.with(threads), cloud, options);
        CHECK(together.component == alone.component);
        CHECK(together.inliers == alone.inliers);
      }
    }
  }
}

TEST_CASE("small components far from the surface go, and no others") {
  struct scene {
    std::size_t size;
    double distance;
    bool goes;
  };
  for (const scene& s : {scene{25, 0.3, true}, scene{1, 0.3, true}, scene{2, 0.2, true}, scene{25, 0.045, false},
                         scene{1, 0.03, false}, scene{400, 0.3, false}}) {
    INFO(s.size << " points at " << s.distance << " m");
    const points cloud = wall_and_ball(s.size, s.distance);
    const auto inliers = cluster_inliers(orbis::par, cloud);
    CHECK(inliers.size() == (s.goes ? cloud.size() - s.size : cloud.size()));
  }
  // How small and how far is up to the caller.
  CHECK(cluster_inliers(orbis::seq, wall_and_ball(25, 0.3), {.min_size = 20}).size() == 3625);
  CHECK(cluster_inliers(orbis::seq, wall_and_ball(25, 0.3), {.min_gap = 50}).size() == 3625);
  CHECK(cluster_inliers(orbis::seq, wall_and_ball(400, 0.3), {.min_size = 500}).size() == 3600);
}

TEST_CASE("a component is as far away as its closest point") {
  points cloud = wall_and_ball(0, 0);
  for (int i = 0; i != 20; ++i) cloud.emplace_back(0.3F, 0.3F, 2.0F - 0.05F - 0.02F * static_cast<float>(i));
  CHECK(cluster_inliers(orbis::seq, cloud).size() == cloud.size());  // it starts 5 spacings before the wall
  for (std::size_t i = 3600; i != cloud.size(); ++i) cloud[i].z() -= 1.0F;
  CHECK(cluster_inliers(orbis::seq, cloud).size() == 3600);
}

TEST_CASE("where nothing is large everything stays") {
  CHECK(cluster_inliers(orbis::seq, orbis::test::uniform_cloud(20, 1)).size() == 20);
  CHECK(cluster_inliers(orbis::seq, points{}).empty());
  CHECK(cluster_inliers(orbis::seq, points{{1, 2, 3}}).size() == 1);
  points two = wall_and_ball(0, 0);
  two.resize(13);
  CHECK(cluster_inliers(orbis::seq, two).size() == 13);
}

TEST_CASE("points that are gone link nothing and stay gone") {
  points cloud = wall_and_ball(25, 0.3);
  std::vector<char> gone(cloud.size(), 0);
  for (int i = 1; i != 31; ++i) {  // a bridge from the ball to the wall
    cloud.emplace_back(0.31F, 0.31F, 1.68F + 0.01F * static_cast<float>(i));
    gone.push_back(1);
  }
  CHECK(separated(cloud, {}, {}).inliers.size() == cloud.size());
  const auto without = separated(cloud, gone, {});
  CHECK(without.inliers.size() == 3600);
  CHECK(without.component.back() == cluster_result::none);
  CHECK(std::count(without.removed.begin(), without.removed.end(), char{1}) >= 1);
  // Spacings may come from elsewhere.
  const std::vector<float> wide(cloud.size(), 0.2F);
  CHECK(separated(cloud, gone, wide).inliers.size() == cloud.size() - 30);
}

TEST_CASE("spacings that are not known for lack of any link what they like, and with no gap nothing is close") {
  const points cloud = wall_and_ball(25, 0.3);
  std::vector<float> spacing(cloud.size(), 0.01F);
  std::fill_n(spacing.begin(), 3600, std::numeric_limits<float>::infinity());
  CHECK(separated(cloud, {}, spacing, {.min_gap = 0}).inliers.size() == 3600);
  CHECK(separated(cloud, {}, spacing, {.min_gap = 1}).inliers.size() == cloud.size());
}

TEST_CASE("points that are not finite are in no component") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  points cloud = wall_and_ball(25, 0.3);
  cloud.emplace_back(nan, 0.0F, 0.0F);
  CHECK(cluster_inliers(orbis::seq, cloud).size() == 3600);
  const auto kept = cluster_filter(orbis::seq, cloud, {.non_finite = orbis::cloud::non_finite::keep});
  CHECK(kept.inliers.size() == 3601);
  CHECK(kept.inliers.back() == cloud.size() - 1);
  CHECK(kept.component.back() == cluster_result::none);
}

TEST_CASE("a component so far that squared distances overflow goes") {
  points cloud = wall_and_ball(0, 0);
  for (int i = 0; i != 5; ++i) cloud.emplace_back(3e25F, 1e20F * static_cast<float>(i), 0.0F);
  CHECK(cluster_inliers(orbis::seq, cloud, {.neighbors = 4}).size() == 3600);
}
