// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of stereo.hpp.
#pragma once

#include <orbis/features/detail/match/hamming_listed.hpp>
#include <orbis/features/detail/match/slide_differences.hpp>
#include <orbis/features/stereo.hpp>
