// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_TEST_BAL_INSTANCES template
#include "bundle_instances.hpp"
