// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of pose_refinement.hpp: Huber's loss and the camera models of the library.
#pragma once

#include <cstdint>
#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/pose_refinement.hpp>

#ifndef ORBIS_INSTANTIATE_OPTIMIZE
#define ORBIS_INSTANTIATE_OPTIMIZE extern template
#endif

namespace orbis::optimize {

#define ORBIS_INSTANTIATE_REFINEMENT(model)                                                                 \
  ORBIS_INSTANTIATE_OPTIMIZE pose_refinement detail::refine_pose(                                           \
      std::span<const pose_observation>, const camera::model&, double, const se3&, std::span<std::uint8_t>, \
      const pose_refinement_options&, const huber&);
ORBIS_INSTANTIATE_REFINEMENT(pinhole)
ORBIS_INSTANTIATE_REFINEMENT(radial_tangential)
ORBIS_INSTANTIATE_REFINEMENT(kannala_brandt)
#undef ORBIS_INSTANTIATE_REFINEMENT

}  // namespace orbis::optimize
