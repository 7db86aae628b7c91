// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Accuracy of trajectory and map against ground truth.
#pragma once

#include <functional>

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "results.hpp"
#include "source.hpp"

namespace app {

/// ATE after rigid alignment (with scale if `with_scale`), and RPE between consecutive poses.
[[nodiscard]] orbis::result<accuracy> compare(const orbis::trajectory& estimate, const orbis::trajectory& truth,
                                              bool with_scale = false);

/// RMS distance of a cloud from the true surface, in metres; `T_truth_map` transforms the cloud into the world frame of
/// the ground truth.
[[nodiscard]] orbis::result<double> map_error(const orbis::point_cloud& cloud, const std::vector<std::uint32_t>& kept,
                                              const orbis::se3& T_truth_map,
                                              const std::function<double(const orbis::vec3&)>& surface_distance);

/// Compares `r` with the source's ground truth; fills in the results, or the reason why there is no comparison.
void compare_with_truth(results& r, const frame_source& source, console& console);

}  // namespace app
