// SPDX-License-Identifier: BSD-3-Clause
#ifndef ORBIS_COMPILED
#define ORBIS_INSTANTIATE_OPTIMIZE template
#include <orbis/optimize/detail/compiled/bundle_adjustment.hpp>
#endif
