// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/core/random.hpp>
#include <orbis/core/rotation.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

mat3 random_matrix(random_bits& random) {
  mat3 m;
  for (int i = 0; i != 9; ++i) m(i / 3, i % 3) = random.normal();
  return m;
}

}  // namespace

TEST_CASE("a rotation is its own nearest rotation") {
  random_bits random{1};
  for (int i = 0; i != 100; ++i) {
    const so3 r = so3::exp(vec3{random.normal(), random.normal(), random.normal()});
    const auto nearest = nearest_rotation(r.rotation_matrix());
    REQUIRE(nearest);
    CHECK((nearest->inverse() * r).angle() < 1e-14);
    // Neither a scale nor a symmetric positive stretch turns anything.
    CHECK((nearest_rotation(1e-200 * r.rotation_matrix())->inverse() * r).angle() < 1e-14);
    CHECK((nearest_rotation(1e200 * r.rotation_matrix())->inverse() * r).angle() < 1e-14);
    const mat3 a = random_matrix(random);
    const mat3 stretch = a * a.transpose() + mat3::Identity();
    CHECK((nearest_rotation(r.rotation_matrix() * stretch)->inverse() * r).angle() < 1e-12);
  }
}

TEST_CASE("no rotation close by is nearer than the nearest") {
  random_bits random{2};
  for (int i = 0; i != 50; ++i) {
    mat3 m = random_matrix(random);
    if (m.determinant() < 0.0) m = -m;
    const auto nearest = nearest_rotation(m);
    REQUIRE(nearest);
    const double best = (nearest->rotation_matrix() - m).norm();
    for (int k = 0; k != 20; ++k) {
      const double size = k < 10 ? 0.01 : 2.0;
      const so3 other = so3::exp(size * vec3{random.normal(), random.normal(), random.normal()}) * *nearest;
      CHECK((other.rotation_matrix() - m).norm() >= best - 1e-12);
    }
  }
}

TEST_CASE("matrices without a nearest rotation are degenerate") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  mat3 flat = mat3::Identity();
  flat(2, 2) = 0.0;
  mat3 mirror = mat3::Identity();
  mirror(1, 1) = -1.0;
  mat3 broken = mat3::Identity();
  broken(0, 1) = nan;
  mat3 endless = mat3::Identity();
  endless(0, 1) = -inf;
  for (const mat3& m :
       {mat3(mat3::Zero()), flat, mirror, broken, endless, mat3(mat3::Ones()), mat3(mat3::Constant(nan))}) {
    const auto r = nearest_rotation(m);
    REQUIRE(!r);
    CHECK(r.error().code == errc::degenerate);
    CHECK(!r.error().message.empty());
  }
}
