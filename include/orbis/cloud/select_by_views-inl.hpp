// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of select_by_views.hpp.
#pragma once

#include <cassert>
#include <span>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/select/view_judge.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/cloud/select_by_views.hpp>

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

template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
automatic_result filter_automatically(const Policy& policy, const Points& points, const Views& views,
                                      const Camera& camera, const select_options& options, progress on_progress) {
  assert(options.neighbors > 0);
  const auto& threads = detail::as_parallel(policy);
  const detail::viewed_points all{points};
  const detail::known_ranges ranges{threads, points, options};
  return camera::with_model(camera, [&](const auto& model) {
    const auto judge = [&](std::span<char> left, filter_choice& choice) {
      return detail::judge_views(threads, all, views, model, options, left, choice, on_progress);
    };
    return detail::choose_and_filter(threads, all, ranges.all, options, detail::make_view_judge(judge));
  });
}

}  // namespace orbis::cloud
