// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Evaluates a cloud against its views; the result is a step of a filter chain.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/cloud/detail/rays/view_trust.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// Number of points that a step removed, by reason.
struct ray_removals {
  std::size_t passed_through = 0;
  std::size_t unsupported = 0;
};

/// Sets `left` to 0 for the points that the counts exclude.
[[nodiscard]] inline ray_removals remove_by_rays(const std::vector<ray_evidence>& scores, const ray_step& step,
                                                 std::span<char> left) {
  ray_removals out;
  for (std::size_t i = 0; i != left.size(); ++i) {
    if (left[i] == 0) continue;
    const bool passed = is_passed_through(scores[i], step.evidence);
    const bool unsupported = !passed && step.need_support && scores[i].supported == 0;
    out.passed_through += passed ? 1 : 0;
    out.unsupported += unsupported ? 1 : 0;
    if (passed || unsupported) left[i] = 0;
  }
  return out;
}

/// Sets `left` to 0 for the points that the views exclude. If cancelled, removes nothing.
template <execution_policy Policy, posed_depth_range Views, camera::camera_model Camera>
ray_removals apply_rays(const Policy& policy, const point_view& points, const ray_step& step, const Views& views,
                        const Camera& camera, std::span<char> left, bool& cancelled, progress on_progress) {
  ray_evidence_counter<Camera> counter{policy, points, camera, step.evidence};
  view_cleaner cleaner;
  const std::size_t count = std::ranges::size(views);
  std::uint32_t number = 0;
  for (auto view = std::ranges::begin(views); view != std::ranges::end(views) && !cancelled; ++view, ++number) {
    if (!std::ranges::binary_search(step.distrusted, number))
      counter.add(policy, cleaner.clean(policy, *view, step.evidence));
    cancelled = !on_progress(number + 1, count);
  }
  return cancelled ? ray_removals{} : remove_by_rays(counter.scores(), step, left);
}

/// Tests whether a cloud was built from the given views: nearly every point of a sample is supported by a view.
template <camera::camera_model Camera>
class source_view_test {
 public:
  template <execution_policy Policy>
  source_view_test(const Policy& policy, const point_view& points, const Camera& camera,
                   const ray_evidence_options& options)
      : counter_{policy, take_sample(points), camera, options} {}

  template <execution_policy Policy, posed_depth View>
  void add(const Policy& policy, const View& view) {
    counter_.add(policy, view);
  }
  /// Returns true if the cloud was built from the views. @pre all views were added
  [[nodiscard]] bool passed() const {
    const std::vector<ray_evidence> scores = counter_.scores();
    const auto supported = std::ranges::count_if(scores, [](const ray_evidence& e) { return e.supported > 0; });
    return static_cast<double>(supported) >= 0.98 * static_cast<double>(scores.size());
  }

 private:
  [[nodiscard]] static std::vector<std::array<float, 3>> take_sample(const point_view& points) {
    constexpr std::size_t most = 4096;
    std::vector<std::array<float, 3>> sample;
    const std::size_t size = points.size();
    for (std::size_t i = 0; i < size; i += size / most + 1) {
      const std::array<float, 3> p = points[i];
      if (is_finite(p)) sample.push_back(p);
    }
    return sample;
  }
  ray_evidence_counter<Camera> counter_;
};

/// Evaluates a cloud against its views, sets `left` to 0 for the points that they exclude, and adds the step and its
/// evidence. Returns false if cancelled.
template <execution_policy Policy, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] bool judge_views(const Policy& policy, const point_view& points, const Views& views, const Camera& camera,
                               const select_options& options, std::span<char> left, filter_choice& choice,
                               progress on_progress) {
  filter_evidence& evidence = choice.evidence;
  evidence.views = std::ranges::size(views);
  if (evidence.views == 0) return true;
  ray_step step;
  bool cancelled = false;
  const std::size_t count = evidence.views;
  const auto watched = [&](std::size_t done, std::size_t) {
    cancelled = cancelled || !on_progress(done, count);
    return !cancelled;
  };
  // All views are counted, and the distrusted ones are subtracted afterwards, so that most views are read once.
  source_view_test<Camera> sources{policy, points, camera, step.evidence};
  ray_evidence_counter<Camera> counter{policy, points, camera, step.evidence};
  view_trust trust = find_distrusted_views(
      policy, views, camera, step.evidence, {}, watched,
      [&](const auto& view, const cleaned_view& cleaned, const depth_windows& windows) {
        sources.add(policy, view);
        counter.add(policy, windows, cleaned.T_world_camera);
      },
      options.samples);
  if (cancelled) return false;
  evidence.worst_conflict = trust.worst_conflict;
  evidence.usual_conflict = trust.usual_conflict;
  step.distrusted = std::move(trust.distrusted);
  step.need_support = sources.passed();
  ray_removals removed;
  constexpr std::size_t most_counted = std::numeric_limits<std::uint16_t>::max();
  if (count > most_counted && !step.distrusted.empty()) {  // counts may be saturated
    removed = apply_rays(policy, points, step, views, camera, left, cancelled, {});
  } else {
    view_cleaner cleaner;
    auto view = std::ranges::begin(views);
    std::uint32_t number = 0;
    for (const std::uint32_t wrong : step.distrusted) {
      for (; number != wrong; ++number) ++view;
      counter.remove(policy, cleaner.clean(policy, *view, step.evidence));
    }
    removed = remove_by_rays(counter.scores(), step, left);
  }
  const auto total = static_cast<double>(std::max<std::size_t>(evidence.finite, 1));
  evidence.passed_through = static_cast<double>(removed.passed_through) / total;
  evidence.unsupported = static_cast<double>(removed.unsupported) / total;
  if (removed.passed_through + removed.unsupported > 0) choice.chain.emplace_back(std::move(step));
  return true;
}

}  // namespace orbis::cloud::detail
