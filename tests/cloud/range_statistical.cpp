// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/range_statistical.hpp>
#include <orbis/cloud/statistical.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::explained_spacing;
using orbis::cloud::non_finite;
using orbis::cloud::range_statistical_decision;
using orbis::cloud::range_statistical_filter;
using orbis::cloud::range_statistical_inliers;
using orbis::cloud::range_statistical_options;

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
