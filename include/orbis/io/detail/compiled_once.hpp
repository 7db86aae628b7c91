// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `ORBIS_COMPILED_IO_ONCE`: as `ORBIS_COMPILED_ONCE` (core/compiled_once.hpp), for the library orbis::compiled_io,
/// which stands apart from orbis::compiled as it needs image codecs.
#pragma once

#ifdef ORBIS_COMPILED_IO
#define ORBIS_COMPILED_IO_ONCE
#else
#define ORBIS_COMPILED_IO_ONCE inline
#endif
