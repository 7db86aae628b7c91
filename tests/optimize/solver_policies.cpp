// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include <orbis/optimize/solver_policies.hpp>

#include "support/catch.hpp"

using namespace orbis::optimize;

static_assert(damping_policy<gauss_newton> && damping_policy<levenberg_marquardt> && damping_policy<dogleg>);

namespace {

/// Least squares with as many residuals as a function makes, solved densely.
template <class Residuals>
struct dense_problem {
  Residuals residuals;  ///< (x, r, J)
  Eigen::VectorXd x, tried, r, g, d;
  Eigen::MatrixXd j, h;
  Eigen::LLT<Eigen::MatrixXd> llt;
  double now = 0.0;
  int factorizations = 0;

  dense_problem(Residuals f, const Eigen::VectorXd& start) : residuals{f}, x{start}, tried{start} { linearize(); }
  void linearize() {
    residuals(x, r, j);
    now = 0.5 * r.squaredNorm();
    g = j.transpose() * r;
    h = j.transpose() * j;
    d = h.diagonal();
  }
  double cost() { return now; }
  const Eigen::VectorXd& gradient() { return g; }
  const Eigen::VectorXd& diagonal() { return d; }
  double curvature(const Eigen::VectorXd& s) { return s.dot(h * s); }
  bool factor(const Eigen::VectorXd& damping) {
    ++factorizations;
    Eigen::MatrixXd m = h;
    if (damping.size() != 0) m.diagonal() += damping;
    llt.compute(m);
    return llt.info() == Eigen::Success && llt.matrixLLT().diagonal().minCoeff() > 1e-12;
  }
  void newton_step(Eigen::VectorXd& out) { out = llt.solve(-g); }
  double try_step(const Eigen::VectorXd& s) {
    tried = x + s;
    Eigen::VectorXd there;
    Eigen::MatrixXd unused;
    residuals(tried, there, unused);
    return 0.5 * there.squaredNorm();
  }
};

void rosenbrock(const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
  r.resize(2);
  j.resize(2, 2);
  r << 10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0];
  j << -20.0 * x[0], 10.0, -1.0, 0.0;
}
/// Singular at its minimum 0, where Gauss-Newton converges only linearly: Powell's function.
void powell(const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
  r.resize(4);
  j.setZero(4, 4);
  const double a = x[1] - 2.0 * x[2], b = x[0] - x[3];
  r << x[0] + 10.0 * x[1], std::sqrt(5.0) * (x[2] - x[3]), a * a, std::sqrt(10.0) * b * b;
  j << 1, 10, 0, 0, 0, 0, std::sqrt(5.0), -std::sqrt(5.0), 0, 2 * a, -4 * a, 0, 2 * std::sqrt(10.0) * b, 0, 0,
      -2 * std::sqrt(10.0) * b;
}
/// Far from 0 the model is worth nothing: Gauss-Newton runs away beyond |x| = 1.39.
void arctangent(const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
  r.resize(1);
  j.resize(1, 1);
  r << std::atan(x[0]);
  j << 1.0 / (1.0 + x[0] * x[0]);
}

using function = void (*)(const Eigen::VectorXd&, Eigen::VectorXd&, Eigen::MatrixXd&);

/// Steps to the end; the outcome is that of the last. The cost never rises where `monotone`.
template <class Damping>
step_outcome minimize(const Damping& damping, dense_problem<function>& p, int steps, bool monotone) {
  typename Damping::state state;
  step_workspace workspace;
  for (int k = 0; k != steps; ++k) {
    const step_outcome outcome = damping.advance(state, p, workspace);
    if (outcome != step_outcome::taken) return outcome;
    const double before = p.now;
    p.x = p.tried;
    p.linearize();
    if (monotone) CHECK(p.now < before);
  }
  return step_outcome::taken;
}

Eigen::VectorXd at(std::initializer_list<double> values) {
  Eigen::VectorXd x(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), x.begin());
  return x;
}

}  // namespace

TEST_CASE("Every policy finds the minimum of Rosenbrock's and Powell's functions") {
  const auto check = [](const auto& damping, bool monotone) {
    dense_problem<function> valley{rosenbrock, at({-1.2, 1.0})};
    minimize(damping, valley, 100, monotone);
    CHECK((valley.x - at({1.0, 1.0})).norm() < 1e-6);
    dense_problem<function> flat{powell, at({3.0, -1.0, 0.0, 1.0})};
    minimize(damping, flat, 60, monotone);
    CHECK(flat.now < 1e-12);
  };
  check(gauss_newton{}, false);
  check(levenberg_marquardt{}, true);
  check(dogleg{}, true);
  check(dogleg{.initial_radius = 0.1}, true);
}

TEST_CASE("Damped policies get back from where Gauss-Newton runs away") {
  for (const double start : {2.0, -8.0}) {
    dense_problem<function> wild{arctangent, at({start})};
    minimize(gauss_newton{}, wild, 5, false);
    CHECK(std::abs(wild.x[0]) > 100.0);
    dense_problem<function> damped{arctangent, at({start})};
    minimize(levenberg_marquardt{}, damped, 60, true);
    CHECK(std::abs(damped.x[0]) < 1e-6);
    dense_problem<function> legged{arctangent, at({start})};
    minimize(dogleg{}, legged, 60, true);
    CHECK(std::abs(legged.x[0]) < 1e-6);
  }
}

TEST_CASE("At a minimum every policy says so") {
  const auto check = [](const auto& damping) {
    dense_problem<function> there{rosenbrock, at({1.0, 1.0})};
    typename std::remove_cvref_t<decltype(damping)>::state state;
    step_workspace workspace;
    CHECK(damping.advance(state, there, workspace) == step_outcome::stationary);
  };
  check(gauss_newton{});
  check(levenberg_marquardt{});
  check(dogleg{});
}

TEST_CASE("A system without a solution, and costs that are no numbers") {
  // The second unknown is in no residual.
  const function half = [](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
    r.resize(1);
    j.setZero(1, 2);
    r << x[0] - 3.0;
    j(0, 0) = 1.0;
  };
  dense_problem<function> loose{half, at({0.0, 7.0})};
  gauss_newton::state none;
  step_workspace workspace;
  CHECK(gauss_newton{}.advance(none, loose, workspace) == step_outcome::singular);
  minimize(levenberg_marquardt{}, loose, 30, true);
  CHECK(loose.x[0] == Approx(3.0));
  CHECK(loose.x[1] == 7.0);

  // Beyond 1 there is nothing: steps end before it, or are given up.
  const function cliff = [](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd& j) {
    r.resize(1);
    j.setConstant(1, 1, 1.0);
    r << (x[0] > 1.0 ? std::numeric_limits<double>::quiet_NaN() : x[0] - 5.0);
  };
  dense_problem<function> edge{cliff, at({0.0})};
  CHECK(minimize(gauss_newton{}, edge, 5, true) == step_outcome::exhausted);
  CHECK(edge.x[0] == 0.0);
  CHECK(minimize(levenberg_marquardt{}, edge, 500, true) == step_outcome::exhausted);
  CHECK(edge.x[0] <= 1.0);
  dense_problem<function> again{cliff, at({0.0})};
  CHECK(minimize(dogleg{}, again, 500, true) == step_outcome::exhausted);
  CHECK(again.x[0] > 0.5);
}

TEST_CASE("Dogleg steps that were too bold cost no factorisation") {
  dense_problem<function> p{arctangent, at({5.0})};
  dogleg::state state;
  step_workspace workspace;
  REQUIRE(dogleg{}.advance(state, p, workspace) == step_outcome::taken);
  CHECK(p.factorizations == 1);
  CHECK(std::abs(p.tried[0]) < 5.0);
}
