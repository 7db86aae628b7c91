// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/optimize/detail/pose/pose_kernels.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

#include "../../support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::pose_observation;
using optimize::detail::pose_lanes;
using optimize::detail::pose_sums;

namespace {

const camera::pinhole pinhole_camera{640, 480, 525.0, 520.0, 319.5, 239.5};
constexpr double bf = 40.0, gate = 7.8, none = std::numeric_limits<double>::quiet_NaN();

/// 40 observations from the world's origin with errors of some pixels; a third has no depth, one lies behind the
/// camera, one is an outlier.
std::vector<pose_observation> observe() {
  random_bits random{21};
  std::vector<pose_observation> seen;
  for (int i = 0; i != 40; ++i) {
    const vec3 p = test::random_point_in_view(random);
    const vec2 pixel = *pinhole_camera.project(p) + vec2(3.0 * random.normal(), 3.0 * random.normal());
    seen.push_back(
        {p, pixel, i % 3 == 0 ? none : pixel.x() - bf / p.z(), random.uniform(0.2, 1.0), random.uniform(0.2, 1.0)});
  }
  seen[11].point.z() = -2.0;
  return seen;
}

void put(const std::vector<pose_observation>& seen, pose_lanes& lanes) {
  for (std::size_t i = 0; i != seen.size(); ++i) {
    lanes.x[i] = seen[i].point.x(), lanes.y[i] = seen[i].point.y(), lanes.z[i] = seen[i].point.z();
    lanes.u[i] = seen[i].pixel.x(), lanes.v[i] = seen[i].pixel.y(),
    lanes.right[i] = seen[i].has_depth() ? seen[i].right : 0.0;
    lanes.depth_weight[i] = seen[i].has_depth() ? seen[i].depth_weight : 0.0;
    lanes.information[i] = seen[i].information;
    lanes.active[i] = i == 5 ? 0.0 : seen[i].information;
  }
}

/// What the kernel sums, written out: the derivative of a point by a step on the left of the pose is [I, -hat(q)].
void sum_plainly(const std::vector<pose_observation>& seen, const se3& pose, const optimize::huber& loss, mat6& h,
                 vec6& g, double& cost) {
  const optimize::reprojection model{pinhole_camera, bf};
  h.setZero();
  g.setZero();
  cost = 0.0;
  for (std::size_t i = 0; i != seen.size(); ++i) {
    if (i == 5) continue;
    const vec3 q = pose * seen[i].point;
    mat3 j;
    const auto r = model.residual(q, seen[i], j);
    if (!r) {
      cost += 0.5 * loss.cost(gate);
      continue;
    }
    matrix<3, 6> by_step;
    by_step << j, -(j * hat<double>(q));
    const double squared = seen[i].information * r->squaredNorm();
    const double weight = seen[i].information * loss.weight(squared);
    h += weight * by_step.transpose() * by_step;
    g += weight * by_step.transpose() * *r;
    cost += 0.5 * loss.cost(squared);
  }
}

}  // namespace

TEST_CASE("The loops over observations give the normal equations and errors of their definitions on every level") {
  const auto seen = observe();
  const auto lanes = std::make_unique<pose_lanes>();
  put(seen, *lanes);
  const se3 pose = se3::exp((vec6() << 0.02, -0.01, 0.03, 0.01, 0.02, -0.01).finished());
  const optimize::huber loss{2.0};
  const optimize::detail::pose_at at{pose.rotation_matrix(), pose.translation(), bf, gate};
  mat6 h;
  vec6 g;
  double cost = 0.0;
  sum_plainly(seen, pose, loss, h, g, cost);
  pose_sums first;
  std::vector<double> first_errors;
  for (const simd::level level : simd::available_levels()) {
    INFO("level " << static_cast<int>(level));
    const simd::level_limit limit{level};
    pose_sums sums;
    optimize::detail::sum_pose_function<camera::pinhole>()(*lanes, seen.size(), pinhole_camera, at, loss, sums);
    std::vector<double> errors(seen.size());
    optimize::detail::judge_pose_function<camera::pinhole>()(*lanes, seen.size(), pinhole_camera, at, errors.data());
    if (first_errors.empty()) {
      first = sums;
      first_errors = errors;
    }
    CHECK(std::memcmp(&sums, &first, sizeof sums) == 0);
    CHECK(errors == first_errors);
  }
  const auto close = [](double a, double b, double size) { return std::abs(a - b) <= 1e-12 * size; };
  const double size = h.norm();
  for (int row = 0, k = 0; row != 3; ++row)
    for (int column = 0; column <= row; ++column, ++k) {
      CHECK(close(first.translation[static_cast<std::size_t>(k)], h(row, column), size));
      CHECK(close(first.rotation[static_cast<std::size_t>(k)], h(3 + row, 3 + column), size));
    }
  for (int i = 0; i != 9; ++i) CHECK(close(first.corner[static_cast<std::size_t>(i)], h(3 + i % 3, i / 3), size));
  for (int i = 0; i != 6; ++i) CHECK(close(first.gradient[static_cast<std::size_t>(i)], g[i], g.norm()));
  CHECK(close(first.cost, cost, cost));
  const optimize::reprojection model{pinhole_camera, bf};
  for (std::size_t i = 0; i != seen.size(); ++i) {
    const auto r = model.residual(pose * seen[i].point, seen[i]);
    CHECK(r.has_value() == (i != 11));
    if (r)
      CHECK(first_errors[i] == Approx(seen[i].information * r->squaredNorm()));
    else
      CHECK(std::isinf(first_errors[i]));
  }
}
