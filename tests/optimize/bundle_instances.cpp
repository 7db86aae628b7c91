// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_TEST_INSTANCES template
#ifndef ORBIS_COMPILED
#define ORBIS_INSTANTIATE_OPTIMIZE template
#endif
#include "bundle_instances.hpp"
