// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/sparse/reduced_solver.hpp>

#include "support/catch.hpp"

using namespace orbis;
using optimize::detail::block_place;
using optimize::detail::reduced_solver;

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

template <int C>
void check(const optimize::reduced_solver_options& options, std::uint32_t size, std::uint32_t band, double tolerance) {
  block_system<C> system(size, band);
  reduced_solver<C> solver{options};
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

TEST_CASE("Every way to solve reduced systems does, and refuses what is not positive definite") {
  const optimize::reduced_solver_options dense{.dense_limit = 1000}, sparse{.dense_limit = 0};
  check<6>(dense, 20, 19, 1e-12);
  check<6>(sparse, 40, 3, 1e-12);
  check<6>({.dense_limit = 0, .fill_limit = 0, .relative_tolerance = 1e-10}, 40, 3, 1e-9);
  check<9>(dense, 7, 6, 1e-12);
  check<9>(sparse, 30, 2, 1e-12);
  check<12>(dense, 9, 4, 1e-12);
  check<12>(sparse, 30, 2, 1e-12);
}

TEST_CASE("The solver of reduced systems goes by size and fill") {
  using kind = reduced_solver<6>::kind;
  const optimize::reduced_solver_options options{.dense_limit = 10, .fill_limit = 300};
  const auto chosen = [&](std::uint32_t size, std::uint32_t band) {
    const block_system<6> system(size, band);
    reduced_solver<6> solver{options};
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
  check<6>(options, 8, 2, 1e-12);
}
