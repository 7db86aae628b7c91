// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A filter that chooses itself: the cloud is judged, and the choice comes with its evidence.
///
/// 1. *Views*, where there are any, know best: what their rays pass through is not there, and what only
///    a stray pixel or a view that contradicts all others has measured is not either.
/// 2. *Density*: a point's measure is how much sparser its surroundings are than usual, the logarithm of
///    its mean distance to a few neighbours less a reference: one for all points, or a line over the
///    logarithm of the range (a depth camera's points thin out with range); and the surroundings', where the
///    cloud itself is of uneven density. Outliers show as a second population of points that lie on no
///    surface; the threshold goes into the valley before it. Where there is none, only points far
///    outside the bulk go: a clean cloud stays as it is.
/// 3. *Connection*: groups of a few points with nothing around, and small clusters far from the surface.
///
/// Every step is part of the chosen chain only if it removes something.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/select/density_judge.hpp>
#include <orbis/cloud/detail/select/in_words.hpp>
#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/cloud/detail/select/view_judge.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// The inliers' indices, ascending, and the choice that led to them.
struct automatic_result {
  std::vector<std::uint32_t> inliers;
  filter_choice choice;
};

namespace detail {

/// What `judge` and `apply_chain` ask about views where there are none.
struct without_views {
  [[nodiscard]] bool operator()(std::span<char>, filter_choice&, std::vector<std::string>&) const noexcept {
    return true;
  }
  void operator()(const ray_step&, std::span<char>) const noexcept { assert(false && "a ray_step needs views"); }
};

template <point_range Points>
[[nodiscard]] std::vector<char> finite_points(const Points& points) {
  std::vector<char> out(std::ranges::size(points));
  for (std::size_t i = 0; i != out.size(); ++i) out[i] = is_finite(coordinates<float>(point_at(points, i))) ? 1 : 0;
  return out;
}

/// The ranges that are given, or those from the sensor's origin; empty where neither is known.
struct known_ranges {
  std::vector<float> own{};
  std::span<const float> all{};

  template <execution_policy Policy, point_range Points>
  known_ranges(const Policy& policy, const Points& points, const select_options& options) : all{options.ranges} {
    if (!all.empty() || (!options.sensor_origin && !stated_sensor_origin(points))) return;
    own = sensor_ranges(policy, points, {.common = options.sensor_origin});
    all = own;
  }
  known_ranges(const known_ranges&) = delete;
  known_ranges& operator=(const known_ranges&) = delete;
};

/// Points left, and with `non_finite::keep` those that are not finite.
template <point_range Points>
[[nodiscard]] std::vector<std::uint32_t> kept_points(const Points& points, std::span<const char> left,
                                                     const select_options& options) {
  return indices_where(left.size(), [&](std::size_t i) {
    return left[i] != 0 ||
           (options.non_finite == non_finite::keep && !is_finite(coordinates<float>(point_at(points, i))));
  });
}

inline void remove_gone(const surroundings& around, std::span<char> left) {
  for (std::size_t i = 0; i != around.size(); ++i) {
    if (around.gone()[i] != 0) left[around.index(i)] = 0;
  }
}

/// Runs a filter of its own on what is left, and clears `left` where it removes a point.
template <point_range Points, class Filter>
void apply_alone(const Points& points, std::span<char> left, Filter&& inliers_of) {
  std::vector<std::uint32_t> index;
  std::vector<std::array<float, 3>> rest;
  for (std::size_t i = 0; i != left.size(); ++i) {
    if (left[i] == 0) continue;
    index.push_back(static_cast<std::uint32_t>(i));
    rest.push_back(coordinates<float>(point_at(points, i)));
    left[i] = 0;
  }
  for (const std::uint32_t i : inliers_of(rest)) left[index[i]] = 1;
}

/// `apply_views(ray_step, left)` clears `left` where the views exclude a point.
template <execution_policy Policy, point_range Points, class Views>
[[nodiscard]] std::vector<std::uint32_t> apply_chain(const Policy& policy, const Points& points,
                                                     const filter_chain& chain, const select_options& options,
                                                     const Views& apply_views) {
  std::vector<char> left = finite_points(points);
  const known_ranges ranges{policy, points, options};
  std::optional<surroundings> around;
  std::size_t averaged = 0;  // neighbours, in `around`
  const auto settle = [&] {
    if (around) remove_gone(*around, left);
    around.reset();
  };
  const auto look_around = [&](std::size_t neighbors) -> surroundings& {
    if (around && averaged != neighbors) settle();
    if (!around) around.emplace(policy, points, left, ranges.all, averaged = neighbors);
    return *around;
  };
  for (const filter_step& any : chain) {
    std::visit(
        [&](const auto& step) {
          using Step = std::remove_cvref_t<decltype(step)>;
          if constexpr (std::is_same_v<Step, ray_step>) {
            settle();
            apply_views(step, left);
          } else if constexpr (std::is_same_v<Step, density_step> || std::is_same_v<Step, isolation_step>) {
            look_around(step.neighbors).apply(policy, step);
          } else if constexpr (std::is_same_v<Step, cluster_options>) {
            look_around(around ? averaged : step.neighbors).apply(policy, step);
          } else if constexpr (std::is_same_v<Step, statistical_options>) {
            settle();
            apply_alone(points, left, [&](const auto& rest) { return statistical_inliers(policy, rest, step); });
          } else {
            static_assert(std::is_same_v<Step, radius_options>, "a kind of step that is not applied");
            settle();
            apply_alone(points, left, [&](const auto& rest) { return radius_inliers(policy, rest, step); });
          }
        },
        any);
  }
  settle();
  return kept_points(points, left, options);
}

[[nodiscard]] inline std::string sentence_of(const filter_choice& choice, std::span<const std::string> reasons,
                                             bool by_range) {
  std::string out;
  for (const std::string& r : reasons) out += (out.empty() ? "" : "; ") + r;
  if (out.empty()) out = "no point stands out";
  out += " (median spacing " + in_words(1e3 * choice.evidence.median_spacing) + " mm";
  return out + (by_range ? ", which grows with range)" : ")");
}

/// `judge_by_views(left, choice, reasons)` does what judge_views does. False: cancelled.
template <execution_policy Policy, point_range Points, class Views>
[[nodiscard]] automatic_result judge(const Policy& policy, const Points& points, const select_options& options,
                                     const Views& judge_by_views) {
  assert(options.neighbors > 0);
  assert(options.ranges.empty() || options.ranges.size() == std::ranges::size(points));
  constexpr std::size_t enough = 50;
  automatic_result out;
  filter_choice& choice = out.choice;
  choice.evidence.points = std::ranges::size(points);
  std::vector<char> left = finite_points(points);
  choice.evidence.finite = static_cast<std::size_t>(std::ranges::count(left, char{1}));
  std::vector<std::string> reasons;
  if (!judge_by_views(left, choice, reasons)) {
    choice.chain.clear();
    choice.reason = "cancelled";
    out.inliers = kept_points(points, left, options);
    return out;
  }
  const known_ranges ranges{policy, points, options};
  surroundings around{policy, points, left, ranges.all, options.neighbors};
  bool ranged = false;
  for (std::size_t i = 0; i != around.size() && !ranged; ++i) ranged = around.has_range(i);
  for (std::size_t i = 0; i != around.size(); ++i) {
    const bool judged = std::isfinite(around.log_spacing()[i]) && (!ranged || around.has_range(i));
    choice.evidence.judged += judged ? 1 : 0;
  }
  if (choice.evidence.judged < enough) {
    if (reasons.empty()) reasons.push_back("too few points (" + std::to_string(choice.evidence.judged) + ") to judge");
    choice.reason = reasons.front();
  } else {
    judge_points(policy, around, options, choice, reasons);
    remove_gone(around, left);
    const bool by_range = std::ranges::any_of(
        choice.evidence.density, [](const auto& d) { return d.mode == filter_mode::range_log_statistical; });
    choice.reason = sentence_of(choice, reasons, by_range);
  }
  out.inliers = kept_points(points, left, options);
  return out;
}

}  // namespace detail

/// Judges the cloud by its points and by the depth images that it was made of, or that saw the same
/// place, and returns the points that the chosen filters keep. The images testify against points in
/// front of what they measured, which no density can show: moving objects, wrong poses.
///
/// Deterministic, the same for every policy. `on_progress` counts the views; if it cancels, the
/// chain is empty, the reason "cancelled", and all points stay. O(n log n + views (pixels + n)).
/// @pre neighbors > 0; ranges is empty or as long as points; views' images have the camera's size; samples, if there
/// are any, are of these views
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points, const Views& views,
                                                    const Camera& camera, const select_options& options = {},
                                                    progress on_progress = {}) {
  return detail::with_model(camera, [&](const auto& model) {
    return detail::judge(
        policy, points, options, [&](std::span<char> left, filter_choice& choice, std::vector<std::string>& reasons) {
          return detail::judge_views(policy, points, views, model, options, left, choice, reasons, on_progress);
        });
  });
}

/// Judges the cloud by its points alone. An empty cloud, or one too small to judge, gets an empty chain. O(n log n).
/// @pre neighbors > 0; ranges is empty or as long as points
template <execution_policy Policy, point_range Points>
[[nodiscard]] automatic_result filter_automatically(const Policy& policy, const Points& points,
                                                    const select_options& options = {}) {
  return detail::judge(policy, points, options, detail::without_views{});
}

/// Judges the cloud and says which filters suit it: `filter_automatically` without its inliers.
template <execution_policy Policy, point_range Points>
[[nodiscard]] filter_choice select_filter(const Policy& policy, const Points& points,
                                          const select_options& options = {}) {
  return filter_automatically(policy, points, options).choice;
}
/// Judges the cloud by its points and depth images, see `filter_automatically`.
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] filter_choice select_filter(const Policy& policy, const Points& points, const Views& views,
                                          const Camera& camera, const select_options& options = {},
                                          progress on_progress = {}) {
  return filter_automatically(policy, points, views, camera, options, on_progress).choice;
}

/// The indices, ascending, of the points that the steps of a chain leave, whoever made it. A chain from
/// `select_filter` leaves what `filter_automatically` does, point for point, if the ranges are given here as well.
/// `options`: where the cloud was seen from, and what becomes of points that are not finite.
/// @pre the chain has no `ray_step`; its steps' own preconditions
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> apply_filter(const Policy& policy, const Points& points,
                                                      const filter_chain& chain, const select_options& options = {}) {
  return detail::apply_chain(policy, points, chain, options, detail::without_views{});
}
/// Applies a chain that may ask depth images. If `on_progress`, which counts the views, cancels, what they say is left
/// out. @pre there are views if the chain has a `ray_step`
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<std::uint32_t> apply_filter(const Policy& policy, const Points& points,
                                                      const filter_chain& chain, const Views& views,
                                                      const Camera& camera, const select_options& options = {},
                                                      progress on_progress = {}) {
  return detail::with_model(camera, [&](const auto& model) {
    return detail::apply_chain(policy, points, chain, options, [&](const ray_step& step, std::span<char> left) {
      assert(std::ranges::size(views) != 0);
      bool cancelled = false;
      detail::apply_rays(policy, points, step, views, model, left, cancelled, on_progress);
    });
  });
}

}  // namespace orbis::cloud

#ifdef ORBIS_COMPILED
#include <orbis/cloud/detail/compiled/select.hpp>
#endif
