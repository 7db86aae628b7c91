// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Evaluation of trajectories and maps.
///
/// | header | contents |
/// | --- | --- |
/// | `alignment.hpp` | pairing of the poses of two trajectories, and the transform between them |
/// | `ate.hpp` | absolute trajectory error |
/// | `rpe.hpp` | relative pose error |
/// | `orientations.hpp` | detection of reference trajectories without orientations |
/// | `cloud_error.hpp` | distances of points from the true surface |
/// | `scale.hpp` | scale error of a trajectory |
/// | `statistics.hpp` | mean, median, RMSE and other statistics of a list of errors |
#pragma once

#include <orbis/eval/alignment.hpp>
#include <orbis/eval/ate.hpp>
#include <orbis/eval/cloud_error.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/eval/rpe.hpp>
#include <orbis/eval/scale.hpp>
#include <orbis/eval/statistics.hpp>
