// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `ORBIS_INLINE` marks a non-template function that is defined in an `x-inl.hpp`. In header-only use, `x.hpp` includes
/// that file at its end. With ORBIS_COMPILED, it does not: the function is in the library, whose sources
/// (`cmake/compiled`) include the file. In these sources, the attribute makes the compiler emit even functions that are
/// not called.
#pragma once

#ifdef ORBIS_COMPILED
#define ORBIS_INLINE [[gnu::used]] inline
#else
#define ORBIS_INLINE inline
#endif
