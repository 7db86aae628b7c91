// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The parts of a pose graph problem: edges, residuals between two poses, options and summary.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// A measured relative pose `T_from_to` between two vertices, which are indices into the caller's array. `information`
/// is the inverse covariance of the solver's residual.
template <class T, int Dimension = T::dof>
struct pose_graph_edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  T measurement{};
  matrix<Dimension, Dimension> information = identity<matrix<Dimension, Dimension>>();
};

/// A type with the members of `pose_graph_edge`, for vertices of type T.
template <class E, class T>
concept relative_measurement = requires(const E& e) {
  { e.from } -> std::convertible_to<std::uint32_t>;
  { e.to } -> std::convertible_to<std::uint32_t>;
  { e.measurement } -> std::convertible_to<const T&>;
  { e.information(0, 0) } -> std::convertible_to<double>;
};

/// The residual of an edge: a vector computed from `D = T_a_b^-1 * (T_world_a^-1 * T_world_b)`, where `T_a_b` is
/// measured and D is the identity for a perfect fit. `linearize` returns it and writes its derivatives with respect to
/// a step of each pose, on the right: `T * exp(d)`.
template <class F, class T>
concept between_factor = std::copyable<F> &&
    requires(const F& f, const T& pose, matrix<F::dimension, T::dof>& jacobian) {
  { f.residual(pose, pose, pose) } -> std::same_as<matrix<F::dimension>>;
  { f.linearize(pose, pose, pose, jacobian, jacobian) } -> std::same_as<matrix<F::dimension>>;
};

/// The logarithm of `D`, for any Lie group: (rho, phi), followed by the logarithm of the scale for Sim(3).
template <class T>
struct logarithm_between {
  static constexpr int dimension = T::dof;
  using vector = matrix<dimension>;
  using jacobian = matrix<dimension, dimension>;

  [[nodiscard]] static vector residual(const T& T_world_a, const T& T_world_b, const T& T_a_b) {
    return (T_a_b.inverse() * (T_world_a.inverse() * T_world_b)).log();
  }
  [[nodiscard]] static vector linearize(const T& T_world_a, const T& T_world_b, const T& T_a_b, jacobian& by_a,
                                        jacobian& by_b) {
    const T between = T_world_a.inverse() * T_world_b;
    const vector r = (T_a_b.inverse() * between).log();
    by_b = T::right_jacobian_inverse(r);
    by_a = -by_b * between.inverse().adjoint();
    return r;
  }
};

/// The translation of `D` and the vector part of its quaternion, whose sign is chosen so that the real part is
/// positive. This is the residual of g2o's `EDGE_SE3:QUAT`, compatible with the information matrices and chi-squared
/// values of g2o files. It is cheaper than the logarithm; for small angles its rotational part is half as large.
///
/// Source: R. Kuemmerle, G. Grisetti, H. Strasdat, K. Konolige, W. Burgard, "g2o: a general framework for
/// graph optimization", ICRA 2011.
struct quaternion_between {
  static constexpr int dimension = 6;

  [[nodiscard]] static vec6 residual(const se3& T_world_a, const se3& T_world_b, const se3& T_a_b) {
    return se3_residual(T_a_b.inverse() * (T_world_a.inverse() * T_world_b));
  }
  [[nodiscard]] static vec6 linearize(const se3& T_world_a, const se3& T_world_b, const se3& T_a_b, mat6& by_a,
                                      mat6& by_b) {
    const se3 between = T_world_a.inverse() * T_world_b;
    const se3 inverse = T_a_b.inverse();
    const se3 d = inverse * between;
    const auto& q = d.rotation().unit_quaternion();
    const double half = q.w() < 0.0 ? -0.5 : 0.5, real = half * q.w();
    const mat3 cross = hat<double>(vec3(half * q.x(), half * q.y(), half * q.z()));
    const mat3 back = inverse.rotation_matrix(), turn = d.rotation_matrix();
    const mat3 lever = back * hat<double>(between.translation()), by_turn = cross * back;
    for (int k = 0; k != 3; ++k)
      for (int i = 0; i != 3; ++i) {
        by_b(i, k) = turn(i, k);
        by_b(i, 3 + k) = 0.0;
        by_b(3 + i, k) = 0.0;
        by_b(3 + i, 3 + k) = (i == k ? real : 0.0) + cross(i, k);
        by_a(i, k) = -back(i, k);
        by_a(i, 3 + k) = lever(i, k);
        by_a(3 + i, k) = 0.0;
        by_a(3 + i, 3 + k) = by_turn(i, k) - real * back(i, k);
      }
    return se3_residual(d);
  }

 private:
  [[nodiscard]] static vec6 se3_residual(const se3& d) {
    const auto& q = d.rotation().unit_quaternion();
    const vec3& t = d.translation();
    const double sign = q.w() < 0.0 ? -1.0 : 1.0;
    vec6 r;
    r[0] = t.x(), r[1] = t.y(), r[2] = t.z();
    r[3] = sign * q.x(), r[4] = sign * q.y(), r[5] = sign * q.z();
    return r;
  }
};

static_assert(between_factor<quaternion_between, se3> && between_factor<logarithm_between<se3>, se3> &&
              between_factor<logarithm_between<sim3>, sim3> && between_factor<logarithm_between<so3>, so3>);

/// Selection of the vertices that are held fixed so that the others are determined: relative poses do not determine the
/// position of the graph in the world frame.
enum class pose_graph_gauge {
  automatic,            ///< the fixed vertices; if there are none and the graph is connected, its first vertex
  first_of_each_piece,  ///< the fixed vertices; in each component without one, its first vertex
  as_given              ///< only the fixed vertices
};

enum class pose_graph_status {
  converged,
  iteration_limit,
  cancelled,
  no_progress,      ///< no step reduces the cost, although the model predicts a decrease
  nothing_to_do,    ///< no edge has a vertex that can move
  bad_vertex,       ///< vertex `where` is not finite
  missing_vertex,   ///< edge `where` refers to a nonexistent vertex
  self_edge,        ///< edge `where` connects a vertex to itself
  bad_measurement,  ///< the measurement of edge `where` is not finite
  bad_information,  ///< the information of edge `where` is not a finite, symmetric, positive definite matrix
  no_gauge,         ///< vertex `where` is in a connected component without a fixed vertex
  singular          ///< the edges do not determine vertex `where`
};

/// Returns true if the input is invalid. The vertices are then unchanged.
[[nodiscard]] constexpr bool is_failure(pose_graph_status status) noexcept {
  return status >= pose_graph_status::bad_vertex;
}

/// Returns the status as text, with the index `where` of the edge or vertex.
[[nodiscard]] inline std::string describe(pose_graph_status status, std::size_t where) {
  const auto vertex = [&](const char* what) { return "vertex " + std::to_string(where) + " " + what; };
  const auto edge = [&](const char* what) { return "edge " + std::to_string(where) + " " + what; };
  switch (status) {
    case pose_graph_status::converged: return "converged";
    case pose_graph_status::iteration_limit: return "iteration limit";
    case pose_graph_status::cancelled: return "cancelled";
    case pose_graph_status::no_progress: return "no progress";
    case pose_graph_status::nothing_to_do: return "nothing to do";
    case pose_graph_status::bad_vertex: return vertex("is not finite");
    case pose_graph_status::missing_vertex: return edge("refers to a nonexistent vertex");
    case pose_graph_status::self_edge: return edge("connects a vertex to itself");
    case pose_graph_status::bad_measurement: return edge("has a measurement that is not finite");
    case pose_graph_status::bad_information:
      return edge("has an information matrix that is not symmetric and positive definite");
    case pose_graph_status::no_gauge: return vertex("is in a connected component without a fixed vertex");
    case pose_graph_status::singular: return vertex("is not determined by the edges");
  }
  return "unknown";
}

struct pose_graph_options {
  int max_iterations = 100;
  double relative_tolerance = 1e-6;       ///< stop when a step changes the cost by less than this fraction
  std::span<const std::uint8_t> fixed{};  ///< empty, or one entry per vertex: nonzero keeps the vertex fixed
  pose_graph_gauge hold = pose_graph_gauge::automatic;
  bool semidefinite_information = false;  ///< accept information matrices with zero eigenvalues
};

/// Time spent in each stage, seconds.
struct pose_graph_times {
  double set_up = 0.0;     ///< checks, elimination order and structure of the factor
  double linearize = 0.0;  ///< residuals, Jacobians, normal equations
  double factor = 0.0;
  double solve = 0.0;
  double evaluate = 0.0;  ///< cost of each attempted step
};

struct pose_graph_summary {
  pose_graph_status status = pose_graph_status::nothing_to_do;
  std::size_t where = 0;      ///< index of the edge or vertex that caused a failure
  double initial_cost = 0.0;  ///< half the sum of the robust loss over the edges
  double final_cost = 0.0;    ///< never above `initial_cost`
  int iterations = 0;         ///< accepted steps
  int factorizations = 0;     ///< number of factorisations, including those of rejected steps
  pose_graph_times seconds;
};

/// Returns the status as text.
[[nodiscard]] inline std::string to_string(const pose_graph_summary& s) { return describe(s.status, s.where); }

}  // namespace orbis::optimize
