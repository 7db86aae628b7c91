// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/sparse/reduced_solvers.hpp>
#include <orbis/optimize/solver_policies.hpp>

#include "support/catch.hpp"

using namespace orbis;
using optimize::block_place;

namespace {

template <int C>
struct block_system {
  std::vector<matrix<C, C>> diagonal, off_diagonal;
  std::vector<block_place> places;
  Eigen::MatrixXd whole;

  /// Each block row has blocks with the `band` before it.
  block_system(std::uint32_t size, std::uint32_t band) {
    random_bits random(size + C);
    const auto n = static_cast<Eigen::Index>(C * size);
    whole = Eigen::MatrixXd::Zero(n, n);
    for (std::uint32_t i = 0; i != size; ++i)
      for (std::uint32_t j = i >= band ? i - band : 0; j < i; ++j) {
        matrix<C, C> b;
        for (Eigen::Index e = 0; e != b.size(); ++e) b.data()[e] = random.normal();
        places.push_back({i, j});
        off_diagonal.push_back(b);
        whole.block<C, C>(C * static_cast<Eigen::Index>(i), C * static_cast<Eigen::Index>(j)) = b;
        whole.block<C, C>(C * static_cast<Eigen::Index>(j), C * static_cast<Eigen::Index>(i)) = b.transpose();
      }
    for (std::uint32_t i = 0; i != size; ++i) {
      diagonal.push_back(matrix<C, C>::Identity() * (3.0 * C * (band + 1)));
      whole.block<C, C>(C * static_cast<Eigen::Index>(i), C * static_cast<Eigen::Index>(i)) = diagonal.back();
    }
  }
};

template <int C, class Family>
void check(const Family& family, std::uint32_t size, std::uint32_t band, double tolerance) {
  block_system<C> system(size, band);
  typename Family::template solver<C> solver{family};
  solver.analyze(size, system.places);
  REQUIRE(solver.factor(system.diagonal, system.off_diagonal));
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(C * size, -1.0, 1.0);
  Eigen::VectorXd x = b;
  solver.solve({x.data(), static_cast<std::size_t>(x.size())});
  CHECK((system.whole * x - b).norm() <= tolerance * b.norm());
  system.diagonal[size / 2].setZero();
  CHECK_FALSE(solver.factor(system.diagonal, system.off_diagonal));
}

}  // namespace

TEST_CASE("Every solver of reduced systems solves them, and refuses what is not positive definite") {
  check<6>(optimize::dense_reduced_solver{}, 20, 19, 1e-12);
  check<6>(optimize::sparse_reduced_solver{}, 40, 3, 1e-12);
  check<6>(optimize::iterative_reduced_solver{.relative_tolerance = 1e-10}, 40, 3, 1e-9);
  check<9>(optimize::dense_reduced_solver{}, 7, 6, 1e-12);
  check<9>(optimize::sparse_reduced_solver{}, 30, 2, 1e-12);
  check<12>(optimize::dense_reduced_solver{}, 9, 4, 1e-12);
  check<12>(optimize::sparse_reduced_solver{}, 30, 2, 1e-12);
}

TEST_CASE("The automatic solver goes by size and fill") {
  using kind = optimize::automatic_reduced_solver::kind;
  const optimize::automatic_reduced_solver family{.dense_limit = 10, .fill_limit = 300};
  const auto chosen = [&](std::uint32_t size, std::uint32_t band) {
    const block_system<6> system(size, band);
    optimize::automatic_reduced_solver::solver<6> solver{family};
    solver.analyze(size, system.places);
    REQUIRE(solver.factor(system.diagonal, system.off_diagonal));
    Eigen::VectorXd x = Eigen::VectorXd::Ones(6 * size);
    solver.solve({x.data(), static_cast<std::size_t>(x.size())});
    CHECK((system.whole * x - Eigen::VectorXd::Ones(6 * size)).norm() < 1e-4);
    CHECK((solver.iterations() > 0) == (solver.chosen() == kind::iterative));
    return solver.chosen();
  };
  CHECK(chosen(10, 9) == kind::dense);
  CHECK(chosen(40, 2) == kind::sparse);
  CHECK(chosen(40, 39) == kind::iterative);
  check<6>(family, 8, 2, 1e-12);
}
