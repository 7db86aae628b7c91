// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Automatic selection of filters for a cloud and the depth images that show it.
#pragma once

#include <cassert>
#include <span>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/select/view_judge.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

namespace detail {

/// Wraps a function object as a `view_judge`.
template <class F>
[[nodiscard]] view_judge make_view_judge(const F& judge) {
  return {&judge, [](const void* context, std::span<char> left, filter_choice& choice) {
            return (*static_cast<const F*>(context))(left, choice);
          }};
}

}  // namespace detail

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
                                                    progress on_progress = {}) {
  assert(options.neighbors > 0);
  const auto& threads = detail::as_parallel(policy);
  const detail::viewed_points all{points};
  const detail::known_ranges ranges{threads, points, options};
  return detail::with_model(camera, [&](const auto& model) {
    const auto judge = [&](std::span<char> left, filter_choice& choice) {
      return detail::judge_views(threads, all, views, model, options, left, choice, on_progress);
    };
    return detail::choose_and_filter(threads, all, ranges.all, options, detail::make_view_judge(judge));
  });
}

}  // namespace orbis::cloud
