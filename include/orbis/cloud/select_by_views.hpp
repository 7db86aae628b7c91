// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Automatic selection of filters for a cloud and the depth images that show it.
///
/// With orbis::compiled, include select_by_views-inl.hpp: the library cannot contain this function, as the type of the
/// views belongs to the program.
#pragma once

#include <orbis/camera/model.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// Selects filters from the points and from depth images, from which the cloud was built or which show the same scene.
/// Returns the points that the chosen filters keep. The images reveal false points in front of their measurements, such
/// as points on moving objects or from wrong poses, which the density does not reveal.
///
/// Deterministic and the same for every policy. `on_progress` counts the views; if it cancels, the chain is empty, the
/// status is `cancelled`, and all points are kept. O(n log n + views (pixels + n)).
/// @pre neighbors > 0; ranges is empty or as long as points; views' images have the camera's size; samples, if given,
/// are from these views
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points, const Views& views,
                                                    const Camera& camera, const select_options& options = {},
                                                    progress on_progress = {});

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/select_by_views-inl.hpp>
#endif
