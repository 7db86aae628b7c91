// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_instances.hpp"

namespace orbis::optimize {

ORBIS_TEST_BUNDLE(template, bal_reprojection, huber)
ORBIS_TEST_BUNDLE(template, bal_reprojection, trivial)

}  // namespace orbis::optimize
