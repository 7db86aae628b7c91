// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of ray_evidence.hpp.
#pragma once

#include <ranges>
#include <utility>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/ray_evidence_counter-inl.hpp>
#include <orbis/core/inline.hpp>

namespace orbis::cloud {

template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
std::vector<ray_evidence> ray_evidence_scores(const Policy& policy, const Points& points, const Views& views,
                                              const Camera& camera, const ray_evidence_options& options,
                                              progress on_progress) {
  return camera::with_model(camera, [&](const auto& model) {
    ray_evidence_counter counter{policy, points, model, options};
    std::size_t done = 0;
    const std::size_t total = (options.resolve_ghosts ? 2 : 1) * std::ranges::size(views);
    for (const auto& view : views) {
      counter.add(policy, view);
      if (!on_progress(++done, total)) return counter.scores();
    }
    if (options.resolve_ghosts) {
      for (const auto& view : views) {
        counter.review(policy, view);
        if (!on_progress(++done, total)) break;
      }
    }
    return counter.scores();
  });
}

ORBIS_LAZY_INLINE ray_evidence_result ray_evidence_decision(std::vector<ray_evidence> scores,
                                                            const ray_evidence_options& options) {
  ray_evidence_result out;
  for (std::size_t i = 0; i != scores.size(); ++i) {
    if (!is_passed_through(scores[i], options)) out.inliers.push_back(static_cast<std::uint32_t>(i));
    out.seen += scores[i].through != 0 || scores[i].supported != 0 ? 1 : 0;
  }
  out.scores = std::move(scores);
  return out;
}

template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
std::vector<std::uint32_t> ray_evidence_inliers(const Policy& policy, const Points& points, const Views& views,
                                                const Camera& camera, const ray_evidence_options& options,
                                                progress on_progress) {
  auto decided =
      ray_evidence_decision(ray_evidence_scores(policy, points, views, camera, options, on_progress), options);
  std::erase_if(decided.inliers,
                [&](std::uint32_t i) { return !is_finite(coordinates<float>(detail::point_at(points, i))); });
  return std::move(decided.inliers);
}

}  // namespace orbis::cloud
