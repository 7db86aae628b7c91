// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <type_traits>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <orbis/core/random.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/small_matrix.hpp>
#include <orbis/core/types.hpp>

#include "support/catch.hpp"

// Inside the namespace, where the operators are found.
namespace orbis::small_matrix_test {

template <class M>
M random_matrix(random_bits& random) {
  M m;
  for (int i = 0; i != m.size(); ++i) m.data()[i] = random.uniform(-2.0, 2.0);
  return m;
}

template <class A, class B>
bool near(const A& a, const B& b, double tolerance = 1e-12) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a - b).cwiseAbs().maxCoeff() <= tolerance;
}

/// Products, sums and parts of `R x K` and `K x C` matrices against Eigen's.
template <int R, int K, int C>
void check_sizes(random_bits& random) {
  using left = matrix<R, K>;
  using right = matrix<K, C>;
  const left a = random_matrix<left>(random), b = random_matrix<left>(random);
  const right c = random_matrix<right>(random);
  const Eigen::MatrixXd x = a, y = b, z = c;
  static_assert(std::is_same_v<decltype(a * c), matrix<R, C>>);
  static_assert(std::is_same_v<decltype(a + b), left>);
  CHECK(near(Eigen::MatrixXd(a * c), Eigen::MatrixXd(x * z)));
  CHECK(near(Eigen::MatrixXd(a + b), Eigen::MatrixXd(x + y), 0.0));
  CHECK(near(Eigen::MatrixXd(a - b), Eigen::MatrixXd(x - y), 0.0));
  CHECK(near(Eigen::MatrixXd(-a), Eigen::MatrixXd(-x), 0.0));
  CHECK(near(Eigen::MatrixXd(3 * a / 2.0), Eigen::MatrixXd(3.0 * x / 2.0), 0.0));
  CHECK(near(Eigen::MatrixXd(transposed(a)), Eigen::MatrixXd(x.transpose()), 0.0));
  CHECK(near(Eigen::MatrixXd(transposed_product(a, b)), Eigen::MatrixXd(x.transpose() * y)));
  left d = a;
  d += b;
  d -= a;
  d *= 2.0;
  d /= 4;
  CHECK(near(Eigen::MatrixXd(d), Eigen::MatrixXd(0.5 * y)));
  d += d;
  CHECK(near(Eigen::MatrixXd(d), Eigen::MatrixXd(y)));
  CHECK(std::abs(squared_norm(a) - x.squaredNorm()) < 1e-12);
  CHECK(std::abs(norm(a) - x.norm()) < 1e-12);
  CHECK(std::abs(sum_entries(a) - x.sum()) < 1e-12);
  CHECK(min_entry(a) == x.minCoeff());
  CHECK(max_entry(a) == x.maxCoeff());
  CHECK(largest_magnitude(a) == x.cwiseAbs().maxCoeff());
  CHECK(near(Eigen::MatrixXd(column_of(a, K - 1)), Eigen::MatrixXd(x.col(K - 1)), 0.0));
  CHECK(near(Eigen::MatrixXd(row_of(a, R - 1)), Eigen::MatrixXd(x.row(R - 1).transpose()), 0.0));
  left e = zeros<left>();
  set_block(e, R - 1, 0, block<1, K>(a, R - 1, 0));
  for (int r = 0; r + 1 < R; ++r) set_row(e, r, row_of(a, r));
  CHECK(near(Eigen::MatrixXd(e), x, 0.0));
}

TEST_CASE("small matrices are added, multiplied and taken apart as Eigen does it") {
  random_bits random(1);
  for (int trial = 0; trial != 20; ++trial) {
    check_sizes<1, 1, 1>(random);
    check_sizes<1, 4, 3>(random);
    check_sizes<2, 3, 6>(random);
    check_sizes<3, 1, 3>(random);
    check_sizes<3, 3, 3>(random);
    check_sizes<6, 6, 1>(random);
    check_sizes<6, 6, 6>(random);
    check_sizes<7, 5, 9>(random);
    check_sizes<12, 12, 12>(random);
  }
}

TEST_CASE("a matrix of three by three multiplies a vector, and vectors each other, with the bits of Eigen") {
  random_bits random(2);
  for (int trial = 0; trial != 1000; ++trial) {
    const mat3 m = random_matrix<mat3>(random);
    const vec3 v = random_matrix<vec3>(random), w = random_matrix<vec3>(random);
    const vec3 product = m * v;
    for (int i = 0; i != 3; ++i) CHECK(product[i] == (m(i, 0) * v[0] + m(i, 1) * v[1]) + m(i, 2) * v[2]);
    CHECK(dot(v, w) == v.dot(w));
    CHECK(near(cross(v, w), v.cross(w), 0.0));
    CHECK(norm(v) == v.norm());
    CHECK(near(normalized(v), v.normalized(), 0.0));
  }
  CHECK(normalized(vec3(0.0, 0.0, 0.0)) == vec3(0.0, 0.0, 0.0));
}

template <int N>
void check_inverse(random_bits& random) {
  using square = matrix<N, N>;
  square m = random_matrix<square>(random);
  change_diagonal(m, 1.0, 5.0);
  CHECK(near(square(m * inverse(m)), identity<square>(), 1e-10));
  // Rows out of order need pivots.
  square turned;
  for (int r = 0; r != N; ++r) set_row(turned, r, row_of(m, (r + 1) % N));
  CHECK(near(square(turned * inverse(turned)), identity<square>(), 1e-10));
  const square h = m * transposed(m);
  const matrix<N> b = random_matrix<matrix<N>>(random);
  const auto x = solve_semidefinite<N>(h, b);
  REQUIRE(x);
  CHECK(near(matrix<N>(h * *x), b, 1e-7));
}

TEST_CASE("inverses and solutions of small systems") {
  random_bits random(3);
  for (int trial = 0; trial != 20; ++trial) {
    check_inverse<2>(random);
    check_inverse<3>(random);
    check_inverse<6>(random);
    check_inverse<7>(random);
    check_inverse<12>(random);
    const mat3 m = random_matrix<mat3>(random);
    CHECK(std::abs(determinant(m) - m.determinant()) < 1e-13);
  }
  CHECK_FALSE(all_finite(inverse(zeros<mat6>())));
  CHECK_FALSE(all_finite(inverse(zeros<mat3>())));
}

TEST_CASE("a system that leaves a direction free has a solution that agrees with the rest") {
  const vec3 known(1.0, 2.0, -1.0);
  const mat3 h = outer_product(known, known);  // of rank 1
  const vec3 b = 3.0 * known;
  const auto x = solve_semidefinite<3>(h, b);
  REQUIRE(x);
  CHECK(std::abs(dot(known, *x) - 3.0) < 1e-6);
  CHECK_FALSE(solve_semidefinite<3>(zeros<mat3>(), b));
}

TEST_CASE("entries that are no numbers are not overlooked") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int at = 0; at != 3; ++at) {
    vec3 v(1.0, -5.0, 2.0);
    CHECK(all_finite(v));
    CHECK(largest_magnitude(v) == 5.0);
    v[at] = nan;
    CHECK_FALSE(all_finite(v));
    CHECK(std::isnan(largest_magnitude(v)));
    CHECK_FALSE(all_at_most(v, vec3(9.0, 9.0, 9.0)));
    v[at] = std::numeric_limits<double>::infinity();
    CHECK_FALSE(all_finite(v));
  }
}

}  // namespace orbis::small_matrix_test
