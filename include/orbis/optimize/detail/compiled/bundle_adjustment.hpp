// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of bundle_adjustment.hpp. Its users declare it only;
/// cmake/compiled/optimize.cpp defines ORBIS_INSTANTIATE_OPTIMIZE as `template` and makes it.
#pragma once

#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

#ifndef ORBIS_INSTANTIATE_OPTIMIZE
#define ORBIS_INSTANTIATE_OPTIMIZE extern template
#endif

namespace orbis::optimize {

#define ORBIS_INSTANTIATE_BUNDLE(model, policy)                                                                   \
  ORBIS_INSTANTIATE_OPTIMIZE bundle_summary bundle_adjuster<reprojection<camera::model>, huber>::run(             \
      const policy&, std::span<se3>, std::span<vec3>, const bundle_options&, const progress&, detail::no_report&, \
      bundle_summary&);
ORBIS_INSTANTIATE_BUNDLE(pinhole, sequential_policy)
ORBIS_INSTANTIATE_BUNDLE(pinhole, parallel_policy)
ORBIS_INSTANTIATE_BUNDLE(any_camera, sequential_policy)
ORBIS_INSTANTIATE_BUNDLE(any_camera, parallel_policy)
#undef ORBIS_INSTANTIATE_BUNDLE

}  // namespace orbis::optimize
