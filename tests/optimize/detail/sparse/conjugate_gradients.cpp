// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include <orbis/optimize/detail/sparse/conjugate_gradients.hpp>

#include "optimize/block_matrices.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::detail::block_conjugate_gradients;

TEST_CASE("Conjugate gradients solve to the tolerance that was asked for") {
  random_bits random{371};
  const test::places places = test::grid_places(8, 6);
  const test::block_matrix<6> m{random, 48, places, 0.5};
  const Eigen::MatrixXd dense = m.dense(places);
  Eigen::VectorXd b(dense.rows());
  for (Eigen::Index i = 0; i != b.size(); ++i) b[i] = random.normal();
  int last = 0;
  for (const double tolerance : {1e-2, 1e-6, 1e-10}) {
    block_conjugate_gradients<6> solver{tolerance, 1000};
    solver.analyze(48, places);
    REQUIRE(solver.factor(m.diagonal, m.off_diagonal));
    Eigen::VectorXd x = b;
    solver.solve({x.data(), static_cast<std::size_t>(x.size())});
    CHECK((dense * x - b).norm() <= 1.01 * tolerance * b.norm());
    CHECK(solver.iterations() > last);
    last = solver.iterations();
  }
  CHECK(last < 288);  // fewer than the unknowns: the preconditioner helps
}

TEST_CASE("Conjugate gradients end at once where the diagonal is all there is") {
  random_bits random{372};
  const test::block_matrix<3> m{random, 5, {{1, 0}}, 1.0};
  block_conjugate_gradients<3> solver{1e-12, 50};
  solver.analyze(5, {});
  REQUIRE(solver.factor(m.diagonal, {}));
  std::vector<double> x(15, 1.0);
  solver.solve(x);
  CHECK(solver.iterations() == 1);
  for (std::size_t i = 0; i != 5; ++i) {
    const Eigen::Map<const vec3> part(x.data() + 3 * i);
    CHECK((m.diagonal[i] * part - vec3::Ones()).norm() < 1e-12);
  }
  solver.solve(x = std::vector<double>(15, 0.0));
  CHECK(x == std::vector<double>(15, 0.0));
}

TEST_CASE("Conjugate gradients name a diagonal block that is not positive definite, and stop where the matrix is not") {
  const std::vector<mat3> diagonal{mat3::Identity(), -mat3::Identity(), mat3::Identity()};
  block_conjugate_gradients<3> solver{1e-12, 50};
  solver.analyze(3, {});
  CHECK_FALSE(solver.factor(diagonal, {}));
  CHECK(solver.failed_block() == 1);

  // Definite blocks on the diagonal of an indefinite matrix: the solution stays finite.
  const std::vector<mat3> ones{mat3::Identity(), mat3::Identity()}, off{3.0 * mat3::Identity()};
  const test::places places{{1, 0}};
  solver.analyze(2, places);
  REQUIRE(solver.factor(ones, off));
  std::vector<double> x{1, -1, 2, 3, -2, 1};
  solver.solve(x);
  for (const double value : x) CHECK(std::isfinite(value));
}

TEST_CASE("Conjugate gradients allocate nothing for a second right-hand side") {
  if (!test::counts_allocations()) return;
  random_bits random{373};
  const test::places places = test::grid_places(4, 4);
  const test::block_matrix<6> m{random, 16, places, 0.5};
  block_conjugate_gradients<6> solver{1e-8, 200};
  solver.analyze(16, places);
  std::vector<double> x(96, 1.0);
  REQUIRE(solver.factor(m.diagonal, m.off_diagonal));
  solver.solve(x);
  const std::size_t before = test::allocations();
  REQUIRE(solver.factor(m.diagonal, m.off_diagonal));
  solver.solve(x);
  CHECK(test::allocations() == before);
}
