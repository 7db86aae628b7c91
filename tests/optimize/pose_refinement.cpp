// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/pose_refinement-inl.hpp>

#include "support.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::pose_observation;
using optimize::refinement_status;

namespace {

const camera::pinhole pinhole_camera{{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 320, .cy = 240}};
const camera::radial_tangential distorted_camera{
    {.width = 640, .height = 480, .fx = 517.3, .fy = 516.5, .cx = 318.6, .cy = 255.3},
    {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};

const camera::kannala_brandt fisheye_camera{{.width = 640, .height = 480, .fx = 300, .fy = 302, .cx = 322, .cy = 236},
                                            {.k1 = -0.02, .k2 = 0.01, .k3 = -0.005, .k4 = 0.001}};

/// A camera that nobody has written lanes for.
struct own_camera {
  int width() const { return pinhole_camera.width(); }
  int height() const { return pinhole_camera.height(); }
  std::optional<vec2> project(const vec3& p) const { return pinhole_camera.project(p); }
  std::optional<vec2> project(const vec3& p, matrix<2, 3>& j) const { return pinhole_camera.project(p, j); }
  std::optional<vec3> unproject(const vec2& pixel) const { return pinhole_camera.unproject(pixel); }
};

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
    if (trial % 4 == 0) o.depth_weight = 0.3;
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

TEST_CASE("Pose refinement keeps corners that are anywhere on their streaks") {
  random_bits random(77);
  const optimize::reprojection<camera::pinhole> model{pinhole_camera, 40.0};
  const se3 truth = test::random_pose(random);
  const vec2 smear(6.0, 0.5);  // nearly along the rows, which the third residual depends on
  std::vector<pose_observation> seen = observe(model, truth, 400, 1.0, 78);
  for (pose_observation& o : seen) {
    const vec2 off = random.normal() * smear;
    o.pixel += off;
    o.right += off.x();  // the depth has no error from the streak
    o.smear = smear;
  }
  std::vector<std::uint8_t> outliers(seen.size());
  const auto found = optimize::refine_pose(std::span<const pose_observation>(seen), model, truth, outliers);
  REQUIRE(found.ok());
  CHECK(found.inliers > seen.size() * 95 / 100);
  CHECK(test::distance_between(found.T_world_camera, truth) < 0.02);
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

namespace {

/// Every fifth observation is wrong.
template <class Camera>
std::vector<pose_observation> observe_with_outliers(const optimize::reprojection<Camera>& model, const se3& truth,
                                                    int n, std::uint64_t seed) {
  auto seen = observe(model, truth, n, 0.5, seed, 1.0);
  random_bits random(seed + 1);
  for (std::size_t i = 4; i < seen.size(); i += 5) {
    seen[i].pixel = vec2(random.uniform(0, 640), random.uniform(0, 480));
    seen[i].right = seen[i].pixel.x() - random.uniform(5, 50);
  }
  return seen;
}

template <class Camera>
void check_levels(const Camera& camera, int n) {
  const optimize::reprojection model{camera, 40.0};
  random_bits random(static_cast<std::uint64_t>(n));
  const se3 truth = test::random_pose(random);
  vec6 off;
  off << 0.05, -0.03, 0.04, 0.03, -0.02, 0.02;
  auto seen = observe_with_outliers(model, truth, n, 5);
  for (std::size_t i = 2; i < seen.size(); i += 7) seen[i].right = std::numeric_limits<double>::quiet_NaN();
  seen[1].point.setConstant(std::numeric_limits<double>::quiet_NaN());
  seen[3].point = truth * vec3(0.1, 0.1, -2.0);
  seen[6].point.setConstant(1e200);
  std::vector<std::uint8_t> expected(seen.size()), outliers(seen.size());
  const auto run = [&](simd::level level, std::vector<std::uint8_t>& out) {
    const simd::level_limit limit{level};
    return optimize::refine_pose(std::span<const pose_observation>(seen), model, truth * se3::exp(off),
                                 std::span<std::uint8_t>(out));
  };
  const auto reference = run(simd::level::portable, expected);
  REQUIRE(reference.ok());
  CHECK(test::distance_between(reference.T_world_camera, truth) < 0.01);
  CHECK(expected[1] == 1);
  CHECK(expected[3] == 1);
  CHECK(expected[6] == 1);
  for (const simd::level level : simd::available_levels()) {
    const auto r = run(level, outliers);
    CHECK(r.T_world_camera.to_matrix() == reference.T_world_camera.to_matrix());
    CHECK(r.cost == reference.cost);
    CHECK(r.iterations == reference.iterations);
    CHECK(r.status == reference.status);
    CHECK(outliers == expected);
  }
}

}  // namespace

TEST_CASE("Pose refinement gives the same bits for every instruction set") {
  for (const int n : {20, 63, 500, 1024, 1025, 3001}) check_levels(pinhole_camera, n);
  check_levels(distorted_camera, 300);
  check_levels(fisheye_camera, 300);
  check_levels(own_camera{}, 300);
}

TEST_CASE("Pose refinement of 500 stereo observations finds all inliers and the pose to half a millimetre") {
  const optimize::reprojection model{pinhole_camera, 40.0};
  random_bits random(12);
  double squared = 0.0;
  for (std::uint64_t trial = 0; trial != 20; ++trial) {
    const se3 truth = test::random_pose(random);
    const auto seen = observe_with_outliers(model, truth, 500, 100 + trial);
    std::size_t inliers = 0;
    for (const auto& o : seen) {
      const auto r = model.residual(truth.inverse() * o.point, o);
      inliers += r && r->squaredNorm() <= 7.815;
    }
    REQUIRE(inliers >= 395);
    vec6 off;
    off << test::random_vector(random, 0.06), test::random_vector(random, 0.03);
    std::vector<std::uint8_t> outliers(seen.size());
    const auto refined = optimize::refine_pose(std::span<const pose_observation>(seen), model, truth * se3::exp(off),
                                               std::span<std::uint8_t>(outliers));
    REQUIRE(refined.ok());
    CHECK(refined.inliers + 2 >= inliers);
    CHECK(refined.inliers <= inliers + 2);
    squared += std::pow(test::distance_between(refined.T_world_camera, truth), 2);
    double at_truth = 0.0;  // the noise itself has a say in where the best pose is: no other is better
    for (std::size_t i = 0; i != seen.size(); ++i)
      if (outliers[i] == 0) at_truth += 0.5 * model.residual(truth.inverse() * seen[i].point, seen[i])->squaredNorm();
    CHECK(refined.cost <= at_truth);
  }
  CHECK(std::sqrt(squared / 20.0) < 5e-4);
}

TEST_CASE("Pose refinement of a camera known at run time is that of its model, and a camera of one's own works") {
  const se3 truth = se3::exp((vec6() << 0.3, 0.2, -0.1, 0.4, 0.1, -0.3).finished());
  const auto seen = observe_with_outliers(optimize::reprojection{pinhole_camera, 40.0}, truth, 200, 3);
  const auto run = [&](const auto& camera) {
    std::vector<std::uint8_t> outliers(seen.size());
    return optimize::refine_pose(std::span<const pose_observation>(seen), optimize::reprojection{camera, 40.0},
                                 truth * se3(so3{}, vec3(0.03, 0.0, 0.02)), std::span<std::uint8_t>(outliers));
  };
  const auto plain = run(pinhole_camera);
  REQUIRE(plain.ok());
  CHECK(run(camera::any_camera{pinhole_camera}).T_world_camera.to_matrix() == plain.T_world_camera.to_matrix());
  const auto own = run(own_camera{});
  CHECK(test::distance_between(own.T_world_camera, plain.T_world_camera) < 1e-9);
  CHECK(own.inliers == plain.inliers);
}

TEST_CASE("Pose refinement does not depend on the order of the observations") {
  const optimize::reprojection model{pinhole_camera, 40.0};
  const se3 truth;
  auto seen = observe_with_outliers(model, truth, 1500, 8);
  std::vector<std::uint8_t> outliers(seen.size()), reversed(seen.size());
  const se3 start(so3{}, vec3(0.02, 0.01, 0.03));
  const auto a = optimize::refine_pose(std::span<const pose_observation>(seen), model, start, std::span(outliers));
  std::reverse(seen.begin(), seen.end());
  const auto b = optimize::refine_pose(std::span<const pose_observation>(seen), model, start, std::span(reversed));
  std::reverse(reversed.begin(), reversed.end());
  CHECK(test::distance_between(a.T_world_camera, b.T_world_camera) < 1e-8);
  CHECK(outliers == reversed);
}

TEST_CASE("Pose refinement without rounds judges the starting pose") {
  const optimize::reprojection model{pinhole_camera, 40.0};
  const auto seen = observe_with_outliers(model, se3{}, 100, 31);
  std::vector<std::uint8_t> outliers(seen.size());
  const auto judged =
      optimize::refine_pose(std::span<const pose_observation>(seen), model, se3{}, std::span(outliers), {.rounds = 0});
  CHECK(judged.status == refinement_status::iteration_limit);
  CHECK(judged.T_world_camera.to_matrix() == mat4::Identity());
  CHECK(judged.inliers >= 78);
  CHECK(judged.inliers <= 82);
}

TEST_CASE("Pose refinement allocates nothing") {
  if (!test::counts_allocations()) return;
  const optimize::reprojection model{pinhole_camera, 40.0};
  for (const int n : {500, 3000}) {
    const auto seen = observe_with_outliers(model, se3{}, n, 6);
    std::vector<std::uint8_t> outliers(seen.size());
    const std::size_t before = test::allocations();
    const auto refined = optimize::refine_pose(std::span<const pose_observation>(seen), model,
                                               se3(so3{}, vec3(0.02, 0, 0)), std::span(outliers));
    const std::size_t after = test::allocations();
    CHECK(refined.ok());
    CHECK(after == before);
  }
}

TEST_CASE("Pose refinement never makes the cost of its inliers worse when nothing may be rejected") {
  const optimize::reprojection model{distorted_camera, 40.0};
  random_bits random(3);
  constexpr double everything = std::numeric_limits<double>::infinity();
  for (std::uint64_t trial = 0; trial != 30; ++trial) {
    auto seen = observe(model, se3{}, 40, 3.0, trial);
    for (int i = 0; i != 8; ++i) seen[static_cast<std::size_t>(i)].pixel = vec2(random.uniform(-1e3, 1e3), 1e3);
    const auto cost = [&](const se3& T_world_camera) {
      double sum = 0.0;
      for (const auto& o : seen) {
        const auto r = model.residual(T_world_camera.inverse() * o.point, o);
        sum += r ? r->squaredNorm() : 1e9;
      }
      return sum;
    };
    std::vector<std::uint8_t> outliers(seen.size());
    const se3 start =
        se3::exp((vec6() << test::random_vector(random, 0.2), test::random_vector(random, 0.1)).finished());
    const auto refined =
        optimize::refine_pose(std::span<const pose_observation>(seen), model, start, std::span(outliers),
                              {.rounds = 1, .gate_mono = everything, .gate_depth = everything});
    CHECK(cost(refined.T_world_camera) <= cost(start));
  }
}
