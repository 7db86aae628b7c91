// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/core/sim3.hpp>

#include "core/lie_group_checks.hpp"

using namespace orbis;
using namespace orbis::test;

namespace {

std::vector<vec7> tangents() {
  random_bits random{5};
  const double sigmas[] = {0.0, 1e-12, -1e-6, 1e-3, 0.5, -0.7, 1.2};
  std::vector<vec7> v;
  std::size_t i = 0;
  for (const double angle : interesting_angles()) {
    vec7 xi;
    xi << vec3{random.normal(), random.normal(), random.normal()}, random_rotation_vector<double>(random, angle),
        sigmas[i++ % std::size(sigmas)];
    v.push_back(xi);
  }
  return v;
}

std::vector<sim3> similarities() {
  std::vector<sim3> v;
  for (const auto& xi : tangents()) v.push_back(sim3::exp(xi));
  return v;
}

mat4 algebra(const vec7& xi) {
  mat4 m = mat4::Zero();
  m.topLeftCorner<3, 3>() = hat<double>(xi.segment<3>(3)) + xi[6] * mat3::Identity();
  m.topRightCorner<3, 1>() = xi.head<3>();
  return m;
}

}  // namespace

TEST_CASE("similarities form a group") { check_group_axioms(similarities(), 5e-14); }

TEST_CASE("the exponential of a similarity tangent is that of its matrix") {
  for (const vec7& xi : tangents()) {
    CHECK(difference(sim3::exp(xi).to_matrix(), exponential_series(algebra(xi))) < 2e-14);
    CHECK(sim3::exp(xi).scale() == Approx(std::exp(xi[6])));
  }
}

TEST_CASE("similarity tangents survive exp and log") {
  for (const auto& xi : tangents()) CHECK(difference(xi, sim3::exp(xi).log()) < 5e-14);
}

TEST_CASE("large and tiny scales survive exp and log") {
  for (const double sigma : {-20.0, -8.0, 8.0, 20.0}) {
    vec7 xi;
    xi << 1.0, -2.0, 0.5, 0.3, -1.0, 2.0, sigma;
    CHECK(difference(xi, sim3::exp(xi).log()) < 1e-11);
  }
}

TEST_CASE("similarities act as their matrices") {
  for (const sim3& t : similarities()) {
    const vec3 p{0.1, -2.0, 3.0};
    const vec4 h = t.to_matrix() * vec4{p.x(), p.y(), p.z(), 1.0};
    CHECK(difference(t * p, h.head<3>().eval()) < 1e-14);
  }
}

TEST_CASE("similarity tangents move by the adjoint") { check_adjoint(similarities(), tangents(), 1e-12); }

TEST_CASE("the Jacobians of a similarity agree with central differences") {
  for (const vec7& xi : tangents()) check_jacobians<sim3>(xi, 1e-5, 1e-8);
}

TEST_CASE("a similarity of scale one is the rigid transform") {
  for (vec7 xi : tangents()) {
    xi[6] = 0.0;
    const vec6 twist = xi.head<6>();
    CHECK(difference(sim3::exp(xi).to_matrix(), se3::exp(twist).to_matrix()) < 1e-14);
    CHECK(difference(sim3{se3::exp(twist)}.log(), xi) < 1e-13);
    CHECK(difference(sim3::left_jacobian(xi).topLeftCorner<6, 6>().eval(), se3::left_jacobian(twist)) < 1e-14);
  }
}

TEST_CASE("not a number goes through the similarity and does not hang") {
  vec7 xi = vec7::Constant(std::nan(""));
  CHECK(std::isnan(sim3::exp(xi).translation().x()));
  xi.setConstant(std::numeric_limits<double>::infinity());
  CHECK(!sim3::left_jacobian(xi).allFinite());
}
