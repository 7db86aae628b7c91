// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Problems and yardsticks for the tests of bundle adjustment.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Cholesky>

#include <orbis/camera/pinhole.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>

#include "support.hpp"

namespace orbis::test {

inline const camera::pinhole bundle_camera{640, 480, 525, 525, 319.5, 239.5};
inline const optimize::reprojection bundle_model{bundle_camera, 40.0};

struct bundle {
  std::vector<se3> poses, true_poses;
  std::vector<vec3> points, true_points;
  std::vector<optimize::bundle_observation> observations;
  std::vector<std::uint8_t> fixed;
};

struct bundle_shape {
  int poses = 8, fixed = 2;
  std::uint32_t points = 150;
  double depth_share = 0.6, sigma = 0.0;
  double pose_error = 0.03, point_error = 0.05;
};

/// Cameras along a curve that look at a cloud of points; the estimate is off by centimetres.
inline bundle make_bundle(const bundle_shape& shape, std::uint64_t seed) {
  random_bits random(seed);
  bundle p;
  for (int i = 0; i < shape.poses; ++i) {
    p.true_poses.emplace_back(so3::exp(vec3(0, -0.03 * i, 0.01 * i)), vec3(0.1 * i, 0.02 * i, 0.01 * i));
    vec6 xi;
    xi << random_vector(random, shape.pose_error), random_vector(random, 0.7 * shape.pose_error);
    p.fixed.push_back(i < shape.fixed ? 1 : 0);
    p.poses.push_back(i < shape.fixed ? p.true_poses.back() : p.true_poses.back() * se3::exp(xi));
  }
  for (std::uint32_t j = 0; j < shape.points; ++j) {
    p.true_points.push_back(random_point_in_view(random));
    p.points.push_back(p.true_points.back() + random_vector(random, shape.point_error));
    for (std::uint32_t i = 0; i < p.poses.size(); ++i) {
      const vec3 seen = p.true_poses[i].inverse() * p.true_points[j];
      const auto pixel = bundle_camera.project(seen);
      if (!pixel) continue;
      optimize::bundle_observation o{.pose = i, .point = j};
      o.pixel = *pixel + shape.sigma * vec2(random.normal(), random.normal());
      if (random.uniform() < shape.depth_share)
        o.right = bundle_model.right(pixel->x(), seen.z()) + shape.sigma * random.normal();
      p.observations.push_back(o);
    }
  }
  return p;
}

/// The step `-(H + D)^-1 g` by the whole normal equations, made densely from one residual after the
/// other; in the order of the unknowns of the equations.
template <class Equations, class Camera, class Observation>
Eigen::VectorXd dense_step(const Equations& equations, const std::vector<Camera>& cameras,
                           const std::vector<vec3>& points, const std::vector<Observation>& observations,
                           const Eigen::VectorXd& damping) {
  using residual_type = std::remove_cvref_t<decltype(equations.residual())>;
  constexpr int size = residual_type::camera_manifold::dimension, rows = residual_type::dimension;
  const auto& structure = equations.structure();
  std::vector<Eigen::Index> row_of(points.size(), -1);
  for (std::size_t p = 0; p != structure.points(); ++p)
    row_of[structure.point_source[p]] = static_cast<Eigen::Index>(size * structure.unknowns() + 3 * p);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(damping.size(), damping.size());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(damping.size());
  for (const Observation& o : observations) {
    matrix<rows, size> by_camera;
    matrix<rows, 3> by_point;
    const auto r = equations.residual().linearize(equations.residual().prepare(cameras[o.pose]), points[o.point], o,
                                                  by_camera, by_point);
    if (!r) continue;
    const double weight = o.information * equations.loss().weight(o.information * r->squaredNorm());
    const Eigen::Index p = row_of[o.point];
    h.block<3, 3>(p, p) += weight * by_point.transpose() * by_point;
    g.segment<3>(p) += weight * by_point.transpose() * *r;
    if (structure.unknown[o.pose] == structure.none) continue;
    const auto c = static_cast<Eigen::Index>(size * structure.unknown[o.pose]);
    h.block<size, size>(c, c) += weight * by_camera.transpose() * by_camera;
    h.block<size, 3>(c, p) += weight * by_camera.transpose() * by_point;
    h.block<3, size>(p, c) += weight * by_point.transpose() * by_camera;
    g.segment<size>(c) += weight * by_camera.transpose() * *r;
  }
  h.diagonal() += damping;
  return -(h.ldlt().solve(g));
}

}  // namespace orbis::test
