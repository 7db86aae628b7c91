// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How good a trajectory and a map are, where the truth is known.
#pragma once

#include <functional>

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "results.hpp"
#include "source.hpp"

namespace app {

/// ATE after alignment by a rigid motion, and RPE from one pose to the next.
[[nodiscard]] orbis::result<accuracy> compare(const orbis::trajectory& estimate, const orbis::trajectory& truth,
                                              bool with_scale = false);

/// RMS distance of a cloud to the true surface, in metres; the cloud is brought into the truth's
/// world by the alignment of the trajectories.
[[nodiscard]] orbis::result<double> map_error(const orbis::point_cloud& cloud, const std::vector<std::uint32_t>& kept,
                                              const orbis::se3& T_truth_map,
                                              const std::function<double(const orbis::vec3&)>& surface_distance);

/// Fills in what the source's ground truth tells about `r`; says so where it tells nothing.
void compare_with_truth(results& r, const frame_source& source, console& console);

}  // namespace app
