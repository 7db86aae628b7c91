// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/slam/detail/shutter/row_equations.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

const camera::pinhole undistorted{640, 480, 525.0, 525.0, 319.5, 239.5};
const camera::radial_tangential distorted{{640, 480, 517.3, 516.5, 318.6, 255.3},
                                          {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};

const vec6 motion = stacked(vec3(0.3, -0.4, 0.2), vec3(0.7, -0.9, 0.5));
const se3 pose = se3::exp(stacked(vec3(0.5, -0.2, 0.1), vec3(0.3, -0.4, 0.2)));

/// Observations of all kinds: with and without depth and smear, good and bad ones, and points behind the camera.
std::vector<row_observation> observations_of(std::size_t n) {
  std::vector<row_observation> all(n);
  random_bits random{5};
  for (row_observation& o : all) {
    const double z = random.uniform(0.6, 3.0) * (random.uniform(0.0, 1.0) < 0.1 ? -1.0 : 1.0);
    o.seen.point = pose * vec3(z * random.uniform(-0.4, 0.4), z * random.uniform(-0.3, 0.3), z);
    o.seen.pixel = {random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)};
    if (const auto at = undistorted.project(pose.inverse() * o.seen.point); at && random.uniform(0.0, 1.0) < 0.8)
      o.seen.pixel = *at + vec2(random.normal(), random.normal());
    if (random.uniform(0.0, 1.0) < 0.7) o.seen.right = o.seen.pixel.x() - 400.0 / std::abs(z) + random.normal();
    if (random.uniform(0.0, 1.0) < 0.5) o.seen.smear = {random.normal(), random.normal()};
    o.seen.information = random.uniform(0.2, 1.0);
    o.seen.depth_weight = random.uniform(0.5, 1.0);
    o.time = random.uniform(-0.015, 0.015);
  }
  return all;
}

template <class Camera>
row_lanes in_lanes(const std::vector<row_observation>& observations, const optimize::reprojection<Camera>& model) {
  row_lanes lanes;
  for (const row_observation& o : observations) lanes.add(o, model);
  return lanes;
}

/// The same sums, observation by observation.
struct plain_sums {
  mat6 h[3] = {mat6::Zero(), mat6::Zero(), mat6::Zero()};
  vec6 g[2] = {vec6::Zero(), vec6::Zero()};
  double cost = 0.0;
};
template <class Camera>
plain_sums sum_plainly(const std::vector<row_observation>& observations, const optimize::reprojection<Camera>& model,
                       const se3& T_camera_world, const vec6& twist, bool with_depth) {
  plain_sums sums;
  for (row_observation o : observations) {
    if (!with_depth) o.seen.right = std::numeric_limits<double>::quiet_NaN();
    const vec3 q = camera::moved_by(twist, -o.time, T_camera_world * o.seen.point);
    mat3 by_point;
    const auto r = model.residual(q, o.seen, by_point);
    if (!r) continue;
    matrix<3, 6> j;
    j << by_point, -by_point * hat<double>(q);
    const double error = std::sqrt(r->squaredNorm() * o.seen.information);
    sums.cost += error <= row_loss_width ? 0.5 * error * error : row_loss_width * (error - 0.5 * row_loss_width);
    const double weight = o.seen.information * std::min(1.0, row_loss_width / error);
    for (int k = 0; k != 3; ++k) sums.h[k] += weight * std::pow(-o.time, k) * j.transpose() * j;
    for (int k = 0; k != 2; ++k) sums.g[k] += weight * std::pow(-o.time, k) * j.transpose() * *r;
  }
  return sums;
}

template <class Camera>
void check_sums(const Camera& camera) {
  const optimize::reprojection<Camera> model{camera, 400.0};
  const se3 T_camera_world = pose.inverse();
  for (const std::size_t n : {0, 1, 8, 203})
    for (const bool with_depth : {true, false}) {
      const auto seen = observations_of(n);
      const row_sums found = sum_rows(in_lanes(seen, model), model, T_camera_world, motion, with_depth);
      const plain_sums expected = sum_plainly(seen, model, T_camera_world, motion, with_depth);
      for (std::size_t k = 0; k != 3; ++k)
        CHECK((found.matrix(k) - expected.h[k]).norm() <= 1e-9 * expected.h[k].norm());
      for (std::size_t k = 0; k != 2; ++k)
        CHECK((found.gradient(k) - expected.g[k]).norm() <= 1e-9 * expected.g[k].norm());
      CHECK(found.cost == Approx(expected.cost));
    }
}

}  // namespace

TEST_CASE("The sums over rows are those of the residuals and their derivatives") {
  check_sums(undistorted);
  check_sums(distorted);
  check_sums(camera::any_camera{distorted});
}

TEST_CASE("Gradients of sums over rows are those of their cost, by pose and by twist") {
  const optimize::reprojection<camera::radial_tangential> model{distorted, 400.0};
  const row_lanes seen = in_lanes(observations_of(100), model);
  const se3 T_camera_world = pose.inverse();
  const row_sums at = sum_rows(seen, model, T_camera_world, motion);
  const auto cost = [&](const vec6& step, const vec6& turn) {
    return sum_rows(seen, model, se3::exp(step) * T_camera_world, motion + turn).cost;
  };
  for (int i = 0; i != 6; ++i) {
    constexpr double h = 1e-6;
    const vec6 step = h * vec6::Unit(i), still = vec6::Zero();
    // The camera frame turns by a hundredth of a radian between the frame's time and the row's.
    CHECK(std::abs((cost(step, still) - cost(-step, still)) / (2.0 * h) - at.gradient(0)[i]) <
          0.03 * at.gradient(0).norm());
    CHECK(std::abs((cost(still, step) - cost(still, -step)) / (2.0 * h) - at.gradient(1)[i]) <
          0.03 * at.gradient(1).norm());
  }
}

TEST_CASE("Every instruction set sums rows to the same bits") {
  const optimize::reprojection<camera::radial_tangential> model{distorted, 400.0};
  const row_lanes seen = in_lanes(observations_of(203), model);
  const row_sums expected = sum_rows(seen, model, pose.inverse(), motion);
  for (const simd::level l : simd::available_levels()) {
    const simd::level_limit limit{l};
    const row_sums found = sum_rows(seen, model, pose.inverse(), motion);
    CHECK(found.h == expected.h);
    CHECK(found.g == expected.g);
    CHECK(found.cost == expected.cost);
  }
}

TEST_CASE("Lanes are used again without what they held") {
  const optimize::reprojection<camera::pinhole> model{undistorted, 400.0};
  row_lanes lanes = in_lanes(observations_of(50), model);
  const auto few = observations_of(3);
  lanes.clear();
  for (const row_observation& o : few) lanes.add(o, model);
  CHECK(lanes.block_count() == 1);
  CHECK(sum_rows(lanes, model, pose.inverse(), motion).h ==
        sum_rows(in_lanes(few, model), model, pose.inverse(), motion).h);
}
