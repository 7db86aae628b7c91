// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <orbis/optimize/prior.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::lie_group;
using optimize::pose_prior;

TEST_CASE("A prior made of an information matrix has its square, of full rank or not") {
  random_bits random(4);
  for (int trial = 0; trial != 50; ++trial) {
    const int rank = trial % 7;
    matrix<6, 6> a = mat6::Zero();
    for (int r = 0; r != rank; ++r)
      for (int c = 0; c != 6; ++c) a(r, c) = random.normal();
    const mat6 information = a.transpose() * a;
    const se3 expected = test::random_pose(random);
    const auto prior = pose_prior::from_information(expected, information);
    REQUIRE(prior);
    CHECK((prior->root.transpose() * prior->root - information).norm() <= 1e-12 * (1.0 + information.norm()));
    vec6 step;
    step << test::random_vector(random, 1.0), test::random_vector(random, 1.0);
    const auto r = prior->residual(expected * se3::exp(step));
    REQUIRE(r);
    CHECK(r->squaredNorm() == Approx(step.dot(information * step)).margin(1e-9));
  }
}

TEST_CASE("A prior of vectors is their difference, and one of rotations their angle") {
  const optimize::prior<optimize::euclidean<2>> vector{vec2(1, 2), mat2::Identity() * 3.0, {}};
  mat2 j = mat2::Zero();
  CHECK(*vector.linearize(vec2(2, 4), j) == vec2(3, 6));
  CHECK(j == mat2::Identity() * 3.0);
  const optimize::prior<lie_group<so3>> rotation{so3{}, mat3::Identity(), {}};
  CHECK(rotation.residual(so3::exp(vec3(0, 0.5, 0)))->norm() == Approx(0.5));
}

TEST_CASE("Information that is none is refused, and an estimate that is not finite has no residual") {
  mat6 information = mat6::Identity();
  information(2, 3) = 0.5;
  CHECK_FALSE(pose_prior::from_information(se3{}, information));  // not symmetric
  information(3, 2) = 0.5;
  CHECK(pose_prior::from_information(se3{}, information));
  information(5, 5) = -1.0;
  CHECK_FALSE(pose_prior::from_information(se3{}, information));
  information(5, 5) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(pose_prior::from_information(se3{}, information));
  const pose_prior prior;
  mat6 j = mat6::Constant(5.0);
  const se3 lost(so3{}, vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  CHECK_FALSE(prior.residual(lost));
  CHECK_FALSE(prior.linearize(lost, j));
  CHECK(j == mat6::Constant(5.0));
}
