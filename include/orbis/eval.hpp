// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Judging trajectories and maps.
#pragma once

#include <orbis/eval/alignment.hpp>
#include <orbis/eval/ate.hpp>
#include <orbis/eval/cloud_error.hpp>
#include <orbis/eval/rpe.hpp>
#include <orbis/eval/statistics.hpp>
