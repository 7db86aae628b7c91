// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/project_points.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

static_assert(world_point<vec3> && !world_point<keypoint>);

namespace {

struct landmark {
  vec3 position;
  vec3 normal;
  double min_distance, max_distance;
};

}  // namespace

TEST_CASE("a camera projects what lies before it and into its image, from where it was seen") {
  const camera::pinhole camera{640, 480, 500.0, 500.0, 320.0, 240.0};
  const se3 T_world_camera{so3::exp(vec3{0.1, -0.2, 0.3}), vec3{1.0, 2.0, 3.0}};
  const camera_projection project{camera, T_world_camera};
  const vec3 in_camera{0.2, -0.1, 2.0};
  const vec3 position = T_world_camera * in_camera;
  const auto plain = project(position);
  REQUIRE(plain);
  CHECK(plain->x == Approx(370.0));
  CHECK(plain->y == Approx(215.0));
  CHECK(plain->distance == Approx(in_camera.norm()));
  CHECK(plain->cosine == 1.0F);

  const vec3 towards = (T_world_camera.translation() - position).normalized();
  const vec3 aside = towards.cross(vec3{0.0, 0.0, 1.0}).normalized();
  const landmark l{position, std::cos(0.7) * towards + std::sin(0.7) * aside, 1.0, 4.0};
  const auto full = project(l);
  REQUIRE(full);
  CHECK(full->cosine == Approx(std::cos(0.7)));
  CHECK(full->min_distance == 1.0F);
  CHECK(full->max_distance == 4.0F);

  CHECK_FALSE(project(T_world_camera * vec3{0.0, 0.0, -2.0}));
  CHECK_FALSE(project(T_world_camera * vec3{3.0, 0.0, 2.0}));
  CHECK_FALSE(project(vec3{vec3::Constant(std::numeric_limits<double>::quiet_NaN())}));
}
