// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/statistical.hpp>
#include <orbis/io/pcd.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using orbis::cloud::explained_spacing;
using orbis::cloud::non_finite;
using orbis::cloud::range_statistical_decision;
using orbis::cloud::range_statistical_filter;
using orbis::cloud::range_statistical_inliers;
using orbis::cloud::range_statistical_options;
using orbis::cloud::statistical_inliers;

TEST_CASE("the statistical filter keeps the points its definition keeps") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    for (const std::size_t k : {1U, 10U, 50U}) {
      const auto distances = orbis::test::reference_mean_distances(cloud, k);
      for (const double alpha : {0.0, 1.0, 2.5}) {
        for (const auto policy : {non_finite::drop, non_finite::keep}) {
          INFO(name << " k " << k << " alpha " << alpha);
          CHECK(statistical_inliers(orbis::par, cloud,
                                    {.neighbors = k, .sigma_multiplier = alpha, .non_finite = policy}) ==
                orbis::test::reference_decision(cloud, distances, alpha, policy == non_finite::keep));
        }
      }
    }
  }
}

TEST_CASE("the statistical filter gives the same under every policy and number of threads") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const auto alone = statistical_inliers(orbis::seq, cloud, {.neighbors = 20});
    for (const unsigned threads : {1U, 2U, 3U, 8U}) {
      CHECK(statistical_inliers(orbis::par.with(threads), cloud, {.neighbors = 20}) == alone);
    }
  }
}

TEST_CASE("the point itself does not count as its neighbour") {
  // Three points on a line: with k = 1 the mean distances are 1, 1 and 3.
  const std::vector<orbis::vec3f> cloud{{0, 0, 0}, {1, 0, 0}, {4, 0, 0}};
  const auto result = orbis::cloud::statistical_filter(orbis::seq, cloud, {.neighbors = 1, .sigma_multiplier = 1.0});
  CHECK(result.mean_distance == std::vector<float>{1, 1, 3});
  CHECK(result.mean == Approx(5.0 / 3.0));
  CHECK(result.standard_deviation == Approx(std::sqrt(4.0 / 3.0)));
  CHECK(result.threshold == Approx(result.mean + result.standard_deviation));
  CHECK(result.inliers == std::vector<std::uint32_t>{0, 1});
}

TEST_CASE("a variance that rounding makes negative is none, and everything stays") {
  // Nearly equal distances: the sums of squares cancel to less than nothing. The products are rounded to
  // float, so that their sum can fall short by more than the spread.
  bool met = false;
  for (int i = 0; i != 200; ++i) {
    const float value = 0.1F + 0.001F * static_cast<float>(i);
    std::vector<float> distances(1000, value);
    distances[7] = std::nextafter(value, 1.0F);
    double sum = 0;
    double squares = 0;
    for (const float d : distances) {
      sum += d;
      volatile float product = d * d;
      squares += product;
    }
    const double variance = (squares - sum * sum / 1000) / 999;
    const auto result = orbis::cloud::statistical_decision(distances, {.sigma_multiplier = 1.0});
    if (variance < 0) {
      met = true;
      CHECK(result.standard_deviation == 0);
      CHECK(result.threshold == std::numeric_limits<double>::infinity());
      CHECK(result.inliers.size() == distances.size());
    } else {
      CHECK(result.standard_deviation == std::sqrt(variance));
    }
  }
  CHECK(met);
}

TEST_CASE("distances whose squares overflow keep everything") {
  constexpr float inf = std::numeric_limits<float>::infinity();
  for (const float far : {inf, 1e30F}) {
    const auto result = orbis::cloud::statistical_decision({1, 2, far, 1});
    CHECK(result.inliers.size() == 4);
    CHECK(result.standard_deviation == std::numeric_limits<double>::infinity());
    CHECK(result.threshold == std::numeric_limits<double>::infinity());
    CHECK(orbis::cloud::statistical_decision({1, 2, far, 1}, {.sigma_multiplier = 0.0}).inliers.size() == 4);
  }
}

TEST_CASE("a decision on known distances keeps or drops those that are none") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> distances{1, nan, 1, 1, 1, 9, nan};
  CHECK(orbis::cloud::statistical_decision(distances).inliers == std::vector<std::uint32_t>{0, 2, 3, 4});
  CHECK(orbis::cloud::statistical_decision(distances, {.non_finite = non_finite::keep}).inliers ==
        std::vector<std::uint32_t>{0, 1, 2, 3, 4, 6});
  CHECK(orbis::cloud::statistical_decision({nan, nan}).inliers.empty());
  CHECK(orbis::cloud::statistical_decision({}).inliers.empty());
}

TEST_CASE("an empty cloud and a single point are left as they are") {
  CHECK(statistical_inliers(orbis::par, std::vector<orbis::vec3f>{}).empty());
  CHECK(statistical_inliers(orbis::par, std::vector<orbis::vec3f>{{1, 2, 3}}) == std::vector<std::uint32_t>{0});
}

TEST_CASE("the statistical filter takes anyone's points in place") {
  struct labelled {
    double x, y, z;
    int label;
  };
  const auto cloud = orbis::test::uniform_cloud(500, 77);
  std::vector<labelled> structs;
  std::vector<std::array<float, 3>> arrays;
  for (const auto& p : cloud) {
    structs.push_back({p.x(), p.y(), p.z(), 0});
    arrays.push_back({p.x(), p.y(), p.z()});
  }
  const auto expected = statistical_inliers(orbis::seq, cloud, {.neighbors = 8});
  CHECK(expected.size() < cloud.size());
  CHECK(statistical_inliers(orbis::seq, structs, {.neighbors = 8}) == expected);
  CHECK(statistical_inliers(orbis::seq, std::span{arrays}, {.neighbors = 8}) == expected);
}

TEST_CASE("identical points do not take quadratic time") {
  // By brute force these are 4 * 10^12 distances, an hour; it takes a second.
  const std::vector<orbis::vec3f> identical(2'000'000, orbis::vec3f{0.5F, 0.5F, 0.5F});
  CHECK(statistical_inliers(orbis::seq, identical).size() == identical.size());
}

TEST_CASE("a real cloud is filtered by the definition") {
  ORBIS_NEEDS_DATA("clouds/fragment.pcd");
  const auto read = orbis::io::read_pcd(orbis::test::data_dir() / "clouds/fragment.pcd");
  REQUIRE(read.has_value());
  // Brute force takes its time: a contiguous part of the scene.
  const orbis::test::points cloud(read->points.begin(), read->points.begin() + 6000);
  const auto distances = orbis::test::reference_mean_distances(cloud, 50);
  CHECK(statistical_inliers(orbis::par, cloud, {.neighbors = 50, .non_finite = non_finite::keep}) ==
        orbis::test::reference_decision(cloud, distances, 1.0, true));
  const auto all = statistical_inliers(orbis::seq, read->points);
  CHECK(all == statistical_inliers(orbis::par.with(3), read->points));
  CHECK(all.size() > read->size() / 2);
  CHECK(all.size() < read->size());
}

TEST_CASE("the holes of a real organised cloud are dropped or kept") {
  ORBIS_NEEDS_DATA("clouds/table_scene_mug_stereo_textured.pcd");
  const auto read = orbis::io::read_pcd(orbis::test::data_dir() / "clouds/table_scene_mug_stereo_textured.pcd");
  REQUIRE(read.has_value());
  std::size_t holes = 0;
  for (const auto& p : read->points) holes += orbis::is_finite(p) ? 0 : 1;
  CHECK(holes > 0);
  const auto dropped = statistical_inliers(orbis::par, read->points, {.neighbors = 10});
  const auto kept = statistical_inliers(orbis::par, read->points, {.neighbors = 10, .non_finite = non_finite::keep});
  CHECK(kept.size() == dropped.size() + holes);
}

TEST_CASE("the explained spacing grows with range, then with its square") {
  const range_statistical_options options{.angle = 0.002, .noise = 0.001};
  CHECK(explained_spacing(0.2, options) == Approx(0.0004).epsilon(0.01));
  CHECK(explained_spacing(2.0, options) == Approx(std::sqrt(2.0) * 0.004));
  CHECK(explained_spacing(200.0, options) == Approx(40.0).epsilon(0.01));
  CHECK(explained_spacing(0.0, options) == explained_spacing(options.least_range, options));
}

TEST_CASE("spacings are judged relative to what their range explains") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const orbis::vec3 origin{0.1, 0.2, -1.0};
    const range_statistical_options options{.neighbors = 8, .sigma_multiplier = 1.5};
    const auto spacing = orbis::test::reference_mean_distances(cloud, 8);
    std::vector<double> u(cloud.size(), std::numeric_limits<double>::quiet_NaN());
    double sum = 0;
    double n = 0;
    for (std::size_t i = 0; i != cloud.size(); ++i) {
      if (std::isnan(spacing[i])) continue;
      const auto range = static_cast<float>((cloud[i].cast<double>() - origin).norm());
      u[i] = static_cast<float>(spacing[i] / explained_spacing(range, options));
      sum += u[i];
      n += 1;
    }
    double squares = 0;
    for (const double x : u) squares += std::isnan(x) ? 0 : (x - sum / n) * (x - sum / n);
    const double threshold = sum / n * (1 + 0x1p-20) + (n > 1 ? 1.5 * std::sqrt(squares / (n - 1)) : 0.0);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i != cloud.size(); ++i) {
      if (orbis::test::finite(cloud[i]) && !(u[i] > threshold)) expected.push_back(i);
    }
    const auto found = range_statistical_filter(orbis::seq, cloud, {.common = origin}, options);
    CHECK(found.inliers == expected);
    if (n > 0) CHECK(found.mean == Approx(sum / n));
    for (const unsigned threads : {2U, 3U, 8U}) {
      CHECK(range_statistical_inliers(orbis::par.with(threads), cloud, {.common = origin}, options) == expected);
    }
  }
}

TEST_CASE("a surface that recedes keeps its far end, and outliers up close go") {
  orbis::test::points cloud;  // a floor under a camera at the origin, 0.8 to 8 m away
  constexpr double f = 525;
  orbis::random_bits random{4};
  for (int v = 52; v != 480; v += 2) {
    for (int u = -200; u < 200; u += 2) {
      const double z = 0.8 * f / v;
      const double noisy = z + 1.425e-3 * z * z * random.normal();
      cloud.push_back((orbis::vec3{u / f, v / f, 1.0} * noisy).cast<float>());
    }
  }
  const std::size_t floor = cloud.size();
  for (int i = 0; i != 60; ++i) {  // in the air, 3 cm apart: closer together than the points of the far floor
    cloud.emplace_back(0.03F * static_cast<float>(i % 10) - 0.15F, -0.2F + 0.03F * static_cast<float>(i / 10), 0.6F);
  }
  struct lost {
    double far_floor;
    double outliers;
  };
  const auto lost_of = [&](const std::vector<std::uint32_t>& inliers) {
    std::vector<char> kept(cloud.size(), 0);
    for (const auto i : inliers) kept[i] = 1;
    double far = 0;
    double far_kept = 0;
    for (std::size_t i = 0; i != floor; ++i) {
      if (cloud[i].z() < 4) continue;
      far += 1;
      far_kept += kept[i];
    }
    const auto outliers_kept = std::count(kept.begin() + static_cast<std::ptrdiff_t>(floor), kept.end(), char{1});
    return lost{1 - far_kept / far, 1 - static_cast<double>(outliers_kept) / 60};
  };
  const lost ranged = lost_of(range_statistical_inliers(orbis::par, cloud, {.common = orbis::vec3{0, 0, 0}},
                                                        {.neighbors = 12, .sigma_multiplier = 2}));
  const lost plain =
      lost_of(orbis::cloud::statistical_inliers(orbis::par, cloud, {.neighbors = 12, .sigma_multiplier = 2}));
  INFO("range " << ranged.far_floor << " " << ranged.outliers << ", plain " << plain.far_floor << " "
                << plain.outliers);
  CHECK(ranged.outliers == 1.0);
  CHECK(ranged.far_floor < 0.15);
  CHECK(plain.outliers < 0.1);
}

TEST_CASE("points of unknown range stay") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> spacing{1, 1, 1, 1, 1, 1, 1, 50, 50, nan, inf};
  std::vector<float> ranges(11, 1.0F);
  ranges[8] = nan;
  const auto dropped = range_statistical_decision(spacing, ranges);
  CHECK(dropped.judged == 8);
  CHECK(dropped.inliers == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 8});
  const auto kept = range_statistical_decision(spacing, ranges, {.non_finite = non_finite::keep});
  CHECK(kept.inliers == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 8, 9});

  const auto cloud = orbis::test::uniform_cloud(100, 1);
  const auto unknown = range_statistical_filter(orbis::seq, cloud, {}, {.neighbors = 5});
  CHECK(unknown.judged == 0);
  CHECK(unknown.inliers.size() == cloud.size());
  const std::vector<orbis::vec3f> one{{1, 2, 3}};
  CHECK(range_statistical_inliers(orbis::seq, one, {.common = orbis::vec3{0, 0, 0}}).size() == 1);
}

TEST_CASE("equal quotients are all usual") {
  for (const float spacing : {0.1F, 0.3F, 1e-7F}) {
    const std::vector<float> spacings(1001, spacing);
    const std::vector<float> ranges(1001, 1.7F);
    CHECK(range_statistical_decision(spacings, ranges).inliers.size() == 1001);
  }
}
