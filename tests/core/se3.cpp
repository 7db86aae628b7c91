// SPDX-License-Identifier: BSD-3-Clause
#include <type_traits>
#include <vector>

#include <orbis/core/se3.hpp>

#include "core/lie_group_checks.hpp"

using namespace orbis;
using namespace orbis::test;

namespace {

template <class S>
std::vector<matrix<6, 1, S>> twists() {
  random_bits random{3};
  std::vector<matrix<6, 1, S>> v;
  for (const double angle : interesting_angles()) {
    matrix<6, 1, S> xi;
    xi << matrix<3, 1, S>{S(random.normal()), S(random.normal()), S(random.normal())},
        random_rotation_vector<S>(random, angle);
    v.push_back(xi);
  }
  return v;
}

template <class S>
std::vector<basic_se3<S>> transforms() {
  std::vector<basic_se3<S>> v;
  for (const auto& xi : twists<S>()) v.push_back(basic_se3<S>::exp(xi));
  return v;
}

}  // namespace

TEMPLATE_TEST_CASE("rigid transforms form a group", "", float, double) {
  check_group_axioms(transforms<TestType>(), std::is_same_v<TestType, float> ? 5e-6 : 2e-14);
}

TEST_CASE("the exponential of a twist is that of its matrix") {
  for (const vec6& xi : twists<double>()) {
    mat4 m = mat4::Zero();
    m.topLeftCorner<3, 3>() = hat<double>(xi.tail<3>());
    m.topRightCorner<3, 1>() = xi.head<3>();
    CHECK(difference(se3::exp(xi).to_matrix(), exponential_series(m)) < 1e-14);
  }
}

TEMPLATE_TEST_CASE("twists survive exp and log", "", float, double) {
  for (const auto& xi : twists<TestType>()) {
    if (std::is_same_v<TestType, float> && xi.template tail<3>().norm() > 3.14f) continue;
    CHECK(difference(xi, basic_se3<TestType>::exp(xi).log()) < (std::is_same_v<TestType, float> ? 1e-5 : 2e-14));
  }
}

TEST_CASE("rigid transforms act as their matrices") {
  for (const se3& t : transforms<double>()) {
    const vec3 p{0.1, -2.0, 3.0};
    const vec4 h = t.to_matrix() * vec4{p.x(), p.y(), p.z(), 1.0};
    CHECK(difference(t * p, h.head<3>().eval()) < 1e-14);
  }
}

TEST_CASE("twists move by the adjoint") { check_adjoint(transforms<double>(), twists<double>(), 1e-13); }

TEST_CASE("the Jacobians of a rigid transform agree with central differences") {
  for (const vec6& xi : twists<double>()) check_jacobians<se3>(xi, 1e-5, 1e-8);
  random_bits random{4};
  for (const double angle : {4.0, 5.5}) {
    vec6 xi;
    xi << 1.0, -2.0, 3.0, random_rotation_vector<double>(random, angle);
    check_jacobians<se3>(xi, 1e-5, 1e-7);
  }
}

TEST_CASE("the Jacobians of a float transform agree with those of a double") {
  for (const vec6& xi : twists<double>()) {
    CHECK(difference(basic_se3<float>::left_jacobian(xi.cast<float>()), se3::left_jacobian(xi)) < 3e-6);
    CHECK(difference(basic_se3<float>::left_jacobian_inverse(xi.cast<float>()), se3::left_jacobian_inverse(xi)) < 1e-5);
  }
}

TEST_CASE("the closed and the series form of the Jacobian meet") {
  vec6 below, above;
  below << 1, 2, 3, 1.0 - 1e-12, 0, 0;
  above << 1, 2, 3, 1.0 + 1e-12, 0, 0;
  CHECK(difference(se3::left_jacobian(below), se3::left_jacobian(above)) < 1e-11);
}
