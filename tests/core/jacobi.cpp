// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <support/catch.hpp>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

template <int N>
matrix<N, N> random_matrix(random_bits& random) {
  matrix<N, N> m;
  for (int i = 0; i != N; ++i)
    for (int k = 0; k != N; ++k) m(i, k) = random.normal();
  return m;
}

template <int N>
void check_eigen(const matrix<N, N>& a) {
  const auto e = eigen_of_symmetric<N>(a);
  const double size = std::max(a.cwiseAbs().maxCoeff(), 1e-290);
  CHECK((a * e.vectors - e.vectors * e.values.asDiagonal()).cwiseAbs().maxCoeff() <= 1e-14 * N * size);
  CHECK((e.vectors.transpose() * e.vectors - matrix<N, N>::Identity()).norm() < 1e-13);
  for (int i = 1; i < N; ++i) CHECK(e.values[i - 1] <= e.values[i]);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> reference(a);
  CHECK((e.values - reference.eigenvalues()).cwiseAbs().maxCoeff() <= 1e-13 * size);
}

template <int N>
void check_singular(const matrix<N, N>& m) {
  const auto s = singular_values_of<N>(m);
  const double size = std::max(m.cwiseAbs().maxCoeff(), 1e-290);
  CHECK((s.u * s.values.asDiagonal() * s.v.transpose() - m).cwiseAbs().maxCoeff() <= 1e-14 * N * size);
  CHECK((s.u.transpose() * s.u - matrix<N, N>::Identity()).norm() < 1e-12);
  CHECK((s.v.transpose() * s.v - matrix<N, N>::Identity()).norm() < 1e-12);
  for (int i = 1; i < N; ++i) CHECK(s.values[i - 1] >= s.values[i]);
  CHECK(s.values[N - 1] >= 0.0);
  const Eigen::JacobiSVD<Eigen::Matrix<double, N, N>> reference(m);
  CHECK((s.values - reference.singularValues()).cwiseAbs().maxCoeff() <= 1e-13 * size);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("eigenvalues of symmetric matrices are Eigen's", "[jacobi]", ((int N), N), 2, 3, 4, 9) {
  random_bits random{N};
  for (int n = 0; n != 50; ++n) {
    const matrix<N, N> m = random_matrix<N>(random);
    check_eigen<N>(m + m.transpose());
    check_eigen<N>(m * m.transpose());
    // Directions that hardly count beside others, and equal eigenvalues.
    matrix<N> scale;
    for (int i = 0; i != N; ++i) scale[i] = std::pow(10.0, -4.0 * i);
    check_eigen<N>(scale.asDiagonal() * (m * m.transpose()) * scale.asDiagonal());
    check_eigen<N>(m.col(0) * m.col(0).transpose());
  }
  check_eigen<N>(matrix<N, N>::Zero());
  check_eigen<N>(matrix<N, N>::Identity());
  check_eigen<N>(1e-200 * matrix<N, N>::Ones());
}

TEMPLATE_TEST_CASE_SIG("singular values are Eigen's, of singular matrices as well", "[jacobi]", ((int N), N), 2, 3, 4) {
  random_bits random{10 + N};
  for (int n = 0; n != 50; ++n) {
    const matrix<N, N> m = random_matrix<N>(random);
    check_singular<N>(m);
    check_singular<N>(1e200 * m);
    check_singular<N>(1e-200 * m);
    check_singular<N>(m.col(0) * m.row(1));
    matrix<N, N> empty_column = m;
    empty_column.col(n % N).setZero();
    check_singular<N>(empty_column);
  }
  check_singular<N>(matrix<N, N>::Zero());
  check_singular<N>(matrix<N, N>::Identity());
  check_singular<N>(matrix<N, N>::Ones());
}

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
