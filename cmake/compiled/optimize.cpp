// SPDX-License-Identifier: BSD-3-Clause
#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>

namespace orbis::optimize {

using pinhole_adjuster = bundle_adjuster<reprojection<camera::pinhole>>;
using any_adjuster = bundle_adjuster<reprojection<camera::any_camera>>;
using observations = std::span<const bundle_observation>;

template class bundle_adjuster<reprojection<camera::pinhole>>;
template class bundle_adjuster<reprojection<camera::any_camera>>;

#define ORBIS_SOLVE(adjuster, policy)                                                                                  \
  template bundle_summary adjuster::solve(const policy&, std::span<se3>, std::span<vec3>, observations,                \
                                          const bundle_options&, progress, detail::no_report&&);                       \
  template bundle_summary adjuster::solve_again(const policy&, std::span<se3>, std::span<vec3>, const bundle_options&, \
                                                progress, detail::no_report&&);
ORBIS_SOLVE(pinhole_adjuster, sequential_policy)
ORBIS_SOLVE(pinhole_adjuster, parallel_policy)
ORBIS_SOLVE(any_adjuster, sequential_policy)
ORBIS_SOLVE(any_adjuster, parallel_policy)

}  // namespace orbis::optimize
