// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment as a careful user of Ceres would write it, for the benchmarks and for the tests that
/// compare costs: analytic Jacobians, everything that depends on a camera alone once per evaluation,
/// parameter blocks without manifolds, in sizes that Ceres has compiled its Schur eliminator for.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include <ceres/ceres.h>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/bal.hpp>

#include "support/synthetic/bundle.hpp"

namespace orbis::bench::with_ceres {

struct settings {
  ceres::LinearSolverType solver = ceres::DENSE_SCHUR;
  ceres::DenseLinearAlgebraLibraryType dense = ceres::EIGEN;
  int max_iterations = 100;
  double function_tolerance = 1e-6;
  double gradient_tolerance = 1e-10;
  double parameter_tolerance = 1e-8;
  double huber = 0.0;  ///< width; 0 is without
  int threads = 1;
};

struct outcome {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;  ///< steps tried
};

inline outcome solve(ceres::Problem& problem, const settings& s, std::span<double* const> points,
                     std::span<double* const> cameras) {
  ceres::Solver::Options options;
  options.linear_solver_type = s.solver;
  options.dense_linear_algebra_library_type = s.dense;
  options.preconditioner_type = ceres::SCHUR_JACOBI;  // of the iterative solver
  options.max_num_iterations = s.max_iterations;
  options.function_tolerance = s.function_tolerance;
  options.gradient_tolerance = s.gradient_tolerance;
  options.parameter_tolerance = s.parameter_tolerance;
  options.num_threads = s.threads;
  options.logging_type = ceres::SILENT;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* point : points) options.linear_solver_ordering->AddElementToGroup(point, 0);
  for (double* camera : cameras) options.linear_solver_ordering->AddElementToGroup(camera, 1);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return {summary.initial_cost, summary.final_cost, static_cast<int>(summary.iterations.size()) - 1};
}

template <int R, int C>
using row_major = Eigen::Matrix<double, R, C, Eigen::RowMajor>;

/// A rotation by its angle-axis vector, with what its derivative needs.
struct rotation_view {
  mat3 matrix, left_jacobian;
  explicit rotation_view(const double* w)
      : matrix{so3::exp(vec3(w[0], w[1], w[2])).rotation_matrix()},
        left_jacobian{so3::left_jacobian(vec3(w[0], w[1], w[2]))} {}
  /// The derivative by the angle-axis vector of something that changes by `j` with `turned = matrix * x`.
  template <class J>
  [[nodiscard]] auto derivative(const J& j, const vec3& turned) const {
    return (-(j * hat<double>(turned)) * left_jacobian).eval();
  }
};

/// Calls `update` whenever Ceres is about to evaluate.
template <class Update>
struct before_evaluation final : ceres::EvaluationCallback {
  Update update;
  explicit before_evaluation(Update u) : update{u} {}
  void PrepareForEvaluation(bool, bool new_point) override {
    if (new_point) update();
  }
};

inline ceres::Problem::Options borrowing(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  options.evaluation_callback = callback;
  return options;
}

/// Nine camera parameters as the format has them.
struct bal_cost final : ceres::SizedCostFunction<2, 9, 3> {
  vec2 pixel;
  const rotation_view* rotation;
  bal_cost(const vec2& seen, const rotation_view* r) : pixel{seen}, rotation{r} {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const double* c = x[0];
    const vec3 turned = rotation->matrix * Eigen::Map<const vec3>(x[1]);
    const vec3 p = turned + Eigen::Map<const vec3>(c + 3);
    const double iz = -1.0 / p.z(), f = c[6], k1 = c[7], k2 = c[8];
    const vec2 d = iz * p.head<2>();
    const double r2 = d.squaredNorm(), distortion = 1.0 + r2 * (k1 + k2 * r2);
    Eigen::Map<vec2>{residual} = f * distortion * d - pixel;
    if (jacobians == nullptr) return true;
    const double radial = 2.0 * f * (k1 + 2.0 * k2 * r2);
    const double xx = f * distortion + radial * d.x() * d.x(), xy = radial * d.x() * d.y(),
                 yy = f * distortion + radial * d.y() * d.y();
    matrix<2, 3> by_p;  // the derivative of d by p is iz (I, d)
    by_p << iz * xx, iz * xy, iz * (xx * d.x() + xy * d.y()), iz * xy, iz * yy, iz * (xy * d.x() + yy * d.y());
    if (jacobians[0] != nullptr) {
      Eigen::Map<row_major<2, 9>> j{jacobians[0]};
      j.leftCols<3>() = rotation->derivative(by_p, turned);
      j.middleCols<3>(3) = by_p;
      j.col(6) = distortion * d;
      j.col(7) = f * r2 * d;
      j.col(8) = f * r2 * r2 * d;
    }
    if (jacobians[1] != nullptr) Eigen::Map<row_major<2, 3>>{jacobians[1]}.noalias() = by_p * rotation->matrix;
    return true;
  }
};

/// Moves cameras and points of `problem` to the best they can be.
inline outcome solve_bal(io::bal_problem& problem, const settings& s) {
  std::vector<rotation_view> views;
  const auto update = [&] {
    views.clear();
    for (const auto& camera : problem.cameras) views.emplace_back(camera.data());
  };
  views.reserve(problem.cameras.size());
  update();
  before_evaluation callback{update};
  ceres::HuberLoss huber{s.huber};
  std::deque<bal_cost> costs;
  std::vector<double*> points, cameras;
  ceres::Problem ceres_problem{borrowing(&callback)};
  for (const io::bal_observation& o : problem.observations) {
    costs.emplace_back(o.pixel, &views[o.camera]);
    ceres_problem.AddResidualBlock(&costs.back(), s.huber > 0.0 ? &huber : nullptr, problem.cameras[o.camera].data(),
                                   problem.points[o.point].data());
  }
  for (vec3& point : problem.points)
    if (ceres_problem.HasParameterBlock(point.data())) points.push_back(point.data());
  for (auto& camera : problem.cameras)
    if (ceres_problem.HasParameterBlock(camera.data())) cameras.push_back(camera.data());
  return solve(ceres_problem, s, points, cameras);
}

/// A keyframe as Ceres sees it: rotation vector and translation of `T_camera_world`.
using keyframe_block = std::array<double, 6>;

/// Whitened stereo reprojection. Rotation and translation are blocks of three each: for residuals of three
/// rows and points of three coordinates Ceres has no eliminator with camera blocks of six, and falls back
/// to one of dynamic sizes.
struct stereo_cost final : ceres::SizedCostFunction<3, 3, 3, 3> {
  vec3 seen;
  double root;  ///< of the information
  const camera::intrinsics* k;
  double bf;
  const rotation_view* rotation;
  stereo_cost(const test::keyframe_observation& o, const camera::intrinsics* intrinsics, double baseline_focal,
              const rotation_view* r)
      : seen{o.pixel.x(), o.pixel.y(), o.right},
        root{std::sqrt(o.information)},
        k{intrinsics},
        bf{baseline_focal},
        rotation{r} {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const vec3 turned = rotation->matrix * Eigen::Map<const vec3>(x[2]);
    const vec3 p = turned + Eigen::Map<const vec3>(x[1]);
    const double iz = 1.0 / p.z(), u = k->fx * p.x() * iz + k->cx, v = k->fy * p.y() * iz + k->cy;
    residual[0] = root * (u - seen.x());
    residual[1] = root * (v - seen.y());
    residual[2] = root * (u - bf * iz - seen.z());
    if (jacobians == nullptr) return true;
    const double a = root * iz, b = a * iz;
    mat3 by_p;
    by_p << a * k->fx, 0.0, -b * k->fx * p.x(),  //
        0.0, a * k->fy, -b * k->fy * p.y(),      //
        a * k->fx, 0.0, -b * (k->fx * p.x() - bf);
    if (jacobians[0] != nullptr) Eigen::Map<row_major<3, 3>>{jacobians[0]} = rotation->derivative(by_p, turned);
    if (jacobians[1] != nullptr) Eigen::Map<row_major<3, 3>>{jacobians[1]} = by_p;
    if (jacobians[2] != nullptr) Eigen::Map<row_major<3, 3>>{jacobians[2]}.noalias() = by_p * rotation->matrix;
    return true;
  }
};

/// The gate of the stereo observations, chi-squared of three degrees of freedom at 95 %.
inline constexpr double stereo_gate = 7.815;

/// Local bundle adjustment in two phases: all observations, then those that passed the gate. Every
/// observation has depth.
inline outcome adjust_locally(test::synthetic_local_map& map, const settings& s, int first_phase, int second_phase) {
  std::vector<keyframe_block> keyframes;
  for (const se3& pose : map.poses) {
    const se3 inverse = pose.inverse();
    const vec3 w = inverse.rotation().log();
    const vec3& t = inverse.translation();
    keyframes.push_back({w.x(), w.y(), w.z(), t.x(), t.y(), t.z()});
  }
  std::vector<rotation_view> views;
  const auto update = [&] {
    views.clear();
    for (const auto& keyframe : keyframes) views.emplace_back(keyframe.data());
  };
  views.reserve(keyframes.size());
  update();
  before_evaluation callback{update};
  ceres::HuberLoss huber{s.huber};
  std::deque<stereo_cost> costs;
  const camera::intrinsics k = map.camera.k();
  for (const auto& o : map.observations) costs.emplace_back(o, &k, map.bf, &views[o.keyframe]);

  std::vector<std::uint8_t> ignored(costs.size(), 0);
  const auto phase = [&](int iterations) {
    std::vector<double*> points, blocks;
    std::vector<std::uint8_t> used_point(map.points.size(), 0), used_keyframe(keyframes.size(), 0);
    ceres::Problem problem{borrowing(&callback)};
    for (std::size_t i = 0; i != costs.size(); ++i) {
      if (ignored[i] != 0) continue;
      const auto& o = map.observations[i];
      double* block = keyframes[o.keyframe].data();
      problem.AddResidualBlock(&costs[i], s.huber > 0.0 ? &huber : nullptr, block, block + 3,
                               map.points[o.point].data());
      used_point[o.point] = used_keyframe[o.keyframe] = 1;
    }
    for (std::size_t i = 0; i != keyframes.size(); ++i) {
      if (used_keyframe[i] == 0) continue;
      for (double* block : {keyframes[i].data(), keyframes[i].data() + 3}) {
        blocks.push_back(block);
        if (map.fixed[i] != 0) problem.SetParameterBlockConstant(block);
      }
    }
    for (std::size_t j = 0; j != map.points.size(); ++j)
      if (used_point[j] != 0) points.push_back(map.points[j].data());
    settings now = s;
    now.max_iterations = iterations;
    const outcome done = solve(problem, now, points, blocks);
    update();
    return done;
  };
  outcome done = phase(first_phase);
  if (second_phase > 0) {
    for (std::size_t i = 0; i != costs.size(); ++i) {
      const auto& o = map.observations[i];
      const double* parameters[] = {keyframes[o.keyframe].data(), keyframes[o.keyframe].data() + 3,
                                    map.points[o.point].data()};
      vec3 r;
      costs[i].Evaluate(parameters, r.data(), nullptr);
      ignored[i] = r.squaredNorm() > stereo_gate ? 1 : 0;
    }
    const outcome second = phase(second_phase);
    done.final_cost = second.final_cost;
    done.iterations += second.iterations;
  }
  for (std::size_t i = 0; i != keyframes.size(); ++i) {
    const auto& b = keyframes[i];
    if (map.fixed[i] == 0) map.poses[i] = se3{so3::exp(vec3(b[0], b[1], b[2])), vec3(b[3], b[4], b[5])}.inverse();
  }
  return done;
}

}  // namespace orbis::bench::with_ceres
