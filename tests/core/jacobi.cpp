// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

// Sizes are compile-time constants only where the library is called: the rest is compiled once for all of them.
using Eigen::MatrixXd, Eigen::VectorXd;

MatrixXd random_matrix(int n, random_bits& random) {
  MatrixXd m(n, n);
  for (int i = 0; i != n; ++i)
    for (int k = 0; k != n; ++k) m(i, k) = random.normal();
  return m;
}

void check_orthonormal(const MatrixXd& m, double tolerance) {
  CHECK((m.transpose() * m - MatrixXd::Identity(m.rows(), m.cols())).norm() < tolerance);
}

void check_eigen(const MatrixXd& a, const VectorXd& values, const MatrixXd& vectors) {
  const double n = static_cast<double>(a.rows()), size = std::max(a.cwiseAbs().maxCoeff(), 1e-290);
  CHECK((a * vectors - vectors * values.asDiagonal()).cwiseAbs().maxCoeff() <= 1e-14 * n * size);
  check_orthonormal(vectors, 1e-13);
  for (int i = 1; i < a.rows(); ++i) CHECK(values[i - 1] <= values[i]);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> reference(a);
  CHECK((values - reference.eigenvalues()).cwiseAbs().maxCoeff() <= 1e-13 * size);
}
template <int N>
void check_eigen(const MatrixXd& a) {
  const auto e = eigen_of_symmetric<N>(matrix<N, N>(a));
  check_eigen(a, e.values, e.vectors);
}

void check_singular(const MatrixXd& m, const MatrixXd& u, const VectorXd& values, const MatrixXd& v) {
  const double n = static_cast<double>(m.rows()), size = std::max(m.cwiseAbs().maxCoeff(), 1e-290);
  CHECK((u * values.asDiagonal() * v.transpose() - m).cwiseAbs().maxCoeff() <= 1e-14 * n * size);
  check_orthonormal(u, 1e-12);
  check_orthonormal(v, 1e-12);
  for (int i = 1; i < m.rows(); ++i) CHECK(values[i - 1] >= values[i]);
  CHECK(values[m.rows() - 1] >= 0.0);
  const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> reference(m);
  CHECK((values - reference.singularValues()).cwiseAbs().maxCoeff() <= 1e-13 * size);
}
template <int N>
void check_singular(const MatrixXd& m) {
  const auto s = svd<N>(matrix<N, N>(m));
  check_singular(m, s.u, s.values, s.v);
}

/// What is checked with one matrix.
using check_of_size = void (*)(const MatrixXd&);

void check_symmetric_matrices(int n, check_of_size check) {
  random_bits random{static_cast<std::uint64_t>(n)};
  for (int round = 0; round != 50; ++round) {
    const MatrixXd m = random_matrix(n, random);
    check(m + m.transpose());
    check(m * m.transpose());
    // Directions that hardly count beside others, and equal eigenvalues.
    VectorXd scale(n);
    for (int i = 0; i != n; ++i) scale[i] = std::pow(10.0, -4.0 * i);
    check(scale.asDiagonal() * (m * m.transpose()) * scale.asDiagonal());
    check(m.col(0) * m.col(0).transpose());
  }
  check(MatrixXd::Zero(n, n));
  check(MatrixXd::Identity(n, n));
  check(1e-200 * MatrixXd::Ones(n, n));
}

void check_square_matrices(int n, check_of_size check) {
  random_bits random{10 + static_cast<std::uint64_t>(n)};
  for (int round = 0; round != 50; ++round) {
    const MatrixXd m = random_matrix(n, random);
    check(m);
    check(1e200 * m);
    check(1e-200 * m);
    check(m.col(0) * m.row(1));
    MatrixXd empty_column = m;
    empty_column.col(round % n).setZero();
    check(empty_column);
  }
  check(MatrixXd::Zero(n, n));
  check(MatrixXd::Identity(n, n));
  check(MatrixXd::Ones(n, n));
}

}  // namespace

TEST_CASE("eigenvalues of symmetric matrices are Eigen's", "[jacobi]") {
  check_symmetric_matrices(2, check_eigen<2>);
  check_symmetric_matrices(3, check_eigen<3>);
  check_symmetric_matrices(4, check_eigen<4>);
  check_symmetric_matrices(9, check_eigen<9>);
}

TEST_CASE("singular values are Eigen's, of singular matrices as well", "[jacobi]") {
  check_square_matrices(2, check_singular<2>);
  check_square_matrices(3, check_singular<3>);
  check_square_matrices(4, check_singular<4>);
}

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
    const mat3 a = random_matrix(3, random);
    const mat3 stretch = a * a.transpose() + mat3::Identity();
    CHECK((nearest_rotation(r.rotation_matrix() * stretch)->inverse() * r).angle() < 1e-12);
  }
}

TEST_CASE("no rotation close by is nearer than the nearest") {
  random_bits random{2};
  for (int i = 0; i != 50; ++i) {
    mat3 m = random_matrix(3, random);
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
