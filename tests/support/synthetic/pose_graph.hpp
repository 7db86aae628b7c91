// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose graphs made on the fly, with their truth: a robot that goes round a sphere, round a torus or
/// through a building of cubic rooms, and sees again where it has been.
///
/// The scenes are those of L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques
/// for 3D SLAM: a survey on rotation estimation and its use in pose graph optimization", ICRA 2015.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/g2o.hpp>

namespace orbis::test {

using namespace io;

enum class graph_shape {
  sphere,  ///< rings of poses, each joined to the ring before
  torus,   ///< windings round a ring, each joined to the one before
  grid     ///< a cube of poses, passed through row by row, neighbours joined at random
};

struct synthetic_graph_options {
  graph_shape shape = graph_shape::sphere;
  int poses_per_turn = 50;           ///< along a ring, a winding or an edge of the cube; at least 3
  int turns = 50;                    ///< rings or windings; the cube has `poses_per_turn` layers
  double radius = 50.0;              ///< of the sphere or the torus, metres; rooms of the cube are 1 m wide
  double translation_sigma = 0.1;    ///< of each coordinate of a measurement, metres
  double rotation_sigma = 0.02;      ///< about each axis, radians
  double closure_probability = 1.0;  ///< that two neighbours of different turns see each other
  double outlier_share = 0.0;        ///< of these closures: how many are wrong altogether
  std::uint64_t seed = 1;
};

struct synthetic_graph {
  g2o_graph measured;               ///< vertices: what odometry alone says, from the true first pose
  std::vector<se3> truth;           ///< poses in the world
  std::vector<std::uint8_t> wrong;  ///< one for each edge: whether it is an outlier
};

namespace detail {

/// Where the robot is at step `i` of turn `turn`.
[[nodiscard]] inline se3 pose_on_path(const synthetic_graph_options& o, int turn, int i) {
  const double two_pi = 2.0 * std::numbers::pi;
  const double along = two_pi * i / o.poses_per_turn;
  const auto about = [](double x, double y, double z) { return so3::exp(vec3(x, y, z)); };
  if (o.shape == graph_shape::sphere) {
    const double height =
        std::numbers::pi * ((turn + static_cast<double>(i) / o.poses_per_turn + 0.5) / (o.turns + 1) - 0.5);
    const so3 r = about(0, 0, along) * about(0, -height, 0);
    return {r, r * vec3(o.radius, 0, 0)};
  }
  if (o.shape == graph_shape::torus) {
    const double around = two_pi * (turn + static_cast<double>(i) / o.poses_per_turn) / o.turns;
    const so3 ring = about(0, 0, around);
    const so3 r = ring * about(0, -along, 0);
    return {r, ring * vec3(o.radius, 0, 0) + r * vec3(0.4 * o.radius, 0, 0)};
  }
  // A snake: every other row, and every other layer, backwards.
  const int n = o.poses_per_turn;
  const int layer = turn / n, row = turn % n;
  const int y = layer % 2 == 0 ? row : n - 1 - row;
  const bool back = (layer * n + row) % 2 != 0;
  return {about(0, 0, back ? std::numbers::pi : 0.0), vec3(back ? n - 1 - i : i, y, layer)};
}

}  // namespace detail

/// A graph with measured edges from every pose to the next and to its neighbours in earlier turns.
/// The first vertex is fixed. @pre the options are in the ranges they name
[[nodiscard]] inline synthetic_graph make_pose_graph(const synthetic_graph_options& o) {
  synthetic_graph made;
  random_bits random{o.seed};
  const int n = o.poses_per_turn;
  const bool cube = o.shape == graph_shape::grid;
  const int turns = cube ? n * n : o.turns;
  for (int turn = 0; turn != turns; ++turn)
    for (int i = 0; i != n; ++i) made.truth.push_back(detail::pose_on_path(o, turn, i));

  mat6 information = mat6::Zero();  // of the translation and of half the rotation vector
  information.diagonal().head<3>().setConstant(1.0 / (o.translation_sigma * o.translation_sigma));
  information.diagonal().tail<3>().setConstant(4.0 / (o.rotation_sigma * o.rotation_sigma));
  const auto noise = [&](double sigma) {
    const double x = random.normal(), y = random.normal();
    return vec3(sigma * vec3(x, y, random.normal()));
  };
  const auto join = [&](std::size_t from, std::size_t to, bool wrong) {
    se3 z = made.truth[from].inverse() * made.truth[to];
    const vec3 turned = noise(wrong ? 1.0 : o.rotation_sigma);
    const vec3 moved = noise(wrong ? 0.2 * o.radius : o.translation_sigma);
    z = se3{z.rotation() * so3::exp(turned), z.translation() + moved};
    made.measured.edges.push_back({static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to), z, information});
    made.wrong.push_back(wrong ? 1 : 0);
  };
  const auto close = [&](std::size_t from, std::size_t to) {
    if (from + 1 == to) return;  // odometry has seen it
    if (random.uniform() < o.closure_probability) join(from, to, random.uniform() < o.outlier_share);
  };

  made.measured.vertices.push_back(made.truth.front());
  for (std::size_t k = 1; k != made.truth.size(); ++k) {
    join(k - 1, k, false);
    made.measured.vertices.push_back(made.measured.vertices.back() * made.measured.edges.back().measurement);
    if (!cube) {
      if (k >= static_cast<std::size_t>(n)) close(k - static_cast<std::size_t>(n), k);
      continue;
    }
    // The neighbours in the row and in the layer before.
    const int turn = static_cast<int>(k) / n, i = static_cast<int>(k) % n;
    const int layer = turn / n, row = turn % n;
    const auto at = [&](int l, int r, int c) { return static_cast<std::size_t>((l * n + r) * n + c); };
    if (row > 0) close(at(layer, row - 1, n - 1 - i), k);
    if (layer > 0) close(at(layer - 1, n - 1 - row, n % 2 == 0 ? n - 1 - i : i), k);
  }
  for (std::size_t k = 0; k != made.truth.size(); ++k) made.measured.ids.push_back(static_cast<std::int64_t>(k));
  made.measured.fixed.assign(made.truth.size(), 0);
  made.measured.fixed.front() = 1;
  return made;
}

}  // namespace orbis::test
