// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/pose_refinement.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::pose_observation;
using optimize::refinement_status;

namespace {

const camera::pinhole pinhole_camera{{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 320, .cy = 240}};
const camera::radial_tangential distorted_camera{
    {.width = 640, .height = 480, .fx = 517.3, .fy = 516.5, .cx = 318.6, .cy = 255.3},
    {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};

template <class Camera>
std::vector<pose_observation> observe(const optimize::reprojection<Camera>& model, const se3& T_world_camera, int n,
                                      double sigma, std::uint64_t seed, double with_depth = 0.7) {
  random_bits random(seed);
  std::vector<pose_observation> seen;
  while (static_cast<int>(seen.size()) < n) {
    const vec3 p = test::random_point_in_view(random);
    const auto pixel = model.camera.project(p);
    if (!pixel) continue;
    pose_observation o{.point = T_world_camera * p, .pixel = *pixel, .information = 1.0};
    o.pixel += sigma * vec2(random.normal(), random.normal());
    if (random.uniform() < with_depth) o.right = model.right(pixel->x(), p.z()) + sigma * random.normal();
    seen.push_back(o);
  }
  return seen;
}

template <class Camera>
void check_jacobian(const Camera& camera) {
  random_bits random(31);
  const optimize::reprojection<Camera> model{camera, 40.0};
  for (int trial = 0; trial < 200; ++trial) {
    const vec3 p = 0.6 * test::random_point_in_view(random);
    pose_observation o{.point = vec3::Zero(), .pixel = vec2(100, 50)};
    if (trial % 2 == 0) o.right = 3.0;
    mat3 j;
    const auto r = model.residual(p, o, j);
    REQUIRE(r.has_value());
    REQUIRE(*r == *model.residual(p, o));
    for (int k = 0; k < 3; ++k) {
      const double h = 1e-6;
      const vec3 numeric =
          (*model.residual(p + h * vec3::Unit(k), o) - *model.residual(p - h * vec3::Unit(k), o)) / (2.0 * h);
      CHECK((numeric - j.col(k)).norm() <= 1e-6 * (1.0 + j.norm()));
    }
  }
}

}  // namespace

TEST_CASE("Reprojection Jacobians equal central differences") {
  check_jacobian(pinhole_camera);
  check_jacobian(distorted_camera);
}

TEST_CASE("Pose refinement comes back to the truth from a perturbed start") {
  random_bits random(8);
  const optimize::reprojection model{distorted_camera, 40.0};
  for (std::uint64_t trial = 0; trial < 30; ++trial) {
    const se3 truth = test::random_pose(random);
    const auto seen = observe(model, truth, 100, 0.0, trial);
    vec6 xi;
    xi << test::random_vector(random, 0.1), test::random_vector(random, 0.05);
    std::vector<std::uint8_t> outliers(seen.size());
    const auto refined = optimize::refine_pose(std::span<const pose_observation>(seen), model, truth * se3::exp(xi),
                                               std::span<std::uint8_t>(outliers));
    REQUIRE(refined.ok());
    CHECK(refined.inliers == seen.size());
    CHECK(test::distance_between(refined.T_world_camera, truth) < 1e-7);
    CHECK(test::angle_between(refined.T_world_camera, truth) < 1e-7);
  }
}

TEST_CASE("Pose refinement flags the outliers and keeps the inliers") {
  random_bits random(80);
  const optimize::reprojection model{pinhole_camera, 40.0};
  const se3 truth = test::random_pose(random);
  auto seen = observe(model, truth, 500, 0.5, 99);
  for (auto& o : seen) o.information = 4.0;
  for (std::size_t i = 0; i < 150; ++i) seen[i].pixel += vec2(random.uniform(30, 90), random.uniform(-80, 80));
  vec6 xi;
  xi << 0.05, -0.05, 0.03, 0.02, -0.02, 0.02;
  std::vector<std::uint8_t> outliers(seen.size());
  const auto refined = optimize::refine_pose(std::span<const pose_observation>(seen), model, truth * se3::exp(xi),
                                             std::span<std::uint8_t>(outliers));
  REQUIRE(refined.ok());
  CHECK(test::distance_between(refined.T_world_camera, truth) < 0.005);
  std::size_t false_inliers = 0, false_outliers = 0, inliers = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    inliers += outliers[i] == 0;
    (i < 150 ? false_inliers : false_outliers) += (i < 150) == (outliers[i] == 0);
  }
  CHECK(inliers == refined.inliers);
  CHECK(false_inliers == 0);
  CHECK(false_outliers < 40);  // five percent of 350, and some room
}

TEST_CASE("Pose refinement moves with the world it is given") {
  random_bits random(5);
  const optimize::reprojection model{pinhole_camera, 40.0};
  const se3 truth = test::random_pose(random), motion = test::random_pose(random);
  auto seen = observe(model, truth, 200, 1.0, 17);
  std::vector<std::uint8_t> outliers(seen.size());
  const auto here =
      optimize::refine_pose(std::span<const pose_observation>(seen), model, truth, std::span<std::uint8_t>(outliers));
  for (auto& o : seen) o.point = motion * o.point;
  const auto there = optimize::refine_pose(std::span<const pose_observation>(seen), model, motion * truth,
                                           std::span<std::uint8_t>(outliers));
  CHECK(test::distance_between(motion * here.T_world_camera, there.T_world_camera) < 1e-6);
  CHECK(here.inliers == there.inliers);
}

TEST_CASE("Pose refinement takes any robust loss") {
  const optimize::reprojection model{pinhole_camera, 40.0};
  const auto seen = observe(model, se3{}, 50, 0.5, 4);
  std::vector<std::uint8_t> outliers(seen.size());
  const std::span<const pose_observation> view(seen);
  const se3 start(so3{}, vec3(0.02, 0, 0));
  CHECK(optimize::refine_pose(view, model, start, std::span<std::uint8_t>(outliers), {}, optimize::cauchy{2.0}).ok());
  CHECK(optimize::refine_pose(view, model, start, std::span<std::uint8_t>(outliers), {}, optimize::tukey{8.0}).ok());
}

TEST_CASE("Pose refinement gives a status and the starting pose for degenerate input") {
  const optimize::reprojection model{pinhole_camera, 40.0};
  const se3 start(so3{}, vec3(0.1, 0.2, 0.3));
  const auto run = [&](std::vector<pose_observation> seen, const se3& from) {
    std::vector<std::uint8_t> outliers(seen.size());
    const auto r =
        optimize::refine_pose(std::span<const pose_observation>(seen), model, from, std::span<std::uint8_t>(outliers));
    CHECK(r.T_world_camera.to_matrix().cwiseEqual(from.to_matrix()).count() ==
          (from.to_matrix().allFinite() ? 16 : 13));
    for (const auto o : outliers) CHECK(o == 1);
    CHECK(r.inliers == 0);
    return r.status;
  };
  CHECK(run({}, start) == refinement_status::too_few_observations);
  auto seen = observe(model, start, 30, 0.0, 3);
  CHECK(run({seen[0], seen[1]}, start) == refinement_status::too_few_observations);

  auto nan = seen;
  for (auto& o : nan) o.point.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(run(nan, start) == refinement_status::too_few_observations);
  auto weightless = seen;
  for (auto& o : weightless) o.information = 0.0;
  CHECK(run(weightless, start) == refinement_status::too_few_observations);

  auto behind = seen;
  for (auto& o : behind) o.point.z() = -5.0;
  CHECK_FALSE(run(behind, start) == refinement_status::converged);

  std::vector<pose_observation> line;
  for (int i = 0; i < 20; ++i) {
    const vec3 p(-0.5 + 0.05 * i, 0.1, 2.0);
    line.push_back({.point = start * p, .pixel = *pinhole_camera.project(p)});
  }
  CHECK(run(line, start) == refinement_status::degenerate);

  const double none = std::numeric_limits<double>::quiet_NaN();
  CHECK(run(seen, se3(so3{}, vec3::Constant(none))) == refinement_status::invalid_start);

  random_bits random(77);
  for (auto& o : seen) o.pixel = vec2(random.uniform(0, 640), random.uniform(0, 480));
  for (auto& o : seen) o.information = 100.0;
  CHECK(run(seen, start) == refinement_status::too_few_observations);
}
