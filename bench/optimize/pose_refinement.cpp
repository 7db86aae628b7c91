// SPDX-License-Identifier: BSD-3-Clause
//
// The pose of one frame from observations of known points, in rounds with outlier gates: beside
// ceres::TinySolver with analytic Jacobians, given the same rounds, gates and loss. Everyone must find the
// inliers and the true pose.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#ifdef ORBIS_BENCH_WITH_CERES
#include <ceres/tiny_solver.h>
#endif

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/optimize/pose_refinement.hpp>

namespace orbis::bench {
namespace {

using namespace orbis::optimize;

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 319.5, .cy = 239.5};
constexpr double width = 2.795;  ///< of the Huber loss: the root of the gate

template <class Camera>
struct problem {
  reprojection<Camera> model;
  se3 truth, start;
  std::vector<pose_observation> seen;
  std::size_t inliers = 0;  ///< at the truth
};

/// A room seen by a stereo camera; every fifth match is wrong.
template <class Camera>
problem<Camera> make(const Camera& camera, std::size_t n) {
  random_bits random(2024);
  problem<Camera> p{{camera, 40.0}, {}, {}, {}, 0};
  p.truth = se3(so3::exp(vec3(0.3, -0.8, 0.2)), vec3(1.0, -0.4, 2.0));
  const auto noise = [&] { return random.normal(); };
  while (p.seen.size() < n) {
    const double z = random.uniform(0.8, 4.5);
    const vec3 point(random.uniform(-0.55, 0.55) * z, random.uniform(-0.42, 0.42) * z, z);
    const auto pixel = camera.project(point);
    if (!pixel) continue;
    const double sigma = std::pow(1.2, std::floor(random.uniform(0.0, 8.0)));
    pose_observation o{.point = p.truth * point, .information = 1.0 / (sigma * sigma)};
    if (p.seen.size() % 5 == 4) {
      o.pixel = vec2(random.uniform(0, 640), random.uniform(0, 480));
      o.right = o.pixel.x() - random.uniform(5.0, 50.0);
    } else {
      o.pixel = *pixel + 0.5 * sigma * vec2(noise(), noise());
      o.right = p.model.right(pixel->x(), z) + 0.5 * sigma * noise();
    }
    const auto r = p.model.residual(point, o);
    p.inliers += r && o.information * r->squaredNorm() <= 7.815;
    p.seen.push_back(o);
  }
  vec6 off;
  off << 0.03, -0.02, 0.04, 0.02, -0.015, 0.01;
  p.start = p.truth * se3::exp(off);
  return p;
}

struct answer {
  se3 T_world_camera;
  std::size_t inliers = 0;
};

template <class Camera>
answer solve(const problem<Camera>& p, std::vector<std::uint8_t>& outliers, simd::level level) {
  const simd::level_limit limit{level};
  outliers.resize(p.seen.size());
  const auto refined = refine_pose(std::span{p.seen}, p.model, p.start, std::span{outliers}, {}, huber{width});
  return {refined.T_world_camera, refined.inliers};
}

#ifdef ORBIS_BENCH_WITH_CERES
/// Rotation vector and translation of T_camera_world; what does not take part is left out.
struct tiny_problem {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 6 };
  const problem<camera::pinhole>& p;
  std::vector<std::uint32_t> active;
  bool robust = true;

  int NumResiduals() const { return 3 * static_cast<int>(active.size()); }
  bool operator()(const double* x, double* residuals, double* jacobian) const {
    const vec3 omega(x[0], x[1], x[2]), t(x[3], x[4], x[5]);
    const mat3 rotation = so3::exp(omega).rotation_matrix();
    const mat3 turn = so3::left_jacobian(omega);
    const Eigen::Index rows = NumResiduals();
    const double fx = k.fx, fy = k.fy, bf = p.model.bf;
    for (std::size_t i = 0; i != active.size(); ++i) {
      const pose_observation& o = p.seen[active[i]];
      const vec3 turned = rotation * o.point, q = turned + t;
      const double iz = 1.0 / q.z(), u = fx * q.x() * iz, v = fy * q.y() * iz;
      vec3 r(u + k.cx - o.pixel.x(), v + k.cy - o.pixel.y(), u + k.cx - bf * iz - o.right);
      const double whiten = std::sqrt(o.information);
      const double s = o.information * r.squaredNorm();
      // Scaled so that the squared norm is the loss and the gradient that of the loss.
      double scale = whiten, slope = whiten;
      if (robust && s > width * width) {
        const huber loss{width};
        const double shrink = std::sqrt(loss.cost(s) / s);
        scale *= shrink;
        slope *= loss.weight(s) / shrink;
      }
      const auto row = 3 * static_cast<Eigen::Index>(i);
      Eigen::Map<vec3>{residuals + row} = scale * r;
      if (jacobian == nullptr) continue;
      mat3 by_point;
      by_point << fx * iz, 0.0, -u * iz, 0.0, fy * iz, -v * iz, fx * iz, 0.0, (bf * iz - u) * iz;
      by_point *= slope;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6>> j{jacobian, rows, 6};
      j.block<3, 3>(row, 0).noalias() = -(by_point * hat<double>(turned)) * turn;
      j.block<3, 3>(row, 3) = by_point;
    }
    return true;
  }
};

/// What is kept between solutions.
struct tiny {
  tiny_problem f;
  ceres::TinySolver<tiny_problem> solver{};
};

answer solve_with_tiny_solver(const problem<camera::pinhole>& p, tiny& t, std::vector<std::uint8_t>& outliers) {
  outliers.assign(p.seen.size(), 0);
  const se3 from = p.start.inverse();
  vec6 x;
  x << from.rotation().log(), from.translation();
  t.solver.options.max_num_iterations = 10;
  se3 pose;
  std::size_t inliers = 0;
  for (int round = 0; round != 4; ++round) {
    t.f.active.clear();
    for (std::uint32_t i = 0; i != p.seen.size(); ++i)
      if (outliers[i] == 0) t.f.active.push_back(i);
    t.f.robust = round != 3;
    Eigen::Matrix<double, 6, 1> estimate = x;
    t.solver.Solve(t.f, &estimate);
    x = estimate;
    pose = se3(so3::exp(vec3(x.head<3>())), vec3(x.tail<3>()));
    const mat3 rotation = pose.rotation_matrix();
    inliers = 0;
    for (std::size_t i = 0; i != p.seen.size(); ++i) {
      const auto r = p.model.residual(vec3(rotation * p.seen[i].point + pose.translation()), p.seen[i]);
      outliers[i] = r && p.seen[i].information * r->squaredNorm() <= 7.815 ? 0 : 1;
      inliers += outliers[i] == 0;
    }
  }
  return {pose.inverse(), inliers};
}
#endif

/// `prepare(problem)` is asked once for what then solves it, `solution(outliers)`.
template <class Camera, class Prepare>
void add(const std::string& name, const Camera& camera, std::size_t n, Prepare prepare) {
  benchmark::RegisterBenchmark(("pose_only/" + std::to_string(n) + "/" + name).c_str(),
                               [=](benchmark::State& state) {
                                 const problem<Camera> p = make(camera, n);
                                 auto solution = prepare(p);
                                 std::vector<std::uint8_t> outliers(n);
                                 answer a;
                                 for (auto _ : state) benchmark::DoNotOptimize(a = solution(outliers));
                                 const double off = (a.T_world_camera.translation() - p.truth.translation()).norm();
                                 const auto missed =
                                     static_cast<std::ptrdiff_t>(a.inliers) - static_cast<std::ptrdiff_t>(p.inliers);
                                 if (!(off < 5e-4 * std::sqrt(500.0 / static_cast<double>(n))))
                                   state.SkipWithError("another pose");
                                 if (std::abs(missed) > 2) state.SkipWithError("other inliers");
                               })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

template <class Camera>
void add_ours(const std::string& name, const Camera& camera, std::size_t n, simd::level level) {
  add(name, camera, n, [level](const problem<Camera>& p) {
    return [&p, level](std::vector<std::uint8_t>& outliers) { return solve(p, outliers, level); };
  });
}

[[maybe_unused]] const bool registered = [] {
  const camera::pinhole plain{k};
  for (const std::size_t n : {std::size_t{100}, std::size_t{500}, std::size_t{2000}}) {
    add_ours("orbis", plain, n, simd::level::avx512);
    add_ours("orbis_avx2", plain, n, simd::level::avx2);
    add_ours("orbis_portable", plain, n, simd::level::portable);
#ifdef ORBIS_BENCH_WITH_CERES
    add("tiny_solver", plain, n, [](const problem<camera::pinhole>& p) {
      return [&p, t = tiny{{p, {}, true}}](std::vector<std::uint8_t>& outliers) mutable {
        return solve_with_tiny_solver(p, t, outliers);
      };
    });
#endif
  }
  add_ours("orbis_radial_tangential",
           camera::radial_tangential{k, {.k1 = 0.12, .k2 = -0.25, .p1 = -0.002, .p2 = 0.001, .k3 = 0.1}}, 500,
           simd::level::avx512);
  add_ours("orbis_kannala_brandt", camera::kannala_brandt{k, {.k1 = -0.02, .k2 = 0.01, .k3 = -0.005, .k4 = 0.001}}, 500,
           simd::level::avx512);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
