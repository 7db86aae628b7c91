// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of pnp_estimator.hpp: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/optimize_poses.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/p3p_equations.hpp>
#include <orbis/optimize/detail/minimal/pnp_estimator.hpp>

namespace orbis::optimize::detail {

ORBIS_COMPILED_ONCE pnp_estimator::candidates pnp_estimator::fit(const std::array<std::uint32_t, 3>& s) const {
  candidates all;
  for_each_p3p({matches_.points[s[0]], matches_.points[s[1]], matches_.points[s[2]]},
               {matches_.rays[s[0]], matches_.rays[s[1]], matches_.rays[s[2]]},
               [&](const mat3& rotation, const vec3& translation) {
                 if (all.size != 4) all.models[all.size++] = made_of({rotation, translation});
               });
  return all;
}

ORBIS_COMPILED_ONCE std::optional<pnp_estimator::model> pnp_estimator::refine(const model& start,
                                                                              std::span<const std::uint32_t> inliers,
                                                                              int steps) const {
  const std::size_t groups = gather(inliers);
  const auto pose =
      descend_pose(start.pose, steps, [&](const centred_pose& at, pose_equations& e) { sum_up(groups, at, e); });
  if (!pose) return std::nullopt;
  return made_of(*pose);
}

}  // namespace orbis::optimize::detail
