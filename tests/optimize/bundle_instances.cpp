// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_instances.hpp"

namespace orbis::optimize {

ORBIS_TEST_BLOCKS(template, 6)
ORBIS_TEST_BLOCKS(template, 9)
template struct detail::bundle_kernels<reprojection<camera::pinhole>, trivial>;
#ifdef ORBIS_COMPILED  // whose kernels it does not hold by themselves
template struct detail::bundle_kernels<reprojection<camera::pinhole>, huber>;
template struct detail::bundle_kernels<reprojection<camera::any_camera>, huber>;
#else
ORBIS_TEST_KERNELS(template, 6)
ORBIS_TEST_KERNELS(template, 9)
ORBIS_TEST_BUNDLE(template, reprojection<camera::pinhole>, huber)
ORBIS_TEST_BUNDLE(template, reprojection<camera::any_camera>, huber)
#endif

}  // namespace orbis::optimize
