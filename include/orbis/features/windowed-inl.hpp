// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of windowed.hpp.
#pragma once

#include <orbis/features/detail/match/hamming_listed.hpp>
#include <orbis/features/windowed.hpp>
