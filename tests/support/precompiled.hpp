// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What nearly every test includes; precompiled by the build. No test may rely on it: each includes what it uses.
#pragma once

#include <support/catch.hpp>
#include <support/precompiled_libraries.hpp>
