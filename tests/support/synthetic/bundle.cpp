// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/synthetic/bundle.hpp"

using namespace orbis;
using namespace orbis::io;
using namespace orbis::test;

namespace {

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Every point at least twice, and never twice by the same camera; how often in the mean.
template <class Observation, class Camera>
double views(const std::vector<Observation>& observations, std::size_t points, Camera camera_of) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  std::vector<int> count(points, 0);
  for (const Observation& o : observations) {
    REQUIRE(o.point < points);
    CHECK(seen.emplace(camera_of(o), o.point).second);
    ++count[o.point];
  }
  CHECK(*std::min_element(count.begin(), count.end()) >= 2);
  return static_cast<double>(observations.size()) / static_cast<double>(points);
}

}  // namespace

TEST_CASE("Generated BAL problems are what was asked for, and their truth explains the observations") {
  for (const bundle_scene scene : {bundle_scene::monument, bundle_scene::street}) {
    const synthetic_bal_options options{
        .scene = scene, .cameras = 40, .points = 800, .views_per_point = 5.0, .outlier_share = 0.05, .seed = 3};
    const synthetic_bal made = make_bal_problem(options);
    REQUIRE(made.truth.cameras.size() == 40);
    REQUIRE(made.truth.points.size() == 800);
    REQUIRE(made.measured.observations.size() == made.wrong.size());
    CHECK(views(made.truth.observations, 800, [](const auto& o) { return o.camera; }) == Approx(5.0).epsilon(0.15));

    std::vector<double> squares;
    std::vector<int> used(40, 0);
    for (std::size_t k = 0; k != made.wrong.size(); ++k) {
      const bal_observation &truth = made.truth.observations[k], &seen = made.measured.observations[k];
      REQUIRE(truth.camera < 40);
      ++used[truth.camera];
      CHECK(truth.pixel == project_bal(made.truth.cameras[truth.camera], made.truth.points[truth.point]).value());
      CHECK(std::abs(truth.pixel.x()) < 500.0);
      // In front of the camera, which looks along its negative z axis.
      const auto& c = made.truth.cameras[truth.camera];
      const vec3 p = so3::exp(vec3(c[0], c[1], c[2])) * made.truth.points[truth.point] + vec3(c[3], c[4], c[5]);
      CHECK(p.z() < 0.0);
      CHECK(std::abs(p.x() / p.z()) < 0.8);
      if (made.wrong[k] == 0) squares.push_back((seen.pixel - truth.pixel).squaredNorm());
    }
    CHECK(mean_of(squares) == Approx(2.0 * 0.25).epsilon(0.1));
    CHECK(*std::max_element(squares.begin(), squares.end()) < 20.0);
    const double share = 1.0 - static_cast<double>(squares.size()) / static_cast<double>(made.wrong.size());
    CHECK(share == Approx(0.05).margin(0.015));
    CHECK(*std::min_element(used.begin(), used.end()) > 10);

    // The start is off as asked: points by the sigma in each coordinate, focal lengths by 2 %.
    std::vector<double> off, focal;
    for (std::size_t j = 0; j != 800; ++j)
      off.push_back((made.measured.points[j] - made.truth.points[j]).squaredNorm());
    for (std::size_t i = 0; i != 40; ++i)
      focal.push_back(std::abs(made.measured.cameras[i][6] / made.truth.cameras[i][6] - 1.0));
    CHECK(mean_of(off) == Approx(3.0 * 0.01).epsilon(0.1));
    CHECK(mean_of(focal) == Approx(0.016).epsilon(0.4));

    const synthetic_bal again = make_bal_problem(options);
    CHECK(again.measured.cameras == made.measured.cameras);
    CHECK(again.measured.points == made.measured.points);
    synthetic_bal_options other = options;
    other.seed = 4;
    CHECK(make_bal_problem(other).measured.points != made.measured.points);
  }
}

TEST_CASE("Along a street cameras share points with their neighbours, round a monument with many") {
  const auto links_between = [](bundle_scene scene) {
    const bal_problem p = make_bal_problem({.scene = scene, .cameras = 60, .points = 1500}).truth;
    std::vector<std::vector<std::uint32_t>> of(p.points.size());
    for (const auto& o : p.observations) of[o.point].push_back(o.camera);
    std::set<std::pair<std::uint32_t, std::uint32_t>> links;
    for (const auto& cameras : of)
      for (const auto a : cameras)
        for (const auto b : cameras)
          if (a < b) links.emplace(a, b);
    return links.size();
  };
  CHECK(links_between(bundle_scene::street) < 60 * 20);
  CHECK(links_between(bundle_scene::monument) > links_between(bundle_scene::street));
}

TEST_CASE("A generated local map has the size, noise and errors that were asked for") {
  const synthetic_local_map_options options{.depth_share = 0.7, .outlier_share = 0.1};
  const synthetic_local_map made = make_local_map(options);
  REQUIRE(made.poses.size() == 30);
  REQUIRE(made.true_points.size() == 3000);
  REQUIRE(made.wrong.size() == made.observations.size());
  CHECK(std::accumulate(made.fixed.begin(), made.fixed.end(), 0) == 10);
  CHECK(views(made.observations, 3000, [](const auto& o) { return o.keyframe; }) == Approx(5.1).epsilon(0.05));

  std::vector<double> chi2;
  std::vector<std::uint8_t> by_free(3000, 0);
  int with_depth = 0;
  for (std::size_t k = 0; k != made.observations.size(); ++k) {
    const keyframe_observation& o = made.observations[k];
    if (made.fixed[o.keyframe] == 0) by_free[o.point] = 1;
    if (k > 0) CHECK(made.observations[k - 1].point <= o.point);
    with_depth += std::isnan(o.right) ? 0 : 1;
    if (made.wrong[k] != 0) continue;
    const vec3 p = made.true_poses[o.keyframe].inverse() * made.true_points[o.point];
    CHECK(p.z() > 0.4);
    const vec2 pixel = made.camera.project(p).value();
    chi2.push_back(o.information * (pixel - o.pixel).squaredNorm() / 0.64);
    if (!std::isnan(o.right)) CHECK(o.information * std::pow(pixel.x() - made.bf / p.z() - o.right, 2) < 0.64 * 25.0);
  }
  CHECK(mean_of(chi2) == Approx(2.0).epsilon(0.05));
  CHECK(*std::max_element(chi2.begin(), chi2.end()) < 40.0);
  CHECK(std::find(by_free.begin(), by_free.end(), 0) == by_free.end());
  const auto count = static_cast<double>(made.observations.size());
  CHECK(with_depth / count == Approx(0.7).margin(0.02));
  CHECK(static_cast<double>(chi2.size()) / count == Approx(0.9).margin(0.01));

  std::vector<double> moved;
  for (std::size_t k = 0; k != 30; ++k) {
    const double off = (made.poses[k].translation() - made.true_poses[k].translation()).norm();
    if (made.fixed[k] != 0)
      CHECK(off == 0.0);
    else
      moved.push_back(off * off);
  }
  CHECK(mean_of(moved) == Approx(3e-4).epsilon(0.4));
  const auto again = make_local_map(options);
  CHECK(again.points == made.points);
  CHECK(again.observations.back().pixel == made.observations.back().pixel);
}
