// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of bundle_adjustment.hpp. Its users declare it only;
/// cmake/compiled/optimize.cpp defines ORBIS_INSTANTIATE_OPTIMIZE as `template` and makes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/compiled/block_solvers.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>

namespace orbis {

ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::eliminate_kernel<6, true>,
                      optimize::detail::schur_kernels<6, true>::eliminator);
ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::substitute_kernel<6, true>,
                      optimize::detail::schur_kernels<6, true>::substituter);

/// The kernels, the constructor and the loops for a residual, a loss and the default policies.
#define ORBIS_INSTANTIATE_BUNDLE_KERNELS(what, residual, loss)                                                    \
  ORBIS_KERNEL_INSTANCE(what, optimize::detail::linearize_kernel<optimize::residual, optimize::loss>,             \
                        double(const optimize::detail::camera_work<optimize::residual>&, const optimize::loss&)); \
  ORBIS_KERNEL_INSTANCE(what, optimize::detail::cost_kernel<optimize::residual, optimize::loss>,                  \
                        double(const optimize::detail::camera_work<optimize::residual>&, const optimize::loss&));
#define ORBIS_INSTANTIATE_BUNDLE(what, residual, loss)                                                                \
  ORBIS_INSTANTIATE_BUNDLE_KERNELS(what, residual, loss)                                                              \
  what optimize::detail::bundle_equations<optimize::residual, optimize::loss, optimize::automatic_reduced_solver>::   \
      bundle_equations(optimize::residual, optimize::loss, const optimize::automatic_reduced_solver&);                \
  what void optimize::detail::                                                                                        \
      bundle_equations<optimize::residual, optimize::loss, optimize::automatic_reduced_solver>::set_structure(        \
          std::size_t, std::size_t, std::span<const optimize::residual::observation>, std::span<const std::uint8_t>); \
  ORBIS_INSTANTIATE_BUNDLE_RUN(what, residual, loss, sequential_policy)                                               \
  ORBIS_INSTANTIATE_BUNDLE_RUN(what, residual, loss, parallel_policy)
#define ORBIS_INSTANTIATE_BUNDLE_RUN(what, residual, loss, policy)                                                  \
  what optimize::bundle_summary optimize::bundle_adjuster<optimize::residual, optimize::loss>::run(                 \
      const policy&, std::span<optimize::residual::camera_state>, std::span<vec3>, const optimize::bundle_options&, \
      const progress&, optimize::detail::no_report&, optimize::bundle_summary&);

ORBIS_INSTANTIATE_BUNDLE(ORBIS_INSTANTIATE_OPTIMIZE, reprojection<camera::pinhole>, huber)
ORBIS_INSTANTIATE_BUNDLE(ORBIS_INSTANTIATE_OPTIMIZE, reprojection<camera::any_camera>, huber)

}  // namespace orbis
