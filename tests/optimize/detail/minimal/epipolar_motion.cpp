// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/optimize/detail/minimal/epipolar_motion.hpp>

#include "optimize/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize::detail;

TEST_CASE("Steps on the sphere keep to it, and the basis is their derivative") {
  random_bits random{302};
  std::vector<vec3> points{vec3(0, 0, 1), vec3(0, 0, -1), vec3(1, 0, 0), vec3(0, -1, 0)};
  for (int i = 0; i != 50; ++i) points.push_back(test::random_vector(random, 1.0).normalized());
  for (const vec3& p : points) {
    const matrix<3, 2> b = tangent_basis(p);
    CHECK((b.transpose() * b - mat2::Identity()).norm() < 1e-12);
    CHECK((b.transpose() * p).norm() < 1e-12);
    const vec2 d = vec2(random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0));
    CHECK(step_on_sphere(p, d).norm() == Approx(1.0).epsilon(1e-12));
    for (int i = 0; i != 2; ++i) {
      const vec2 h = 1e-6 * vec2::Unit(i);
      const vec3 slope = (step_on_sphere(p, h) - step_on_sphere(p, -h)) / 2e-6;
      CHECK((slope - b.col(i)).norm() < 1e-8);
    }
  }
  // A step is as long as the way it goes.
  const vec3 p = points.back(), q = step_on_sphere(p, vec2(0.3, 0.4));
  CHECK(std::acos(p.dot(q)) == Approx(0.5));
}
