// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/eval/alignment.hpp>

#include "support/catch.hpp"

namespace eval = orbis::eval;
using orbis::se3;
using orbis::so3;
using orbis::vec3;

namespace {

orbis::trajectory curve(int n) {
  orbis::trajectory poses;
  for (int i = 0; i != n; ++i) {
    const double t = 0.1 * i;
    poses.push_back({t, se3(so3::exp(vec3(0.1 * t, t, -0.2 * t)), vec3(std::sin(t), std::cos(2.0 * t), 0.3 * t))});
  }
  return poses;
}

/// `poses` in another frame and of another size.
orbis::trajectory moved(const orbis::trajectory& poses, double scale, const se3& by) {
  orbis::trajectory out = poses;
  for (auto& p : out) p.T_world_camera = by * se3(p.T_world_camera.rotation(), scale * p.T_world_camera.translation());
  return out;
}

}  // namespace

TEST_CASE("a rigid motion and a scale are found exactly") {
  const auto reference = curve(60);
  for (const vec3& axis : {vec3(0, 0, 0), vec3(3.1, 0, 0), vec3(0.4, -2.0, 1.0), vec3(0, 0, 3.14159)}) {
    const se3 motion(so3::exp(axis), vec3(10, -20, 3));
    for (const double scale : {1.0, 0.25, 7.0}) {
      const auto estimate = moved(reference, scale, motion);
      const auto found = eval::align(estimate, reference, {.with_scale = true}).value();
      CHECK(found.pairs == 60);
      CHECK(found.scale == Approx(1.0 / scale).epsilon(1e-10));
      for (std::size_t i = 0; i != reference.size(); ++i) {
        const se3 aligned = found * estimate[i].T_world_camera;
        CHECK((aligned.translation() - reference[i].T_world_camera.translation()).norm() < 1e-9);
        CHECK((aligned.rotation().inverse() * reference[i].T_world_camera.rotation()).angle() < 1e-9);
      }
      if (scale != 1.0) CHECK(eval::align(estimate, reference).value().scale == 1.0);
    }
  }
}

TEST_CASE("the alignment is a minimum of the squared errors") {
  const auto reference = curve(60);
  auto estimate = reference;
  for (std::size_t i = 0; i != estimate.size(); ++i) {
    const double k = static_cast<double>(i);
    auto& pose = estimate[i].T_world_camera;
    pose = se3(pose.rotation(), pose.translation() + 0.05 * vec3(std::sin(9 * k), std::cos(7 * k), std::sin(5 * k)));
  }
  const auto cost = [&](const se3& T) {
    double sum = 0.0;
    for (std::size_t i = 0; i != reference.size(); ++i)
      sum += (T * estimate[i].T_world_camera.translation() - reference[i].T_world_camera.translation()).squaredNorm();
    return sum;
  };
  const se3 best = eval::align(estimate, reference).value().T_reference_estimate;
  for (int k = 0; k != 6; ++k)
    for (const double step : {1e-4, -1e-4}) {
      orbis::vec6 xi = orbis::vec6::Zero();
      xi[k] = step;
      CHECK(cost(se3::exp(xi) * best) > cost(best));
    }
}

TEST_CASE("positions in a plane are aligned by a rotation and never mirrored") {
  orbis::trajectory flat = curve(30);
  for (auto& p : flat) {
    vec3 t = p.T_world_camera.translation();
    t.z() = 0.0;
    p.T_world_camera = se3(p.T_world_camera.rotation(), t);
  }
  const auto estimate = moved(flat, 1.0, se3(so3::exp(vec3(2, 1, 0)), vec3(1, 2, 3)));
  const auto found = eval::align(estimate, flat).value();
  CHECK(found.T_reference_estimate.rotation_matrix().determinant() == Approx(1.0));
  for (std::size_t i = 0; i != flat.size(); ++i)
    CHECK((found * estimate[i].T_world_camera.translation() - flat[i].T_world_camera.translation()).norm() < 1e-9);
}

TEST_CASE("too little to align is refused") {
  const auto reference = curve(10);
  CHECK(eval::align(orbis::trajectory{}, reference).error().code == orbis::errc::no_data);
  CHECK(eval::align(curve(2), reference).error().code == orbis::errc::no_data);
  auto later = reference;
  for (auto& p : later) p.timestamp += 100.0;
  CHECK(eval::align(later, reference).error().code == orbis::errc::no_data);
}

TEST_CASE("geometry that does not determine the alignment is refused") {
  orbis::trajectory line, point, broken = curve(10);
  for (int i = 0; i != 10; ++i) {
    line.push_back({0.1 * i, se3(so3{}, vec3(1.0 * i, 2.0 * i, -3.0 * i))});
    point.push_back({0.1 * i, se3(so3{}, vec3(1, 2, 3))});
  }
  broken[3].T_world_camera = se3(so3{}, vec3(0, std::numeric_limits<double>::quiet_NaN(), 0));
  CHECK(eval::align(line, curve(10)).error().code == orbis::errc::degenerate);
  CHECK(eval::align(curve(10), line).error().code == orbis::errc::degenerate);
  CHECK(eval::align(point, curve(10)).error().code == orbis::errc::degenerate);
  CHECK(eval::align(point, point).error().code == orbis::errc::degenerate);
  CHECK(eval::align(broken, curve(10)).error().code == orbis::errc::degenerate);
}

TEST_CASE("poses are aligned even where their positions say nothing about the rotation") {
  const se3 motion(so3::exp(vec3(0.4, -2.0, 1.0)), vec3(10, -20, 3));
  for (const int n : {1, 2, 60}) {
    auto reference = curve(n);
    const auto estimate = moved(reference, 1.0, motion);
    const auto found = eval::align_poses(eval::pair_poses(estimate, reference, 0.02)).value();
    CHECK((found.T_reference_estimate * motion).log().norm() < 1e-9);
    CHECK(found.pairs == static_cast<std::size_t>(n));
  }
  // A millimetre of noise on positions a millimetre apart: the rotation stays.
  auto still = curve(10);
  for (auto& p : still) p.T_world_camera = se3(p.T_world_camera.rotation(), vec3(0, 0, 0));
  auto noisy = still;
  for (std::size_t i = 0; i != noisy.size(); ++i)
    noisy[i].T_world_camera = se3(still[i].T_world_camera.rotation(),
                                  vec3(0.001 * static_cast<double>(i % 2), 0.001 * static_cast<double>(i % 3), 0));
  const auto found = eval::align_poses(eval::pair_poses(noisy, still, 0.02)).value();
  CHECK(found.T_reference_estimate.rotation().angle() < 1e-9);
}

TEST_CASE("poses without an alignment say why") {
  CHECK(eval::align_poses({}).error().code == orbis::errc::no_data);
  auto bad = eval::pair_poses(curve(3), curve(3), 0.02);
  bad[1].estimate = se3(so3{}, vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0));
  CHECK(eval::align_poses(bad).error().code == orbis::errc::degenerate);
}
