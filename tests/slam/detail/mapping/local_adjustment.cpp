// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/local_adjustment.hpp>

#include "slam/random_map.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

namespace local = slam::detail::local_adjustment;

std::size_t outliers_of(const slam::detail::bundle_solution& s) {
  return static_cast<std::size_t>(std::count(s.outliers.begin(), s.outliers.end(), 1));
}

/// The steps of an adjustment, with the values between them.
struct adjustment_steps {
  slam::adjustment_options options;
  std::optional<slam::detail::bundle_solver<camera::pinhole>> solver;
  local::snapshot taken;
  slam::detail::bundle_solution solved;

  bool gather(const slam::map& m, slam::keyframe_id newest, const slam::camera_rig<camera::pinhole>& rig,
              const slam::adjustment_options& o) {
    options = o;
    if (!solver) solver.emplace(rig.model);
    solved.usable = false;
    taken = local::take(m, newest, rig, o, std::move(taken));
    return !taken.empty();
  }
  bool solve(const progress& go_on = {}) {
    solved = solver->solve(taken, local::make_schedule(options), go_on, std::move(solved));
    return solved.complete;
  }
  void apply(slam::map& m) const { local::apply(m, taken, solved); }
};

/// A camera that passes a crowd of points, with its true path. Keypoint i of each keyframe shows point i.
struct scene {
  random_bits random{11};
  camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  slam::camera_rig<camera::pinhole> rig{{camera, 400.0}};
  slam::adjustment_options options{};
  std::vector<vec3> points;
  std::vector<se3> path;
  slam::map m{8, 1.2};
  adjustment_steps adjustment;

  explicit scene(std::size_t keyframes = 6, std::size_t count = 120) {
    for (std::size_t i = 0; i < count; ++i) {
      const double z = random.uniform(1.5, 4.0), x = random.uniform(-0.3, 0.5);
      points.emplace_back(x * z, random.uniform(-0.35, 0.35) * z, z);
    }
    for (std::size_t k = 0; k < keyframes; ++k) {
      const double t = static_cast<double>(k);
      path.emplace_back(so3::exp(vec3(0.01 * t, -0.02 * t, 0.005 * t)), vec3(0.06 * t, 0.01 * t, -0.01 * t));
      add(wrong_pose(k), path[k]);
    }
  }

  [[nodiscard]] se3 wrong_pose(std::size_t k) {
    if (k == 0) return path[0];
    const auto off = [&](double by) -> vec3 { return by * test::random_point(random, 1.0); };
    const vec3 turned = off(0.01);
    return {path[k].rotation() * so3::exp(turned), path[k].translation() + off(0.02)};
  }

  /// Another keyframe that sees everything from `T_true` and believes to be elsewhere.
  slam::keyframe_id add(const se3& T_believed, const se3& T_true) {
    slam::frame f;
    f.index = m.keyframe_end().value();
    f.T_world_camera = T_believed;
    f.features.keypoints.resize(points.size());
    f.features.descriptors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const vec3 p = T_true.inverse() * points[i];
      const vec2 noise(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
      const vec2 pixel = *camera.project(p) + noise;
      f.features.keypoints[i].x = static_cast<float>(pixel.x());
      f.features.keypoints[i].y = static_cast<float>(pixel.y());
      // Every third keypoint has no depth.
      f.depth.push_back(i % 3 == 2 ? 0.0F
                                   : static_cast<float>(p.z() + 0.5 * p.z() * p.z() / 400.0 * random.uniform(-1, 1)));
      f.rays.push_back(*camera.unproject(pixel));
      f.landmarks.push_back(m.keyframe_end() == 0 ? slam::no_id : m.at(m.keyframe_end() - 1U).landmarks[i]);
    }
    f.grid = features::keypoint_grid(f.features.keypoints);
    const auto id = m.add_keyframe(std::move(f));
    for (std::uint32_t i = 0; id == 0 && i < points.size(); ++i)
      m.add_landmark(0, i, points[i] + 0.05 * test::random_point(random, 1.0));
    return id;
  }

  /// Root mean square distance of the keyframes, and of the landmarks, from the truth.
  [[nodiscard]] double pose_error() const {
    double sum = 0.0;
    for (const slam::keyframe& k : m.keyframes())
      sum += (k.T_world_camera.translation() - path[k.id.value()].translation()).squaredNorm();
    return std::sqrt(sum / static_cast<double>(m.keyframes().size()));
  }
  [[nodiscard]] double point_error() const {
    double sum = 0.0;
    std::size_t n = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (const auto l = m.at(0).landmarks[i]; l != slam::no_id && ++n != 0)
        sum += (m.landmark_at(l).position - points[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(n));
  }
  [[nodiscard]] bool gather(slam::keyframe_id newest) { return adjustment.gather(m, newest, rig, options); }
  bool adjust() {
    if (!gather(m.keyframes().back().id)) return false;
    adjustment.solve();
    adjustment.apply(m);
    return true;
  }
};

/// All poses and positions.
std::vector<mat4> poses_of(const slam::map& m) {
  std::vector<mat4> all;
  for (const slam::keyframe& k : m.keyframes()) all.push_back(k.T_world_camera.to_matrix());
  return all;
}
std::vector<vec3> positions_of(const slam::map& m) {
  std::vector<vec3> all;
  for (const slam::landmark& l : m.landmarks()) all.push_back(l.position);
  return all;
}

}  // namespace

TEST_CASE("Local adjustment brings keyframes and landmarks to where they are") {
  scene s;
  const se3 root = s.m.at(0).T_world_camera;
  REQUIRE(s.pose_error() > 0.01);
  REQUIRE(s.point_error() > 0.03);
  CHECK(s.adjust());
  CHECK(s.pose_error() < 0.002);
  CHECK(s.point_error() < 0.015);  // without depth: 2 cm at 3 m, from six views within 30 cm
  CHECK(s.m.at(0).T_world_camera.to_matrix() == root.to_matrix());
  CHECK(s.adjustment.taken.keyframes.size() == 6);
  CHECK(std::count(s.adjustment.taken.is_fixed.begin(), s.adjustment.taken.is_fixed.end(), 1) == 1);
  CHECK(s.adjustment.taken.landmarks.size() == s.points.size());
  CHECK(test::fault_of(s.m) == "");
  for (const auto& l : s.m.landmarks()) CHECK(std::abs(l.normal.norm() - 1.0) < 1e-12);
}

TEST_CASE("Only the nearest keyframes move, and the others hold them") {
  scene s;
  s.options.keyframes = 2;
  const auto before = poses_of(s.m);
  REQUIRE(s.gather(5));
  CHECK(s.adjustment.taken.keyframes.size() == 6);
  CHECK(std::count(s.adjustment.taken.is_fixed.begin(), s.adjustment.taken.is_fixed.end(), 0) ==
        1);  // one of both is the root
  CHECK(s.adjustment.solve());
  s.adjustment.apply(s.m);
  const auto after = poses_of(s.m);
  for (std::size_t k = 0; k < 6; ++k) CHECK((before[k] == after[k]) == (k != 5));
}

TEST_CASE("Observations that disagree are forgotten, the others stay") {
  scene s;
  std::vector<std::uint32_t> wrong;
  auto f = static_cast<slam::frame>(s.m.at(3));
  for (std::uint32_t i = 0; i < 12; ++i) {
    const auto other = 119 - i;
    std::swap(f.features.keypoints[i], f.features.keypoints[other]);
    wrong.push_back(i);
    wrong.push_back(other);
  }
  s.path.push_back(s.path[3]);
  f.T_world_camera = s.wrong_pose(3);
  const auto id = s.m.add_keyframe(f);
  REQUIRE(s.adjust());
  CHECK(outliers_of(s.adjustment.solved) >= wrong.size());
  CHECK(outliers_of(s.adjustment.solved) < wrong.size() + 20);
  for (const auto i : wrong) CHECK(s.m.at(id).landmarks[i] == slam::no_id);
  CHECK(std::count(s.m.at(id).landmarks.begin(), s.m.at(id).landmarks.end(), slam::no_id) < 30);
  CHECK(s.pose_error() < 0.003);
  CHECK(test::fault_of(s.m) == "");
}

TEST_CASE("A landmark that one keyframe is left to see, without depth, goes") {
  scene s(2);
  auto f = static_cast<slam::frame>(s.m.at(1));
  const auto shown = f.landmarks;
  for (std::uint32_t i = 0; i < 6; ++i) {  // wrong, and coarse, so that the other keyframe is believed
    f.features.keypoints[i].y += 20.0F;
    f.features.keypoints[i].octave = 7;
  }
  s.m.erase_keyframe(1);
  const auto id = s.m.add_keyframe(f);
  REQUIRE(s.adjust());
  CHECK(test::fault_of(s.m) == "");
  for (std::uint32_t i = 0; i < 6; ++i) {
    CHECK(s.m.at(id).landmarks[i] == slam::no_id);
    CHECK(s.m.has_landmark(shown[i]) == (i % 3 != 2));
    CHECK(s.m.at(0).landmarks[i] == (i % 3 != 2 ? shown[i] : slam::no_id));
  }
}

TEST_CASE("What is added while the adjustment is solved moves along") {
  scene s;
  for (std::uint32_t i = 0; i < 5; ++i)  // so that others share more with what comes than the root, which holds still
    for (const std::uint32_t k : {0U, 1U, 2U, 3U}) s.m.erase_observation(s.m.at(5).landmarks[100 + i], k);
  REQUIRE(s.gather(5));
  CHECK(s.adjustment.solve());
  const se3 T_5_camera(so3::exp(vec3(0.01, 0.02, 0.03)), vec3(0.05, 0.02, 0.01));
  const se3 believed = s.m.at(5).T_world_camera * T_5_camera;
  const auto added = s.add(believed, s.path[5] * T_5_camera);
  const auto parent = s.m.tree().parent(added);
  REQUIRE(parent == 4);
  const se3 T_parent_added = s.m.at(parent).T_world_camera.inverse() * believed;
  const auto second = s.add(believed * T_5_camera, s.path[5] * T_5_camera * T_5_camera);
  const se3 T_parent_second = s.m.at(s.m.tree().parent(second)).T_world_camera.inverse() * (believed * T_5_camera);
  s.m.erase_observation(s.m.at(added).landmarks[0], added);
  const auto l = s.m.add_landmark(added, 0);
  const vec3 in_camera = s.m.at(added).T_world_camera.inverse() * s.m.landmark_at(l).position;
  const auto seen = s.m.at(added).landmarks;

  const se3 before = s.m.at(parent).T_world_camera;
  s.adjustment.apply(s.m);
  REQUIRE((s.m.at(parent).T_world_camera.translation() - before.translation()).norm() > 1e-3);
  const auto same = [](const se3& a, const se3& b) { return (a.inverse() * b).log().norm() < 1e-9; };
  CHECK(same(s.m.at(parent).T_world_camera * T_parent_added, s.m.at(added).T_world_camera));
  CHECK(same(s.m.at(s.m.tree().parent(second)).T_world_camera * T_parent_second, s.m.at(second).T_world_camera));
  CHECK((s.m.at(added).T_world_camera * in_camera - s.m.landmark_at(l).position).norm() < 1e-9);
  CHECK(s.m.at(added).landmarks == seen);
  CHECK(test::fault_of(s.m) == "");
}

TEST_CASE("What is gone when the adjustment is applied does no harm") {
  scene s;
  REQUIRE(s.gather(5));
  CHECK(s.adjustment.solve());
  s.m.erase_keyframe(3);
  s.m.remove_landmark(s.m.at(0).landmarks[1]);
  s.m.fuse(s.m.at(0).landmarks[2], s.m.at(0).landmarks[3]);
  for (const std::uint32_t k : {1U, 2U, 4U}) s.m.erase_observation(s.m.at(0).landmarks[4], k);
  s.adjustment.apply(s.m);
  CHECK(test::fault_of(s.m) == "");
  CHECK(s.pose_error() < 0.002);
  const auto before = poses_of(s.m);
  s.adjustment.apply(s.m);  // once is enough
  CHECK(poses_of(s.m) == before);
}

TEST_CASE("An adjustment that is stopped changes nothing, or leaves something better") {
  scene s;
  const auto poses = poses_of(s.m);
  const auto positions = positions_of(s.m);
  const double error = s.pose_error();
  REQUIRE(s.gather(5));
  std::size_t asked = 0;
  const auto never = [&](std::size_t, std::size_t) { return ++asked == 0; };
  CHECK_FALSE(s.adjustment.solve(never));
  CHECK(asked == 1);
  s.adjustment.apply(s.m);
  CHECK(poses_of(s.m) == poses);
  CHECK(positions_of(s.m) == positions);

  REQUIRE(s.gather(5));
  const auto twice = [&](std::size_t, std::size_t) { return ++asked < 5; };
  CHECK_FALSE(s.adjustment.solve(twice));
  CHECK(asked == 5);
  CHECK(outliers_of(s.adjustment.solved) == 0);
  s.adjustment.apply(s.m);
  CHECK(s.pose_error() < error);
  CHECK(poses_of(s.m) != poses);
  for (const auto& l : s.m.landmarks()) CHECK(l.observations.size() == 6);
  CHECK(test::fault_of(s.m) == "");
}

TEST_CASE("Where there is nothing to adjust nothing is done") {
  scene alone(1);
  CHECK_FALSE(alone.gather(0));
  scene s;
  s.options.keyframes = 0;
  CHECK_FALSE(s.gather(5));
  CHECK_FALSE(s.adjust());
  s.options.keyframes = 1;
  CHECK_FALSE(s.gather(0));  // the root holds still
  s.options.keyframes = 12;
  const auto poses = poses_of(s.m);
  s.adjustment.apply(s.m);  // nothing was gathered
  CHECK(poses_of(s.m) == poses);
}

TEST_CASE("Poses that are not finite leave the map as it is") {
  scene s;
  s.m.set_pose(2, se3(so3{}, vec3::Constant(std::numeric_limits<double>::quiet_NaN())));
  const auto positions = positions_of(s.m);
  const mat4 newest = s.m.at(5).T_world_camera.to_matrix();
  REQUIRE(s.gather(5));
  CHECK_FALSE(s.adjustment.solve());
  s.adjustment.apply(s.m);
  CHECK(s.m.at(5).T_world_camera.to_matrix() == newest);
  CHECK(positions_of(s.m) == positions);
}

TEST_CASE("Another camera model is taken up") {
  scene s;
  CHECK(s.adjust());
  s.rig.model = {camera::pinhole{640, 480, 500.0, 500.0, 320.0, 240.0}, 400.0};
  s.adjustment.solver.emplace(s.rig.model);
  s.options.robust_iterations = s.options.iterations = 0;
  REQUIRE(s.gather(5));
  CHECK(s.adjustment.solve());
  CHECK(outliers_of(s.adjustment.solved) > 6 * s.points.size() / 2);  // which fits nothing here
}

TEST_CASE("Solving again what is no larger allocates nothing") {
  if (!test::counts_allocations()) return;
  scene s;
  for (int i = 0; i < 3; ++i) {
    REQUIRE(s.gather(5));
    const std::size_t before = test::allocations();
    s.adjustment.solve();
    if (i != 0) CHECK(test::allocations() == before);
  }
}
