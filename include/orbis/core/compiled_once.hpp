// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `ORBIS_COMPILED_ONCE`: before a function in `<component>/detail/compiled/*_functions.hpp`. The function is inline, or,
/// with ORBIS_COMPILED, defined by the one source in cmake/compiled that includes its header. For functions that are no
/// templates and cost time to compile: every includer would compile them, whether it calls them or not.
#pragma once

#ifdef ORBIS_COMPILED
#define ORBIS_COMPILED_ONCE
#else
#define ORBIS_COMPILED_ONCE inline
#endif
