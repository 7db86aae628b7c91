// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view-inl.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct two_images {
  se3 T_first_second;
  std::vector<vec2> first, second;
  std::size_t good = 0;
};

enum class shape { general, planar };

template <class Camera>
two_images make_images(const Camera& camera, std::uint64_t seed, std::size_t n, double outliers, double noise,
                       double baseline = 0.5, shape kind = shape::general) {
  random_bits random(seed);
  two_images s;
  s.T_first_second =
      se3(so3::exp(test::random_vector(random, 0.15)), baseline * test::random_vector(random, 1.0).normalized());
  while (s.first.size() < n) {
    vec3 p = test::random_point_in_view(random);
    if (kind == shape::planar) p *= 3.0 / (p.z() + 0.3 * p.x());
    const auto a = camera.project(p), b = camera.project(s.T_first_second.inverse() * p);
    if (!a || !b) continue;
    const vec2 noise_a(random.normal(), random.normal()), noise_b(random.normal(), random.normal());
    const vec2 anywhere(random.uniform(0, camera.width()), random.uniform(0, camera.height()));
    const bool right = static_cast<double>(s.first.size()) < (1.0 - outliers) * static_cast<double>(n);
    s.good += right ? 1U : 0U;
    s.first.push_back(*a + noise * noise_a);
    s.second.push_back(right ? vec2(*b + noise * noise_b) : anywhere);
  }
  return s;
}

double direction_error(const se3& a, const se3& b) {
  return std::acos(std::min(1.0, a.translation().normalized().dot(b.translation().normalized())));
}

const camera::pinhole pinhole_camera{{.width = 640, .height = 480, .fx = 525, .fy = 520, .cx = 320, .cy = 240}};

}  // namespace

TEST_CASE("An essential matrix decomposes into the pose it was made of and three others") {
  random_bits random(3);
  for (int trial = 0; trial != 200; ++trial) {
    const se3 truth(test::random_pose(random).rotation(), test::random_vector(random, 1.0).normalized());
    double nearest = 10.0;
    const double sign = trial % 2 == 0 ? 3.0 : -0.2;  // the scale does not matter
    for (const se3& pose : optimize::detail::decompose_essential(sign * optimize::detail::essential_matrix(truth)))
      nearest = std::min(nearest, (pose.to_matrix() - truth.to_matrix()).norm());
    CHECK(nearest < 1e-12);
  }
}

TEST_CASE("The relative pose of two images is found among 50 percent wrong matches") {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const two_images s = make_images(pinhole_camera, seed, 400, 0.5, 0.5);
    const auto found = optimize::estimate_essential(s.first, s.second, pinhole_camera, {.seed = seed});
    REQUIRE(found.has_value());
    CHECK(test::angle_between(found->T_first_second, s.T_first_second) < 0.01);
    CHECK(direction_error(found->T_first_second, s.T_first_second) < 0.06);
    CHECK(found->T_first_second.translation().norm() == Approx(1.0));
    CHECK(found->inliers.size() > 190);
    CHECK(found->in_front > 180);
    CHECK(found->parallax > 0.02);
    CHECK(found->rmse < 1.5);
  }
}

TEST_CASE("The relative pose is exact without noise, in a plane as in space, and its inliers are its own") {
  for (const shape kind : {shape::general, shape::planar})
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const two_images s = make_images(pinhole_camera, seed, 200, 0.0, 0.0, 0.5, kind);
      const auto found = optimize::estimate_essential(s.first, s.second, pinhole_camera, {.seed = seed});
      REQUIRE(found.has_value());
      CHECK(found->inliers.size() == s.good);
      // In a plane there may be a second pose; it explains the matches just as well.
      if (kind == shape::general) {
        CHECK(test::angle_between(found->T_first_second, s.T_first_second) < 1e-7);
        CHECK(direction_error(found->T_first_second, s.T_first_second) < 1e-6);
      }
      CHECK(found->rmse < 1e-6);
    }
}

TEST_CASE("The relative pose is found through a distorting camera and is the same again") {
  const camera::radial_tangential camera{
      {.width = 640, .height = 480, .fx = 517.3, .fy = 516.5, .cx = 318.6, .cy = 255.3},
      {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};
  const two_images s = make_images(camera, 9, 300, 0.4, 0.3);
  const auto a = optimize::estimate_essential(s.first, s.second, camera);
  const auto b = optimize::estimate_essential(s.first, s.second, camera);
  REQUIRE(a.has_value());
  REQUIRE(b.has_value());
  CHECK(test::angle_between(a->T_first_second, s.T_first_second) < 0.01);
  CHECK(direction_error(a->T_first_second, s.T_first_second) < 0.06);
  CHECK(a->T_first_second.to_matrix() == b->T_first_second.to_matrix());
  CHECK(a->inliers == b->inliers);
}

TEST_CASE("The relative pose has as many inliers as are asked for, or there is none") {
  CHECK(test::keeps_to_min_inliers([](std::size_t asked, std::size_t seed) {
    const two_images s = make_images(pinhole_camera, seed, 60, 0.3, 1.5);
    return optimize::estimate_essential(s.first, s.second, pinhole_camera,
                                        {.threshold = 1.5, .max_iterations = 100, .min_inliers = asked, .seed = seed});
  }));
}

TEST_CASE("The relative pose says why there is none") {
  const auto why = [](const two_images& s, const optimize::essential_options& options = {}) {
    const auto found = optimize::estimate_essential(s.first, s.second, pinhole_camera, options);
    return found ? error{} : found.error();
  };
  two_images turned = make_images(pinhole_camera, 4, 200, 0.2, 0.3, 0.0);
  CHECK(why(turned).code == errc::degenerate);
  CHECK(why(turned).message.find("no parallax") == 0);
  for (const double bad : test::bad_thresholds) CHECK(why(turned, {.threshold = bad}).code == errc::invalid_argument);
  two_images same = turned;
  same.second = same.first;
  CHECK(why(same).message.find("no parallax") == 0);
  const two_images nonsense = make_images(pinhole_camera, 4, 200, 1.0, 0.3);
  CHECK(why(nonsense, {.max_iterations = 200, .min_inliers = 100}).message.find("no model has enough inliers") == 0);
  two_images bad = turned;
  for (auto& p : bad.first) p.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(why(bad).message.find("only 0 of 200 matches are finite") == 0);
  two_images few = turned;
  few.first.resize(4);
  CHECK(why(few).code == errc::invalid_argument);
  few.second.resize(4);
  CHECK(why(few).code == errc::no_data);
}
