// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/slam/detail/loops/scaled_alignment.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

vec3 random_vector(random_bits& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size);
  return {x, y, random.uniform(-size, size)};
}

using alignment = slam::detail::scaled_alignment<camera::pinhole>;

/// Points that two cameras know, with depths that are known to `depth_error` of themselves, of which each third pair is
/// wrong.
struct two_cameras {
  camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  sim3 T_to_from;
  std::vector<alignment::pair> pairs;
  std::vector<bool> wrong;

  two_cameras(std::uint64_t seed, double depth_error) {
    random_bits random(mix64(seed));
    T_to_from =
        sim3(so3::exp(random_vector(random, 0.1)), random_vector(random, 0.2), std::exp(random.uniform(-2.0, 2.0)));
    const auto known = [&](const vec3& p) {
      const vec2 noise(random.normal(), random.normal());
      const vec2 pixel = camera.project(p).value() + 0.5 * noise;
      const double depth = p.z() * (1.0 + depth_error * random.normal());
      return slam::detail::known_point{depth * *camera.unproject(pixel), pixel, 1.0};
    };
    while (pairs.size() != 90) {
      const vec2 pixel(random.uniform(50, 590), random.uniform(50, 430));
      const double unit = T_to_from.scale(), depth = random.uniform(2.0, 8.0);
      const vec3 to = depth * *camera.unproject(pixel), from = T_to_from.inverse() * to;
      if (!(from.z() > 0.2 / unit) || !camera.project(from)) continue;
      wrong.push_back(pairs.size() % 3 == 0);
      const vec2 aside(random.uniform(50, 590), random.uniform(50, 430));
      pairs.push_back({known(from), known(wrong.back() ? vec3(depth * *camera.unproject(aside)) : to),
                       1.0 / (depth_error * depth * depth_error * depth + 1e-6)});
    }
  }
};

}  // namespace

TEST_CASE("Two cameras are aligned in any units by where their points appear, however rough the depths are") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const double depth_error : {0.0, 0.03}) {
      const two_cameras scene(seed, depth_error);
      const auto found = optimize::ransac(alignment(scene.camera, scene.pairs),
                                          {.threshold = 3.0, .max_iterations = 3000, .min_inliers = 12});
      INFO("seed " << seed << " error of depths " << depth_error);
      REQUIRE(found.has_value());
      const sim3& T = found->model.T_to_from;
      CHECK(std::abs(std::log(T.scale() / scene.T_to_from.scale())) < 0.01 + 3.0 * depth_error);
      CHECK((T.rotation().inverse() * scene.T_to_from.rotation()).angle() < 0.01 + depth_error);
      std::size_t wrong = 0;
      for (const std::uint32_t i : found->inliers) wrong += scene.wrong[i] ? 1 : 0;
      CHECK(wrong <= 2);
      CHECK(found->inliers.size() > (depth_error == 0.0 ? 55U : 20U));
    }
}

TEST_CASE("A pair agrees with an alignment in both images or not at all") {
  const camera::pinhole camera{640, 480, 525.0, 525.0, 320.0, 240.0};
  const auto known = [&](const vec3& p, const vec2& off, double information) {
    return slam::detail::known_point{p, *camera.project(p) + off, information};
  };
  const sim3 half(so3(), vec3::Zero(), 0.5);
  const alignment::model m{half, half.inverse()};
  const vec3 p(0.2, -0.1, 2.0);
  const alignment a(camera, {{known(2.0 * p, vec2::Zero(), 1.0), known(p, vec2::Zero(), 1.0)},
                             {known(2.0 * p, vec2::Zero(), 1.0), known(p, vec2(3.0, 4.0), 1.0)},
                             {known(2.0 * p, vec2(3.0, 4.0), 0.25), known(p, vec2::Zero(), 1.0)},
                             {{vec3(0.0, 0.0, -2.0), vec2(320.0, 240.0), 1.0}, known(p, vec2::Zero(), 1.0)}});
  REQUIRE(a.size() == 4);
  CHECK(a.squared_error(m, 0) < 1e-18);
  CHECK(a.squared_error(m, 1) == Approx(25.0));
  CHECK(a.squared_error(m, 2) == Approx(6.25));
  CHECK(std::isinf(a.squared_error(m, 3)));
}
