// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/select/local_shape.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using orbis::cloud::all_knn;
using orbis::cloud::detail::off_plane;

TEST_CASE("a point in a plane, at an edge, in a volume and beside a surface") {
  orbis::random_bits random{1};
  const auto mean_off_plane = [](const orbis::test::points& cloud, std::size_t n) {
    const auto table = all_knn(orbis::seq, cloud, 8);
    double sum = 0;
    for (std::size_t i = 0; i != n; ++i) sum += off_plane(cloud, i, table[i]);
    return sum / static_cast<double>(n);
  };
  orbis::test::points plane;
  for (int i = 0; i != 2000; ++i) {
    const double x = random.uniform();
    const double y = random.uniform();
    plane.push_back(orbis::vec3{x, y, 0.3 * x - 0.2 * y}.cast<float>());
  }
  CHECK(mean_off_plane(plane, 100) < 1e-3);
  CHECK(mean_off_plane(orbis::test::uniform_cloud(2000, 2), 100) > 0.3);
  auto above = plane;
  above.insert(above.begin(), orbis::vec3f{0.5F, 0.5F, 0.6F});
  const auto table = all_knn(orbis::seq, above, 8);
  CHECK(off_plane(above, 0, table[0]) > 0.9);
  CHECK(off_plane(above, 0, table[0].first(3)) == std::numeric_limits<double>::infinity());
  CHECK(off_plane(orbis::test::points(20, orbis::vec3f{1, 2, 3}), 0, table[0].first(0)) > 1);
}

TEST_CASE("what is usual around is a quantile over neighbours, and of any policy") {
  const auto cloud = orbis::test::uniform_cloud(3000, 3);
  const orbis::cloud::detail::neighbor_graph graph{
      orbis::seq, orbis::cloud::detail::make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 13),
      cloud.size(), 12};
  orbis::random_bits random{4};
  std::vector<float> values(cloud.size());
  for (float& v : values) v = static_cast<float>(random.uniform());
  values[7] = std::numeric_limits<float>::quiet_NaN();
  const auto smooth = orbis::cloud::detail::smoothed_over_neighbors(orbis::seq, graph, values, 1);
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    if (i == 7) {
      CHECK(std::isnan(smooth[i]));
      continue;
    }
    std::vector<float> around;
    graph.for_each_neighbor(i, 12, [&](std::uint32_t n) {
      if (n != 7) around.push_back(values[n]);
    });
    std::sort(around.begin(), around.end());
    const auto rank = static_cast<std::size_t>(0.35 * static_cast<double>(around.size() - 1) + 0.5);
    REQUIRE(smooth[i] == around[rank]);
  }
  const auto spread = [](const std::vector<float>& v) {
    double sum = 0, squares = 0;
    for (std::size_t i = 10; i != v.size(); ++i) sum += v[i], squares += v[i] * v[i];
    const auto n = static_cast<double>(v.size() - 10);
    return squares / n - sum / n * (sum / n);
  };
  const auto smoother = orbis::cloud::detail::smoothed_over_neighbors(orbis::par.with(3), graph, values);
  CHECK(spread(smoother) < 0.5 * spread(smooth));
  auto again = orbis::cloud::detail::smoothed_over_neighbors(orbis::seq, graph, values);
  again[7] = smoother[7];
  for (std::size_t i = 0; i != again.size(); ++i) {
    if (i != 7) REQUIRE(again[i] == smoother[i]);
  }
  CHECK(orbis::cloud::detail::smoothed_over_neighbors(orbis::seq, {}, {}).empty());
}

TEST_CASE("what is usual around is the same on every vector unit, however many values are missing") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const std::size_t size : {2U, 7U, 600U}) {
    const auto cloud = orbis::test::uniform_cloud(size, 5);
    const orbis::cloud::detail::neighbor_graph graph{
        orbis::seq, orbis::cloud::detail::make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, 13),
        cloud.size(), 12};
    const std::size_t width = std::min<std::size_t>(12, size - 1);
    orbis::random_bits random{6};
    for (const double missing : {0.0, 0.1, 0.9, 1.0}) {
      std::vector<float> values(cloud.size());
      for (float& v : values) v = random.uniform() < missing ? nan : static_cast<float>(random.uniform());
      std::vector<float> expected = values;
      for (std::size_t i = 0; i != cloud.size(); ++i) {
        std::vector<float> around;
        graph.for_each_neighbor(i, width, [&](std::uint32_t n) {
          if (!std::isnan(values[n])) around.push_back(values[n]);
        });
        std::sort(around.begin(), around.end());
        if (std::isnan(values[i]) || around.empty()) continue;
        expected[i] = around[static_cast<std::size_t>(0.35 * static_cast<double>(around.size() - 1) + 0.5)];
      }
      for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
        const orbis::simd::level_limit limit{level};
        const auto smooth = orbis::cloud::detail::smoothed_over_neighbors(orbis::seq, graph, values, 1);
        for (std::size_t i = 0; i != cloud.size(); ++i)
          REQUIRE((std::isnan(expected[i]) ? std::isnan(smooth[i]) : smooth[i] == expected[i]));
      }
    }
  }
}
