// SPDX-License-Identifier: BSD-3-Clause
#include <numbers>
#include <vector>

#include <orbis/core/so3.hpp>

#include "core/lie_group_checks.hpp"

using namespace orbis;
using namespace orbis::test;

namespace {

template <class S>
std::vector<matrix<3, 1, S>> rotation_vectors() {
  random_bits random{1};
  std::vector<matrix<3, 1, S>> v;
  for (const double angle : interesting_angles()) v.push_back(random_rotation_vector<S>(random, angle));
  return v;
}

}  // namespace

TEMPLATE_TEST_CASE("rotations form a group", "", float, double) {
  const double tolerance = std::is_same_v<TestType, float> ? 2e-6 : 1e-14;
  std::vector<basic_so3<TestType>> elements;
  for (const auto& phi : rotation_vectors<TestType>()) elements.push_back(basic_so3<TestType>::exp(phi));
  check_group_axioms(elements, tolerance);
}

TEST_CASE("the exponential of a rotation vector is that of its matrix") {
  for (const vec3& phi : rotation_vectors<double>()) {
    CHECK(difference(so3::exp(phi).rotation_matrix(), exponential_series(hat<double>(phi))) < 1e-14);
    CHECK(so3::exp(phi).unit_quaternion().norm() == Approx(1.0).epsilon(1e-15));
  }
  CHECK(difference(so3::exp({0.0, 0.0, std::numbers::pi / 2}) * vec3{1, 0, 0}, vec3{0, 1, 0}) < 1e-15);
}

TEMPLATE_TEST_CASE("rotation vectors survive exp and log", "", float, double) {
  const double tolerance = std::is_same_v<TestType, float> ? 5e-6 : 1e-14;
  for (const auto& phi : rotation_vectors<TestType>()) {
    if (std::is_same_v<TestType, float> && phi.norm() > 3.14f) continue;  // pi - 1e-8 is above pi in float
    const auto again = basic_so3<TestType>::exp(phi).log();
    CHECK(difference(phi, again) < tolerance);
    // Small vectors keep their relative precision as well.
    if (phi.norm() > TestType(1e-30)) CHECK(double((again - phi).norm() / phi.norm()) < tolerance);
  }
}

TEST_CASE("the logarithm takes the shorter way round whatever the sign of the quaternion") {
  for (const vec3& phi : rotation_vectors<double>()) {
    so3::quaternion q = so3::exp(phi).unit_quaternion();
    q.coeffs() *= -1.0;
    CHECK(difference(so3{q}.log(), phi) < 1e-14);
  }
  // Beyond pi the same rotation has a shorter vector.
  const vec3 axis = vec3{1, 2, -2} / 3.0;
  CHECK(difference(so3::exp(4.0 * axis).log(), vec3(axis * (4.0 - 2.0 * std::numbers::pi))) < 1e-14);
  CHECK(so3::exp(std::numbers::pi * axis).angle() == Approx(std::numbers::pi));
  CHECK(so3{so3::quaternion{0, 0, 1, 0}}.angle() == Approx(std::numbers::pi));
}

TEST_CASE("rotations turn about the adjoint") {
  std::vector<so3> elements;
  for (const vec3& phi : rotation_vectors<double>()) elements.push_back(so3::exp(phi));
  check_adjoint(elements, rotation_vectors<double>(), 1e-14);
}

TEST_CASE("the Jacobians of a rotation agree with central differences") {
  for (const vec3& phi : rotation_vectors<double>()) check_jacobians<so3>(phi, 1e-5, 1e-9);
  random_bits random{2};
  for (const double angle : {4.0, 5.0, 6.0})
    check_jacobians<so3>(random_rotation_vector<double>(random, angle), 1e-5, 1e-8);
}

TEST_CASE("the Jacobians of a float rotation agree with those of a double") {
  for (const vec3& phi : rotation_vectors<double>()) {
    CHECK(difference(basic_so3<float>::left_jacobian(phi.cast<float>()), so3::left_jacobian(phi)) < 2e-6);
    CHECK(difference(basic_so3<float>::left_jacobian_inverse(phi.cast<float>()), so3::left_jacobian_inverse(phi)) <
          5e-6);
  }
}

TEST_CASE("hat is the cross product") {
  const vec3 a{1, 2, 3}, b{-4, 5, 0.5};
  CHECK(difference(hat<double>(a) * b, a.cross(b)) == 0.0);
}

TEST_CASE("a rotation is read from its matrix and from a quaternion of any length") {
  for (const vec3& phi : rotation_vectors<double>()) {
    const so3 r = so3::exp(phi);
    CHECK(difference(so3{r.rotation_matrix()}.rotation_matrix(), r.rotation_matrix()) < 1e-14);
    so3::quaternion q = r.unit_quaternion();
    q.coeffs() *= 17.0;
    CHECK(difference(so3{q}.rotation_matrix(), r.rotation_matrix()) < 1e-14);
  }
}
