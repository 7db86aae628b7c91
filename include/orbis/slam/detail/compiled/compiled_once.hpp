// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `ORBIS_COMPILED_ONCE`: before a function that stands in a header of this folder. The function is inline, or, with
/// ORBIS_COMPILED, defined by the one source in cmake/compiled that includes its header.
#pragma once

#ifdef ORBIS_COMPILED
#define ORBIS_COMPILED_ONCE
#else
#define ORBIS_COMPILED_ONCE inline
#endif
