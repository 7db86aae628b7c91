// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Judging trajectories and maps.
///
/// | header | what it is for |
/// | --- | --- |
/// | `alignment.hpp` | poses of two trajectories that belong together, and the transform between them |
/// | `ate.hpp` | absolute trajectory error |
/// | `rpe.hpp` | relative pose error |
/// | `cloud_error.hpp` | distances of points to the true surface |
/// | `scale.hpp` | by how much a trajectory is too large or too small |
/// | `statistics.hpp` | mean, median, RMSE and more of a list of errors |
#pragma once

#include <orbis/eval/alignment.hpp>
#include <orbis/eval/ate.hpp>
#include <orbis/eval/cloud_error.hpp>
#include <orbis/eval/rpe.hpp>
#include <orbis/eval/scale.hpp>
#include <orbis/eval/statistics.hpp>
