// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/mapping/upright.hpp>

#include "support/catch.hpp"

namespace {

using namespace orbis;
using mapping::detail::vote_for_up;

constexpr double degree = std::numbers::pi / 180.0;
constexpr double limit = 50 * degree;

/// Normals about a direction, a few degrees off.
void add(std::vector<vec3>& to, const vec3& direction, int count, random_bits& random) {
  for (int i = 0; i != count; ++i) {
    const vec3 off(random.normal(), random.normal(), random.normal());
    to.push_back((direction + 0.03 * off).normalized());
  }
}

TEST_CASE("up is where most normals lie along it or across it, among many that do neither") {
  random_bits random{7};
  for (const double tilt : {0.0, 20.0, 40.0})
    for (const bool floor : {false, true}) {
      const so3 R = so3::exp(vec3(0.4, 0.1, 0.9).normalized() * tilt * degree);
      const vec3 up = R * vec3(0, -1, 0);
      std::vector<vec3> normals;
      if (floor) add(normals, up, 80, random);
      add(normals, R * vec3(0.2, 0, -1).normalized(), 70, random);
      add(normals, R * vec3(-1, 0, -0.3).normalized(), 70, random);
      for (int i = 0; i != 120; ++i)
        normals.push_back(vec3(random.normal(), random.normal(), random.normal()).normalized());
      const auto found = vote_for_up(normals, limit);
      REQUIRE(found);
      CHECK(found->up.norm() == Approx(1.0));
      CHECK(std::acos(std::min(1.0, found->up.dot(up))) < 1.5 * degree);
      CHECK((found->along > 25) == floor);
      CHECK(found->fixing > 30);
    }
}

TEST_CASE("one wall does not say where up is, nor does nothing") {
  CHECK_FALSE(vote_for_up({}, limit));
  random_bits random{8};
  std::vector<vec3> wall;
  add(wall, vec3(0.1, 0.2, -1).normalized(), 300, random);
  const auto found = vote_for_up(wall, limit);
  CHECK((!found || found->fixing < 5));
}

}  // namespace
