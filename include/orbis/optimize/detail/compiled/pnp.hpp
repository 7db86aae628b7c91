// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of pnp.hpp.
#pragma once

#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/pnp.hpp>

#ifndef ORBIS_INSTANTIATE_OPTIMIZE
#define ORBIS_INSTANTIATE_OPTIMIZE extern template
#endif

namespace orbis::optimize {

#define ORBIS_INSTANTIATE_PNP(model)                              \
  ORBIS_INSTANTIATE_OPTIMIZE result<pose_estimate> estimate_pose( \
      std::span<const vec3>, std::span<const vec2>, const camera::model&, const pnp_options&, pnp_workspace&);
ORBIS_INSTANTIATE_PNP(pinhole)
ORBIS_INSTANTIATE_PNP(radial_tangential)
ORBIS_INSTANTIATE_PNP(any_camera)
#undef ORBIS_INSTANTIATE_PNP

}  // namespace orbis::optimize
