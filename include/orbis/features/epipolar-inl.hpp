// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of epipolar.hpp.
#pragma once

#include <orbis/features/detail/match/hamming_listed.hpp>
#include <orbis/features/epipolar.hpp>
