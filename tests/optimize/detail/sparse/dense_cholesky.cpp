// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/sparse/dense_cholesky.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

Eigen::MatrixXd random_definite(Eigen::Index n, std::uint64_t seed) {
  random_bits random(seed);
  Eigen::MatrixXd a(n, n);
  for (Eigen::Index i = 0; i != a.size(); ++i) a.data()[i] = random.normal();
  return a * a.transpose() + Eigen::MatrixXd::Identity(n, n);
}
void fill(optimize::detail::dense_cholesky& c, const Eigen::MatrixXd& a) {
  const auto n = static_cast<std::size_t>(a.rows());
  c.resize(n);
  for (std::size_t j = 0; j != n; ++j)
    for (std::size_t i = j; i != n; ++i) c(i, j) = a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
}

}  // namespace

TEST_CASE("Dense Cholesky solves as Eigen's does, for every size and with the same bits everywhere") {
  for (const Eigen::Index n : {1, 2, 7, 8, 9, 16, 31, 120, 121, 200}) {
    const Eigen::MatrixXd a = random_definite(n, static_cast<std::uint64_t>(n));
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, -1.0, 2.0);
    std::vector<Eigen::VectorXd> solutions;
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      optimize::detail::dense_cholesky c;
      fill(c, a);
      REQUIRE(c.factor());
      solutions.push_back(b);
      c.solve({solutions.back().data(), static_cast<std::size_t>(n)});
    }
    CHECK((a * solutions[0] - b).norm() < 1e-10 * a.norm() * solutions[0].norm());
    CHECK((solutions[0] - a.llt().solve(b)).norm() < 1e-9 * solutions[0].norm());
    for (const Eigen::VectorXd& solution : solutions) CHECK(solution == solutions[0]);
  }
}

TEST_CASE("Dense Cholesky says where a matrix is not positive definite") {
  optimize::detail::dense_cholesky c;
  Eigen::MatrixXd a = random_definite(20, 3);
  a.row(13).setZero();
  a.col(13).setZero();
  a(13, 13) = -1.0;
  fill(c, a);
  CHECK_FALSE(c.factor());
  CHECK(c.failed_row() == 13);
  a(13, 13) = std::numeric_limits<double>::quiet_NaN();
  fill(c, a);
  CHECK_FALSE(c.factor());
  Eigen::MatrixXd singular = Eigen::MatrixXd::Ones(5, 5);
  fill(c, singular);
  CHECK_FALSE(c.factor());
  CHECK(c.failed_row() == 1);
}

TEST_CASE("Dense Cholesky of a size seen before allocates nothing") {
  optimize::detail::dense_cholesky c;
  const Eigen::MatrixXd a = random_definite(60, 4);
  Eigen::VectorXd b = Eigen::VectorXd::Ones(60);
  fill(c, a);
  REQUIRE(c.factor());
  const std::size_t before = test::allocations();
  fill(c, a);
  REQUIRE(c.factor());
  c.solve({b.data(), 60});
  CHECK(test::allocations() == before);
}
