// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pnp-inl.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>
#include <orbis/optimize/pose_refinement-inl.hpp>

namespace orbis::optimize {

using points = std::span<const vec3>;
using pixels = std::span<const vec2>;
template result<pose_estimate> estimate_pose(points, pixels, const camera::pinhole&, const pnp_options&,
                                             pnp_workspace&);
template result<pose_estimate> estimate_pose(points, pixels, const camera::radial_tangential&, const pnp_options&,
                                             pnp_workspace&);
template result<pose_estimate> estimate_pose(points, pixels, const camera::any_camera&, const pnp_options&,
                                             pnp_workspace&);

using observations = std::span<const pose_observation>;
using outliers = std::span<std::uint8_t>;
template pose_refinement detail::refine_pose(observations, const camera::pinhole&, double, const se3&, outliers,
                                             const pose_refinement_options&, const huber&);
template pose_refinement detail::refine_pose(observations, const camera::radial_tangential&, double, const se3&,
                                             outliers, const pose_refinement_options&, const huber&);
template pose_refinement detail::refine_pose(observations, const camera::kannala_brandt&, double, const se3&, outliers,
                                             const pose_refinement_options&, const huber&);

#define ORBIS_POSE_GRAPH(pose)                                                                                      \
  template class pose_graph_solver<pose>;                                                                           \
  template pose_graph_summary pose_graph_solver<pose>::solve_edges(                                                 \
      const sequential_policy&, std::span<pose>, std::span<const pose_graph_edge<pose>>, const pose_graph_options&, \
      const progress&, detail::no_report&);                                                                         \
  template pose_graph_summary pose_graph_solver<pose>::solve_edges(                                                 \
      const parallel_policy&, std::span<pose>, std::span<const pose_graph_edge<pose>>, const pose_graph_options&,   \
      const progress&, detail::no_report&);
ORBIS_POSE_GRAPH(se3)
ORBIS_POSE_GRAPH(sim3)

}  // namespace orbis::optimize
