// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is asked of a solver of pose graphs, and what it answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace orbis::optimize {

/// Which vertices stay where they are, so that the rest is determined: a graph of relative poses does
/// not say where it is in the world.
enum class pose_graph_gauge {
  automatic,            ///< the fixed ones; in a graph in one piece without any, its first vertex
  first_of_each_piece,  ///< the fixed ones; in every piece of the graph without any, its first vertex
  as_given              ///< the fixed ones alone
};

enum class pose_graph_status {
  converged,
  iteration_limit,
  cancelled,
  no_progress,      ///< no step lowers the cost any further, though the model promises it
  nothing_to_do,    ///< no edge at a vertex that may move
  bad_vertex,       ///< vertex `where` is not finite
  missing_vertex,   ///< edge `where` names a vertex that there is not
  self_edge,        ///< edge `where` joins a vertex with itself
  bad_measurement,  ///< edge `where`: the measurement is not finite
  bad_information,  ///< edge `where`: the information is not finite, not symmetric or not positive definite
  no_gauge,         ///< vertex `where` is in a piece of the graph in which none is fixed
  singular          ///< the edges do not determine vertex `where`
};

[[nodiscard]] constexpr bool is_failure(pose_graph_status status) noexcept {
  return status >= pose_graph_status::bad_vertex;
}

/// In words, with the number `where` that some of them have.
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
    case pose_graph_status::missing_vertex: return edge("names a vertex that there is not");
    case pose_graph_status::self_edge: return edge("joins a vertex with itself");
    case pose_graph_status::bad_measurement: return edge("has a measurement that is not finite");
    case pose_graph_status::bad_information:
      return edge("has an information matrix that is not symmetric and positive definite");
    case pose_graph_status::no_gauge: return vertex("is in a piece of the graph in which no vertex is fixed");
    case pose_graph_status::singular: return vertex("is not determined by the edges");
  }
  return "unknown";
}

struct pose_graph_options {
  int max_iterations = 100;
  double relative_tolerance = 1e-6;       ///< ends when a step changes the cost by less than this share
  std::span<const std::uint8_t> fixed{};  ///< empty, or one for each vertex: not 0 keeps it where it is
  pose_graph_gauge hold = pose_graph_gauge::automatic;
  bool semidefinite_information = false;  ///< whether edges may say nothing about some direction
};

/// Seconds.
struct pose_graph_times {
  double set_up = 0.0;     ///< checks, order of elimination, structure of the factor
  double linearize = 0.0;  ///< residuals, Jacobians, normal equations
  double factor = 0.0;
  double solve = 0.0;
  double evaluate = 0.0;  ///< costs of steps tried
};

struct pose_graph_summary {
  pose_graph_status status = pose_graph_status::nothing_to_do;
  std::size_t where = 0;      ///< the edge or vertex that a failure is about
  double initial_cost = 0.0;  ///< half the sum of the robust loss over the edges
  double final_cost = 0.0;    ///< never above `initial_cost`
  int iterations = 0;         ///< steps taken
  int factorizations = 0;     ///< those of steps not taken included
  pose_graph_times seconds;
};

[[nodiscard]] inline std::string to_string(const pose_graph_summary& s) { return describe(s.status, s.where); }

}  // namespace orbis::optimize
