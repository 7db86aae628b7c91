// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of brute_force.hpp.
#pragma once

#include <orbis/features/brute_force.hpp>
#include <orbis/features/detail/match/hamming_nearest.hpp>
