// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
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

row_lanes in_lanes(const std::vector<row_observation>& observations) {
  row_lanes lanes;
  for (const row_observation& o : observations) lanes.add(o, model);
  return lanes;
}

}  // namespace

TEST_CASE("Pose and twist are found from one image, and its twist is what the rows tell") {
  const auto seen = observations_of(300, 0.0);
  const moving_pose start{pose * se3::exp(vector6(0.01, -0.02, 0.01, 0.01, 0.02, -0.01)), vec6::Zero()};
  twist_prior weak;
  weak.translation_deviation = weak.rotation_deviation = 100.0;
  const moving_pose found = refine_moving_pose(in_lanes(seen), model, start, weak, 20);
  CHECK((found.T_world_camera.inverse() * pose).log().norm() < 1e-5);
  CHECK((found.twist - motion).norm() < 1e-3);
}

TEST_CASE("With noise the prior holds the twist, and the pose is better than with the rows taken at one time") {
  const auto seen = observations_of(300, 1.0);
  const se3 before = pose * se3::exp(-0.033 * motion);
  const twist_prior prior = twist_prior::after({before, motion}, 0.033, true);
  const moving_pose start{pose * se3::exp(vector6(0.01, -0.02, 0.01, 0.01, 0.02, -0.01)), motion};
  const moving_pose found = refine_moving_pose(in_lanes(seen), model, start, prior);
  CHECK((found.T_world_camera.inverse() * pose).log().norm() < 0.003);
  CHECK((found.twist - motion).norm() < 0.1);
  auto at_once = seen;
  for (row_observation& o : at_once) o.time = 0.0;
  const moving_pose rigid = refine_moving_pose(in_lanes(at_once), model, start, prior);
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
  const auto at = linearize(in_lanes(seen), model, T_camera_world, motion, prior);
  for (int k = 0; k != 12; ++k) {
    constexpr double h = 1e-6;
    const auto cost = [&](double by) {
      vec6 step = vec6::Zero(), turn = vec6::Zero();
      (k < 6 ? step[k] : turn[k - 6]) = by;
      return linearize(in_lanes(seen), model, se3::exp(step) * T_camera_world, motion + turn, prior).cost;
    };
    const double slope = (cost(h) - cost(-h)) / (2.0 * h);
    CHECK(std::abs(slope - at.g[k]) < 0.03 * (k < 6 ? at.g.head<6>().norm() : at.g.tail<6>().norm()));
  }
}

TEST_CASE("The normal equations of pose and twist are those of the rows and of the prior") {
  const row_lanes seen = in_lanes(observations_of(60, 0.5));
  const twist_prior prior = twist_prior::after({pose * se3::exp(-0.033 * motion), 0.8 * motion}, 0.033, true);
  const se3 T_camera_world = pose.inverse();
  const row_sums rows = sum_rows(seen, model, T_camera_world, motion);
  const auto of_prior = linearize(row_lanes{}, model, T_camera_world, motion, prior);
  const auto all = linearize(seen, model, T_camera_world, motion, prior);
  Eigen::Matrix<double, 12, 12> h;
  h << rows.matrix(0), rows.matrix(1), rows.matrix(1), rows.matrix(2);
  Eigen::Matrix<double, 12, 1> g;
  g << rows.gradient(0), rows.gradient(1);
  CHECK((all.h - of_prior.h - h).norm() <= 1e-12 * h.norm());
  CHECK((all.g - of_prior.g - g).norm() <= 1e-12 * g.norm());
  CHECK(all.cost == Approx(of_prior.cost + rows.cost));
  CHECK(of_prior.h(6, 6) == Approx(1.0 / (prior.translation_deviation * prior.translation_deviation)));
}

TEST_CASE("Early depth follows the refined twist as far as pixels determine it, and the former twist otherwise") {
  const se3 before = pose * se3::exp(-0.033 * motion);
  // How much of the way from the former twist, which was off by this, to the refined one.
  const auto followed = [&](const std::vector<row_observation>& seen, const vec6& off) {
    const vec6 former = motion + off;
    const twist_prior prior = twist_prior::after({before, former}, 0.033, true);
    early_depth_twist twist;
    twist.update(in_lanes(seen), model, {before, former}, {});
    CHECK(twist.between({}, motion) == motion);  // no former frame
    twist.advance();
    twist.update(in_lanes(seen), model, {pose, motion}, prior);
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
