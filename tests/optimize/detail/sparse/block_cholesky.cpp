// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>

#include <Eigen/Cholesky>

#include <orbis/optimize/detail/sparse/block_cholesky.hpp>

#include "optimize/block_matrices.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize::detail;

namespace {

std::vector<double> random_vector_of(random_bits& random, std::size_t size) {
  std::vector<double> x(size);
  for (double& value : x) value = random.normal();
  return x;
}

template <int B>
void check_solution(random_bits& random, std::uint32_t size, const test::places& places) {
  const test::block_matrix<B> m{random, size, places, 0.1};
  const Eigen::MatrixXd dense = m.dense(places);
  const std::vector<double> right = random_vector_of(random, B * std::size_t{size});
  const std::vector<double> damping(right.size(), 0.25);
  const Eigen::Map<const Eigen::VectorXd> b{right.data(), dense.rows()};
  std::vector<double> first;
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    block_cholesky<B> cholesky;
    cholesky.analyze(size, places);
    for (int repeat = 0; repeat != 2; ++repeat) {  // the second is not disturbed by the first
      REQUIRE(cholesky.factor(m.diagonal, m.off_diagonal));
      std::vector<double> x = right;
      cholesky.solve(x);
      const Eigen::Map<const Eigen::VectorXd> solved{x.data(), dense.rows()};
      CHECK((dense * solved - b).norm() <= 1e-11 * (1.0 + b.norm()));
      if (first.empty()) first = x;
      CHECK(std::memcmp(first.data(), x.data(), x.size() * sizeof(double)) == 0);
      REQUIRE(cholesky.factor(m.diagonal, m.off_diagonal, damping));
      x = right;
      cholesky.solve(x);
      const Eigen::VectorXd expected =
          (dense + 0.25 * Eigen::MatrixXd::Identity(dense.rows(), dense.rows())).llt().solve(b);
      CHECK((solved - expected).norm() <= 1e-10 * (1.0 + expected.norm()));
    }
  }
}

}  // namespace

TEST_CASE("The solution is that of the dense matrix, with the same bits for every instruction set") {
  random_bits random{351};
  check_solution<6>(random, 1, {});
  check_solution<6>(random, 3, {});
  check_solution<6>(random, 144, test::grid_places(12, 12));
  check_solution<3>(random, 144, test::grid_places(12, 12));
  check_solution<14>(random, 36, test::grid_places(6, 6));
  for (int trial = 0; trial != 20; ++trial) {
    const std::uint32_t size = 2 + random.below(40);
    const auto places = test::random_places(random, size, random.below(std::min(4 * size, size * (size - 1) / 2)));
    check_solution<1>(random, size, places);
    check_solution<2>(random, size, places);
    check_solution<6>(random, size, places);
    check_solution<7>(random, size, places);
  }
}

TEST_CASE("The solution does not depend on the names of the blocks beyond rounding") {
  random_bits random{352};
  const auto places = test::grid_places(9, 11);
  const test::block_matrix<6> m{random, 99, places, 0.1};
  const std::vector<double> right = random_vector_of(random, 594);
  std::vector<std::uint32_t> name(99);
  std::iota(name.begin(), name.end(), 0U);
  for (std::uint32_t i = 99; i > 1; --i) std::swap(name[i - 1], name[random.below(i)]);
  test::places renamed;
  auto diagonal = m.diagonal;
  std::vector<double> moved(594);
  for (std::size_t i = 0; i != 99; ++i) {
    diagonal[name[i]] = m.diagonal[i];
    std::copy_n(&right[6 * i], 6, &moved[6 * name[i]]);
  }
  for (const block_place& p : places) renamed.push_back({name[p.row], name[p.column]});
  block_cholesky<6> one, other;
  one.analyze(99, places);
  other.analyze(99, renamed);
  REQUIRE(one.factor(m.diagonal, m.off_diagonal));
  REQUIRE(other.factor(diagonal, m.off_diagonal));
  std::vector<double> x = right;
  one.solve(x);
  other.solve(moved);
  for (std::size_t i = 0; i != 99; ++i)
    for (std::size_t r = 0; r != 6; ++r) CHECK(moved[6 * name[i] + r] == Approx(x[6 * i + r]).margin(1e-9));
}

TEST_CASE("A matrix that is not positive definite is refused, and the block named") {
  random_bits random{353};
  const auto places = test::grid_places(6, 6);
  const test::block_matrix<6> good{random, 36, places, 0.1};
  block_cholesky<6> cholesky;
  cholesky.analyze(36, places);
  for (const double bad :
       {-1e3, -1e-9, 0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    auto diagonal = good.diagonal;
    diagonal[17](3, 3) = bad;
    CHECK_FALSE(cholesky.factor(diagonal, good.off_diagonal));
  }
  auto isolated = good.diagonal;
  isolated.push_back(mat6::Identity());
  isolated.back()(5, 5) = 0.0;
  cholesky.analyze(37, places);
  CHECK_FALSE(cholesky.factor(isolated, good.off_diagonal));
  CHECK(cholesky.failed_block() == 36);
  isolated.back()(5, 5) = 1e-200;  // small, but it is all there is
  CHECK(cholesky.factor(isolated, good.off_diagonal));

  // Singular but for rounding: differences along a chain, which adding a constant does not change.
  test::places chain;
  std::vector<matrix<1, 1>> diagonal(50, matrix<1, 1>(2.0)), off(49, matrix<1, 1>(-1.0));
  for (std::uint32_t i = 1; i != 50; ++i) chain.push_back({i - 1, i});
  diagonal.front()(0, 0) = diagonal.back()(0, 0) = 1.0;
  block_cholesky<1> differences;
  differences.analyze(50, chain);
  CHECK_FALSE(differences.factor(diagonal, off));
  diagonal.front()(0, 0) = 1.001;
  CHECK(differences.factor(diagonal, off));
}

TEST_CASE("Factoring and solving allocate nothing") {
  if (!test::counts_allocations()) return;
  random_bits random{354};
  const auto places = test::grid_places(15, 15);
  const test::block_matrix<6> m{random, 225, places};
  block_cholesky<6> cholesky;
  cholesky.analyze(225, places);
  std::vector<double> x = random_vector_of(random, 1350);
  const std::size_t before = test::allocations();
  const bool definite = cholesky.factor(m.diagonal, m.off_diagonal);
  cholesky.solve(x);
  const std::size_t after = test::allocations();
  CHECK(definite);
  CHECK(after == before);
  const auto one = std::make_unique<int>(1);
  CHECK(test::allocations() > after);  // they are counted
}
