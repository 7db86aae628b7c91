// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

const optimize::reprojection<camera::pinhole> model{{640, 480, 525.0, 525.0, 319.5, 239.5}, 400.0};

vec6 vector6(double a, double b, double c, double d, double e, double f) {
  vec6 v;
  v << a, b, c, d, e, f;
  return v;
}
const vec6 motion = vector6(0.3, -0.4, 0.2, 0.7, -0.9, 0.5);
const se3 pose = se3::exp(vector6(0.5, -0.2, 0.1, 0.3, -0.4, 0.2));

/// Points in the world as rows of a camera that moves see them, with noise of `sigma` pixels.
std::vector<row_observation> observations_of(std::size_t n, double sigma) {
  std::vector<row_observation> all;
  random_bits random{3};
  const camera::shutter shutter{.color_read_out = 0.03};
  for (std::size_t i = 0; i != n; ++i) {
    const double z = random.uniform(0.6, 3.0);
    const vec3 p(z * random.uniform(-0.5, 0.5), z * random.uniform(-0.4, 0.4), z);
    row_observation o;
    vec3 then = p;
    for (int k = 0; k != 20; ++k) {
      o.time = shutter.color_time(model.camera.project(then)->y(), 480);
      then = moved_by(motion, -o.time, p);
    }
    o.seen.point = pose * p;
    o.seen.pixel = *model.camera.project(then) + vec2(sigma * random.normal(), sigma * random.normal());
    if (i % 4 != 0) o.seen.right = model.right(o.seen.pixel.x(), then.z()) + sigma * random.normal();
    all.push_back(o);
  }
  return all;
}

}  // namespace

TEST_CASE("The Jacobian of a row's residual by pose and twist is that of finite differences") {
  const se3 T_camera_world = pose.inverse();
  for (row_observation& o : observations_of(20, 0.0)) {
    matrix<3, 6> j;
    REQUIRE(row_residual(model, T_camera_world, motion, o, j));
    matrix<3, 6> unused;
    constexpr double h = 1e-6;
    for (int k = 0; k != 6; ++k) {
      vec6 step = vec6::Zero();
      step[k] = h;
      const vec3 by_pose = (*row_residual(model, se3::exp(step) * T_camera_world, motion, o, unused) -
                            *row_residual(model, se3::exp(-step) * T_camera_world, motion, o, unused)) /
                           (2.0 * h);
      const vec3 by_twist = (*row_residual(model, T_camera_world, motion + step, o, unused) -
                             *row_residual(model, T_camera_world, motion - step, o, unused)) /
                            (2.0 * h);
      // The camera frame turns by a hundredth of a radian between the frame's time and the row's.
      const double scale = 0.03 * j.norm();
      CHECK((by_pose - j.col(k)).norm() < scale);
      CHECK((by_twist + o.time * j.col(k)).norm() < 0.015 * scale);
    }
  }
}

TEST_CASE("Pose and twist are found from one image, and its twist is what the rows tell") {
  const auto seen = observations_of(300, 0.0);
  const moving_pose start{pose * se3::exp(vector6(0.01, -0.02, 0.01, 0.01, 0.02, -0.01)), vec6::Zero()};
  twist_prior weak;
  weak.translation_deviation = weak.rotation_deviation = 100.0;
  const moving_pose found = refine_moving_pose(std::span<const row_observation>(seen), model, start, weak, 20);
  CHECK((found.T_world_camera.inverse() * pose).log().norm() < 1e-5);
  CHECK((found.twist - motion).norm() < 1e-3);
}

TEST_CASE("With noise the prior holds the twist, and the pose is better than with the rows taken at one time") {
  const auto seen = observations_of(300, 1.0);
  const se3 before = pose * se3::exp(-0.033 * motion);
  const twist_prior prior = twist_prior::after({before, motion}, 0.033, true);
  const moving_pose start{pose * se3::exp(vector6(0.01, -0.02, 0.01, 0.01, 0.02, -0.01)), motion};
  const moving_pose found = refine_moving_pose(std::span<const row_observation>(seen), model, start, prior);
  CHECK((found.T_world_camera.inverse() * pose).log().norm() < 0.003);
  CHECK((found.twist - motion).norm() < 0.1);
  auto at_once = seen;
  for (row_observation& o : at_once) o.time = 0.0;
  const moving_pose rigid = refine_moving_pose(std::span<const row_observation>(at_once), model, start, prior);
  CHECK((rigid.T_world_camera.inverse() * pose).log().norm() >
        3.0 * (found.T_world_camera.inverse() * pose).log().norm());
}

TEST_CASE("The prior expects the mean motion and half of its change, within what a hand can accelerate") {
  const moving_pose before{pose, 0.5 * motion};
  const se3 now = pose * se3::exp(0.04 * motion);
  const twist_prior prior = twist_prior::after(before, 0.04, true);
  CHECK((prior.expected(now.inverse()) - 1.25 * motion).norm() < 1e-9);
  CHECK(prior.translation_deviation == Approx(0.12));
  CHECK(prior.rotation_deviation == Approx(0.12));
  const twist_prior unknown_before = twist_prior::after(before, 0.04, false);
  CHECK((unknown_before.expected(now.inverse()) - motion).norm() < 1e-9);
  const twist_prior long_ago = twist_prior::after(before, 2.0, true), unknown;
  CHECK(long_ago.translation_deviation == unknown.translation_deviation);
  CHECK(long_ago.rotation_deviation == unknown.rotation_deviation);
}

TEST_CASE("Gradient and prior of the normal equations are those of their cost") {
  const auto seen = observations_of(60, 0.5);
  const twist_prior prior = twist_prior::after({pose * se3::exp(-0.033 * motion), 0.8 * motion}, 0.033, true);
  const se3 T_camera_world = (pose * se3::exp(vector6(0.002, 0.001, -0.001, 0.001, 0.001, 0.001))).inverse();
  const auto at = linearize(std::span<const row_observation>(seen), model, T_camera_world, motion, prior);
  for (int k = 0; k != 12; ++k) {
    constexpr double h = 1e-6;
    const auto cost = [&](double by) {
      vec6 step = vec6::Zero(), turn = vec6::Zero();
      (k < 6 ? step[k] : turn[k - 6]) = by;
      return linearize(std::span<const row_observation>(seen), model, se3::exp(step) * T_camera_world, motion + turn,
                       prior)
          .cost;
    };
    const double slope = (cost(h) - cost(-h)) / (2.0 * h);
    CHECK(std::abs(slope - at.g[k]) < 0.03 * (k < 6 ? at.g.head<6>().norm() : at.g.tail<6>().norm()));
  }
  const auto without_derivatives =
      linearize<false>(std::span<const row_observation>(seen), model, T_camera_world, motion, prior);
  CHECK(without_derivatives.cost == Approx(at.cost).epsilon(1e-12));
}

TEST_CASE("The normal equations of pose and twist are the sum of the products of the derivatives") {
  const auto seen = observations_of(60, 0.5);
  const twist_prior prior = twist_prior::after({pose * se3::exp(-0.033 * motion), 0.8 * motion}, 0.033, true);
  const se3 T_camera_world = pose.inverse();
  // With a prior, and with no other observations, the equations are those of the prior.
  Eigen::Matrix<double, 12, 12> sum =
      linearize(std::span<const row_observation>(), model, T_camera_world, motion, prior).h;
  for (const row_observation& o : seen) {
    matrix<3, 6> by_pose;
    const auto r = row_residual(model, T_camera_world, motion, o, by_pose);
    REQUIRE(r);
    Eigen::Matrix<double, 3, 12> j;
    j << by_pose, -o.time * by_pose;
    const double error = std::sqrt(r->squaredNorm() * o.seen.information);
    sum += o.seen.information * std::min(1.0, slam::detail::row_loss_width / error) * j.transpose() * j;
  }
  const auto at = linearize(std::span<const row_observation>(seen), model, T_camera_world, motion, prior);
  CHECK((at.h - sum).norm() < 1e-9 * sum.norm());
}

TEST_CASE("Early depth follows the refined twist as far as pixels determine it, and the former twist otherwise") {
  const se3 before = pose * se3::exp(-0.033 * motion);
  // How much of the way from the former twist, which was off by this, to the refined one.
  const auto followed = [&](const std::vector<row_observation>& seen, const vec6& off) {
    const vec6 former = motion + off;
    const twist_prior prior = twist_prior::after({before, former}, 0.033, true);
    early_depth_twist twist;
    twist.update(std::span<const row_observation>(seen), model, {before, former}, {});
    CHECK(twist.between({}, motion) == motion);  // no former frame
    twist.advance();
    twist.update(std::span<const row_observation>(seen), model, {pose, motion}, prior);
    return (former - twist.between(prior, motion)).dot(off) / off.squaredNorm();
  };
  const vec6 sideways_or_turning = vector6(0.2, 0.0, 0.0, 0.0, -0.1, 0.0), rolling = vector6(0, 0, 0, 0, 0, 0.2);
  auto seen = observations_of(1000, 0.0);
  CHECK(followed(seen, sideways_or_turning) > 0.7);  // its rows tell
  CHECK(followed(seen, rolling) > 0.7);
  for (row_observation& o : seen) o.time = 0.0;
  CHECK(followed(seen, sideways_or_turning) > 0.5);
  CHECK(followed(seen, rolling) > 0.7);
  // Points two metres away in the middle of the image: moving to a side and turning look alike, rolling does not.
  for (row_observation& o : seen) {
    const vec3 p = pose.inverse() * o.seen.point, q(0.4 * p.x() / p.z(), 0.4 * p.y() / p.z(), 2.0);
    o.seen.point = pose * q;
    o.seen.pixel = *model.camera.project(q);
  }
  CHECK(followed(seen, sideways_or_turning) < 0.1);
  CHECK(followed(seen, rolling) > 0.3);
  CHECK(followed({}, rolling) < 0.01);
}
