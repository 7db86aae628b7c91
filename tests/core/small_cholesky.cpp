// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <Eigen/Cholesky>

#include <orbis/core/random.hpp>
#include <orbis/core/small_cholesky.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

template <int N>
void check_size() {
  random_bits random(N);
  for (int trial = 0; trial != 50; ++trial) {
    matrix<N + 2, N> a;
    for (int i = 0; i != a.size(); ++i) a.data()[i] = random.normal();
    for (int i = 0; i != N; ++i) a.col(i) *= std::pow(10.0, random.uniform(-6, 6));  // units of all sorts
    const matrix<N, N> h = a.transpose() * a;
    const double damping = trial % 2 == 0 ? 0.0 : random.uniform(0, 10);
    matrix<N> b;
    for (int i = 0; i != N; ++i) b[i] = random.normal() * a.col(i).norm();
    small_cholesky<N> cholesky;
    REQUIRE(cholesky.set(h));
    REQUIRE(cholesky.factor(damping) > 0.0);
    const matrix<N> x = cholesky.solve(b);
    matrix<N, N> damped = h;
    damped.diagonal() *= 1.0 + damping;
    const matrix<N> residual = damped * x - b;
    for (int i = 0; i != N; ++i) CHECK(std::abs(residual[i]) <= 1e-9 * a.col(i).norm());
    const matrix<N, N> one = damped * cholesky.inverse();
    for (int i = 0; i != N; ++i)
      for (int k = 0; k != N; ++k)
        CHECK(std::abs(one(i, k) - (i == k ? 1.0 : 0.0)) <= 1e-9 * a.col(i).norm() / a.col(k).norm());
  }
}

}  // namespace

TEST_CASE("Small systems are solved whatever the units") {
  check_size<1>();
  check_size<2>();
  check_size<3>();
  check_size<6>();
  check_size<9>();
}

TEST_CASE("Small systems that are not determined show it in the smallest pivot, or say so at once") {
  small_cholesky<3> cholesky;
  mat3 h = vec3(1, 2, 3) * vec3(1, 2, 3).transpose() + vec3(0, 1, -1) * vec3(0, 1, -1).transpose();
  REQUIRE(cholesky.set(h));
  CHECK_FALSE(cholesky.factor(0.0) > cholesky.determined);
  CHECK(cholesky.factor(1e-3) > 0.0);
  REQUIRE(cholesky.set(mat3::Identity()));
  CHECK(cholesky.factor(0.0) == 1.0);
  h = mat3::Identity();
  h(1, 0) = 2.0;  // not positive definite
  REQUIRE(cholesky.set(h));
  CHECK(cholesky.factor(0.0) < 0.0);
  h(1, 1) = 0.0;
  CHECK_FALSE(cholesky.set(h));
  h(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(cholesky.set(h));
  h(1, 1) = 1.0;
  h(2, 1) = std::numeric_limits<double>::quiet_NaN();
  REQUIRE(cholesky.set(h));
  CHECK_FALSE(cholesky.factor(0.0) > 0.0);
}
