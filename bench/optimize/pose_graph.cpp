// SPDX-License-Identifier: BSD-3-Clause
//
// Pose graphs: whole solves beside Ceres, Gauss-Newton beside the same with CHOLMOD, and the sparse
// factorisation alone beside CHOLMOD's and Eigen's. Everyone starts from the same poses and must end
// with the same cost.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <benchmark/benchmark.h>

#ifdef ORBIS_BENCH_WITH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif
#ifdef ORBIS_BENCH_WITH_CERES
#include <ceres/ceres.h>
#endif

#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/io/g2o.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

#include "../../examples/pose_graph/chordal.hpp"
#include "support/synthetic/pose_graph.hpp"

namespace orbis::bench {
namespace {

using namespace orbis::optimize;
using poses = std::vector<se3>;
using sparse = Eigen::SparseMatrix<double>;

constexpr double relative_tolerance = 1e-6;

/// A graph, and blocks of the size and at the places of its normal equations.
struct problem {
  io::g2o_graph graph;
  double best = 0.0;  ///< the cost at its minimum
  std::vector<optimize::detail::block_place> places;
  std::vector<mat6> diagonal, off_diagonal;
};

/// The normal equations at `vertices`, the first of which is held, as blocks; returns the cost.
double normal_equations(problem& p, const poses& vertices, Eigen::VectorXd& gradient) {
  const std::size_t unknowns = vertices.size() - 1;
  p.places.clear();
  p.off_diagonal.clear();
  p.diagonal.assign(unknowns, mat6::Zero());
  gradient.setZero(static_cast<Eigen::Index>(6 * unknowns));
  double cost = 0.0;
  for (const io::g2o_edge& e : p.graph.edges) {
    mat6 by_from, by_to;
    const vec6 r = quaternion_between::linearize(vertices[e.from], vertices[e.to], e.measurement, by_from, by_to);
    const vec6 pull = e.information * r;
    cost += 0.5 * r.dot(pull);
    const auto add = [&](std::uint32_t v, const mat6& by) {
      if (v == 0) return;
      p.diagonal[v - 1] += by.transpose() * (e.information * by);
      gradient.segment<6>(6 * (static_cast<Eigen::Index>(v) - 1)) += by.transpose() * pull;
    };
    add(e.from, by_from);
    add(e.to, by_to);
    if (e.from == 0 || e.to == 0) continue;
    p.places.push_back({e.from - 1, e.to - 1});
    p.off_diagonal.push_back(by_from.transpose() * (e.information * by_to));
  }
  return cost;
}

/// The lower triangle of the blocks as a sparse matrix.
sparse assembled(const problem& p) {
  std::vector<Eigen::Triplet<double, int>> entries;
  entries.reserve(36 * (p.diagonal.size() + p.places.size()));
  for (int i = 0; i != static_cast<int>(p.diagonal.size()); ++i)
    for (int r = 0; r != 6; ++r)
      for (int c = 0; c <= r; ++c)
        entries.emplace_back(6 * i + r, 6 * i + c, p.diagonal[static_cast<std::size_t>(i)](r, c));
  for (std::size_t k = 0; k != p.places.size(); ++k) {
    const int row = 6 * static_cast<int>(p.places[k].row), column = 6 * static_cast<int>(p.places[k].column);
    for (int r = 0; r != 6; ++r)
      for (int c = 0; c != 6; ++c) {
        const double value = p.off_diagonal[k](r, c);
        if (row > column)
          entries.emplace_back(row + r, column + c, value);
        else
          entries.emplace_back(column + c, row + r, value);
      }
  }
  const auto n = static_cast<Eigen::Index>(6 * p.diagonal.size());
  sparse m(n, n);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

template <class Damping>
pose_graph_summary solve(const problem& p, poses& vertices, unsigned threads = 1) {
  vertices = p.graph.vertices;
  pose_graph_solver<se3, trivial, Damping> solver;
  return solver.solve(par.with(threads), std::span<se3>{vertices}, p.graph.edges,
                      {.relative_tolerance = relative_tolerance});
}

#ifdef ORBIS_BENCH_WITH_CHOLMOD
/// Gauss-Newton as a user of CHOLMOD would write it: structure once, numbers every time.
double solve_with_cholmod(const problem& given, poses& vertices) {
  problem p{given.graph, 0.0, {}, {}, {}};
  vertices = p.graph.vertices;
  Eigen::CholmodSupernodalLLT<sparse, Eigen::Lower> cholesky;
  Eigen::VectorXd gradient;
  double cost = normal_equations(p, vertices, gradient);
  for (int k = 0; k != 100; ++k) {
    const sparse h = assembled(p);
    if (k == 0) cholesky.analyzePattern(h);
    cholesky.factorize(h);
    const Eigen::VectorXd step = cholesky.solve(-gradient);
    for (std::size_t v = 1; v != vertices.size(); ++v)
      vertices[v] = vertices[v] * se3::exp(step.segment<6>(6 * (static_cast<Eigen::Index>(v) - 1)));
    const double before = std::exchange(cost, normal_equations(p, vertices, gradient));
    if (std::abs(before - cost) <= relative_tolerance * before) break;
  }
  return cost;
}
#endif

#ifdef ORBIS_BENCH_WITH_CERES
/// x y z qx qy qz qw, moved by right multiplication. Derivatives by the six numbers of a step stand in
/// the first six columns, so that nothing is lost on the way through seven.
struct pose_manifold final : ceres::Manifold {
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  static se3 pose(const double* x) { return {so3(so3::quaternion(x[6], x[3], x[4], x[5])), vec3(x[0], x[1], x[2])}; }
  static void store(const se3& p, double* x) {
    const auto& q = p.rotation().unit_quaternion();
    const double values[] = {p.translation().x(), p.translation().y(), p.translation().z(), q.x(), q.y(), q.z(), q.w()};
    std::copy(values, values + 7, x);
  }
  bool Plus(const double* x, const double* delta, double* result) const override {
    store(pose(x) * se3::exp(vec6(Eigen::Map<const vec6>(delta))), result);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

struct between_cost final : ceres::SizedCostFunction<6, 7, 7> {
  se3 measurement;
  mat6 root;  ///< of the information
  between_cost(const io::g2o_edge& e) : measurement{e.measurement}, root{mat6(e.information.llt().matrixU())} {}
  bool Evaluate(double const* const* x, double* r, double** jacobians) const override {
    mat6 by_from, by_to;
    const vec6 residual = quaternion_between::linearize(pose_manifold::pose(x[0]), pose_manifold::pose(x[1]),
                                                        measurement, by_from, by_to);
    Eigen::Map<vec6>{r} = root * residual;
    const auto store = [&](double* to, const mat6& by) {
      Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j{to};
      j.leftCols<6>() = root * by;
      j.col(6).setZero();
    };
    if (jacobians != nullptr && jacobians[0] != nullptr) store(jacobians[0], by_from);
    if (jacobians != nullptr && jacobians[1] != nullptr) store(jacobians[1], by_to);
    return true;
  }
};

double solve_with_ceres(const problem& p, poses& vertices) {
  std::vector<double> x(7 * p.graph.vertices.size());
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  pose_manifold manifold;
  ceres::Problem ceres_problem{ownership};
  for (std::size_t v = 0; v != p.graph.vertices.size(); ++v) {
    pose_manifold::store(p.graph.vertices[v], &x[7 * v]);
    ceres_problem.AddParameterBlock(&x[7 * v], 7, &manifold);
  }
  ceres_problem.SetParameterBlockConstant(x.data());
  for (const io::g2o_edge& e : p.graph.edges)
    ceres_problem.AddResidualBlock(new between_cost{e}, nullptr, &x[std::size_t{7} * e.from],
                                   &x[std::size_t{7} * e.to]);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.max_num_iterations = 200;
  options.function_tolerance = relative_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  vertices.resize(p.graph.vertices.size());
  for (std::size_t v = 0; v != vertices.size(); ++v) vertices[v] = pose_manifold::pose(&x[7 * v]);
  return summary.final_cost;
}
#endif

/// Made when its first row runs, from a chordal start where it is generated.
problem& named(const std::string& name) {
  static std::map<std::string, problem> made;
  if (const auto found = made.find(name); found != made.end()) return found->second;
  problem& p = made[name];
  if (name == "sphere.g2o") {
    p.graph = io::read_g2o(std::string{ORBIS_DATA_DIR} + "/pose_graph/sphere.g2o").value();
  } else {
    test::synthetic_graph_options options{.translation_sigma = 0.1, .rotation_sigma = 0.05};
    if (name == "torus_5000") options.shape = test::graph_shape::torus, options.turns = 100;
    if (name == "grid_2744")
      options.shape = test::graph_shape::grid, options.poses_per_turn = 14, options.closure_probability = 0.3;
    p.graph = test::make_pose_graph(options).measured;
    if (is_failure(examples::start_chordally(std::span{p.graph.vertices}, p.graph.edges).status)) std::abort();
  }
  poses vertices;
  p.best = solve<dogleg>(p, vertices).final_cost;
  Eigen::VectorXd gradient;
  normal_equations(p, vertices, gradient);
  return p;
}

void add(const std::string& group, const std::string& graph, const std::string& who,
         std::function<double(problem&)> cost) {
  benchmark::RegisterBenchmark((group + "/" + graph + "/" + who).c_str(),
                               [=](benchmark::State& state) {
                                 problem& p = named(graph);
                                 double reached = 0.0;
                                 for (auto _ : state) benchmark::DoNotOptimize(reached = cost(p));
                                 if (!(std::abs(reached - p.best) <= 1e-4 * p.best))
                                   state.SkipWithError("another cost");
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

/// The factorisation of the normal equations at the minimum, structure known. `Kept` lives on.
void add_factor(const std::string& graph, const std::string& who,
                std::function<std::function<bool()>(problem&)> prepare) {
  benchmark::RegisterBenchmark(("pose_graph_factor/" + graph + "/" + who).c_str(),
                               [=](benchmark::State& state) {
                                 const auto factor = prepare(named(graph));
                                 bool definite = true;
                                 for (auto _ : state) definite = factor() && definite;
                                 if (!definite) state.SkipWithError("not positive definite");
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

template <class Cholesky>
std::function<bool()> eigen_factor(problem& p) {
  auto h = std::make_shared<sparse>(assembled(p));
  auto cholesky = std::make_shared<Cholesky>();
  cholesky->analyzePattern(*h);
  return [=] {
    cholesky->factorize(*h);
    return cholesky->info() == Eigen::Success;
  };
}

[[maybe_unused]] const bool registered = [] {
  std::vector<std::string> graphs{"sphere_2500", "torus_5000", "grid_2744"};
  if (std::FILE* file = std::fopen((std::string{ORBIS_DATA_DIR} + "/pose_graph/sphere.g2o").c_str(), "rb")) {
    std::fclose(file);
    graphs.insert(graphs.begin(), "sphere.g2o");
  }
  for (const std::string& g : graphs) {
    const auto ours = [](auto damping, unsigned threads) {
      return [=](problem& p) {
        poses vertices;
        return solve<decltype(damping)>(p, vertices, threads).final_cost;
      };
    };
    add("pose_graph", g, "orbis", ours(dogleg{}, 1));
    add("pose_graph", g, "orbis_par2", ours(dogleg{}, 2));
    add("pose_graph", g, "orbis_levenberg_marquardt", ours(levenberg_marquardt{}, 1));
#ifdef ORBIS_BENCH_WITH_CERES
    add("pose_graph", g, "ceres", [](problem& p) {
      poses vertices;
      return solve_with_ceres(p, vertices);
    });
#endif
#ifdef ORBIS_BENCH_WITH_CHOLMOD
    add("pose_graph", g, "gauss_newton_cholmod", [](problem& p) {
      poses vertices;
      return solve_with_cholmod(p, vertices);
    });
#endif
    for (const auto& [who, level] :
         {std::pair{"orbis", simd::level::avx512}, std::pair{"orbis_avx2", simd::level::avx2},
          std::pair{"orbis_portable", simd::level::portable}})
      add_factor(g, who, [level = level](problem& p) -> std::function<bool()> {
        const simd::level_limit limit{level};  // it chooses its kernels when it is made
        auto cholesky = std::make_shared<optimize::detail::block_cholesky<6>>();
        cholesky->analyze(p.diagonal.size(), p.places);
        return [&p, cholesky] { return cholesky->factor(p.diagonal, p.off_diagonal); };
      });
    add_factor(g, "eigen", eigen_factor<Eigen::SimplicialLLT<sparse, Eigen::Lower>>);
#ifdef ORBIS_BENCH_WITH_CHOLMOD
    add_factor(g, "cholmod", eigen_factor<Eigen::CholmodSupernodalLLT<sparse, Eigen::Lower>>);
#endif
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
