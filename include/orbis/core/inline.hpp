// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `ORBIS_INLINE` marks a non-template function that is defined in an `x-inl.hpp`. In header-only use, `x.hpp` includes
/// that file at its end. With ORBIS_COMPILED, it does not: the function is in the library, whose sources
/// (`cmake/compiled`) include the file. In these sources, the attribute makes the compiler emit even functions that are
/// not called.
///
/// In header-only use, every includer compiles the body of such a function, even if it does not call it. If the body is
/// expensive, the function is declared with `ORBIS_LAZY` and defined with `ORBIS_LAZY_INLINE`: in header-only use it is
/// a template, which is compiled only where it is called. Calls look the same; to pass the function as an argument, use
/// a lambda expression. In `detail`, `template <class = void>` has the same purpose; a class whose members are
/// expensive is a class template `basic_x` with the alias `x`. None of this helps while a non-template function,
/// constructor or member initialiser that every includer compiles calls the function.
#pragma once

#ifdef ORBIS_COMPILED
#define ORBIS_INLINE [[gnu::used]] inline
#define ORBIS_LAZY
#define ORBIS_LAZY_INLINE ORBIS_INLINE
#else
#define ORBIS_INLINE inline
#define ORBIS_LAZY template <class = void>
#define ORBIS_LAZY_INLINE \
  template <class>        \
  inline
#endif
