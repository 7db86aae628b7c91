// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of select.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/select/density_judge.hpp>
#include <orbis/cloud/detail/select/in_words.hpp>
#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/cloud/detail/select/view_judge.hpp>
#include <orbis/cloud/radius-inl.hpp>
#include <orbis/cloud/ray_evidence-inl.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical-inl.hpp>

namespace orbis::cloud {

namespace detail {

[[nodiscard]] inline std::vector<char> finite_points(const point_view& points) {
  std::vector<char> out(points.size());
  for (std::size_t i = 0; i != out.size(); ++i) out[i] = is_finite(points[i]) ? 1 : 0;
  return out;
}

/// Points left, and with `non_finite::keep` those that are not finite.
[[nodiscard]] inline std::vector<std::uint32_t> kept_points(const point_view& points, std::span<const char> left,
                                                            const select_options& options) {
  return indices_where(left.size(), [&](std::size_t i) {
    return left[i] != 0 || (options.non_finite == non_finite::keep && !is_finite(points[i]));
  });
}

inline void remove_gone(const surroundings& around, std::span<char> left) {
  for (std::size_t i = 0; i != around.size(); ++i) {
    if (around.gone()[i] != 0) left[around.index(i)] = 0;
  }
}

/// Runs a filter of its own on what is left, and clears `left` where it removes a point.
template <class Filter>
void apply_alone(const point_view& points, std::span<char> left, Filter&& inliers_of) {
  std::vector<std::uint32_t> index;
  std::vector<std::array<float, 3>> rest;
  for (std::size_t i = 0; i != left.size(); ++i) {
    if (left[i] == 0) continue;
    index.push_back(static_cast<std::uint32_t>(i));
    rest.push_back(points[i]);
    left[i] = 0;
  }
  for (const std::uint32_t i : inliers_of(rest)) left[index[i]] = 1;
}

template <execution_policy Policy>
std::vector<std::uint32_t> apply_chain(const Policy& policy, const point_view& points, std::span<const float> ranges,
                                       const filter_chain& chain, const select_options& options,
                                       const view_filter& views) {
  std::vector<char> left = finite_points(points);
  std::optional<surroundings> around;
  std::size_t averaged = 0;  // neighbours, in `around`
  const auto settle = [&] {
    if (around) remove_gone(*around, left);
    around.reset();
  };
  const auto look_around = [&](std::size_t neighbors) -> surroundings& {
    if (around && averaged != neighbors) settle();
    if (!around) around.emplace(policy, points, left, ranges, averaged = neighbors);
    return *around;
  };
  for (const filter_step& any : chain) {
    std::visit(
        [&](const auto& step) {
          using Step = std::remove_cvref_t<decltype(step)>;
          if constexpr (std::is_same_v<Step, ray_step>) {
            settle();
            assert(views.run != nullptr && "a ray_step needs views");
            if (views.run != nullptr) views.run(views.context, step, left);
          } else if constexpr (std::is_same_v<Step, density_step> || std::is_same_v<Step, isolation_step>) {
            look_around(step.neighbors).apply(policy, step);
          } else if constexpr (std::is_same_v<Step, cluster_options>) {
            look_around(around ? averaged : step.neighbors).apply(policy, step);
          } else if constexpr (std::is_same_v<Step, statistical_options>) {
            settle();
            apply_alone(points, left, [&](const auto& rest) {
              return filter_statistically(policy, rest, step, progress{})->inliers;
            });
          } else {
            static_assert(std::is_same_v<Step, radius_options>, "a kind of step that is not applied");
            settle();
            apply_alone(points, left,
                        [&](const auto& rest) { return *find_radius_inliers(policy, rest, step, progress{}); });
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
  for (const std::string& r : reasons) {
    if (!out.empty()) out += "; ";
    out += r;
  }
  if (out.empty()) out = "no point stands out";
  return joined({out, " (median spacing ", in_words(1e3 * choice.evidence.median_spacing), " mm",
                 by_range ? ", which grows with range)" : ")"});
}

template <execution_policy Policy>
automatic_result choose_and_filter(const Policy& policy, const point_view& points, std::span<const float> ranges,
                                   const select_options& options, const view_judge& views) {
  constexpr std::size_t enough = 50;
  automatic_result out;
  filter_choice& choice = out.choice;
  choice.evidence.points = points.size();
  std::vector<char> left = finite_points(points);
  choice.evidence.finite = static_cast<std::size_t>(std::ranges::count(left, char{1}));
  std::vector<std::string> reasons;
  if (views.run != nullptr && !views.run(views.context, left, choice, reasons)) {
    choice.chain.clear();
    choice.reason = "cancelled";
    out.inliers = kept_points(points, left, options);
    return out;
  }
  surroundings around{policy, points, left, ranges, options.neighbors};
  bool ranged = false;
  for (std::size_t i = 0; i != around.size() && !ranged; ++i) ranged = around.has_range(i);
  for (std::size_t i = 0; i != around.size(); ++i) {
    const bool judged = std::isfinite(around.log_spacing()[i]) && (!ranged || around.has_range(i));
    choice.evidence.judged += judged ? 1 : 0;
  }
  if (choice.evidence.judged < enough) {
    if (reasons.empty())
      reasons.push_back(joined({"too few points (", std::to_string(choice.evidence.judged), ") to judge"}));
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

/// The two functions that a choice, or a chain, calls with views.
template <class F>
[[nodiscard]] view_judge judge_of(const F& judge) {
  return {&judge,
          [](const void* context, std::span<char> left, filter_choice& choice, std::vector<std::string>& reasons) {
            return (*static_cast<const F*>(context))(left, choice, reasons);
          }};
}
template <class F>
[[nodiscard]] view_filter filter_of(const F& filter) {
  return {&filter, [](const void* context, const ray_step& step, std::span<char> left) {
            (*static_cast<const F*>(context))(step, left);
          }};
}

}  // namespace detail

template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
automatic_result filter_automatically(const Policy& policy, const Points& points, const Views& views,
                                      const Camera& camera, const select_options& options, progress on_progress) {
  assert(options.neighbors > 0);
  const auto& threads = detail::threads_of(policy);
  const detail::viewed_points all{points};
  const detail::known_ranges ranges{threads, points, options};
  return detail::with_model(camera, [&](const auto& model) {
    const auto judge = [&](std::span<char> left, filter_choice& choice, std::vector<std::string>& reasons) {
      return detail::judge_views(threads, all, views, model, options, left, choice, reasons, on_progress);
    };
    return detail::choose_and_filter(threads, all, ranges.all, options, detail::judge_of(judge));
  });
}

template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
std::vector<std::uint32_t> apply_filter(const Policy& policy, const Points& points, const filter_chain& chain,
                                        const Views& views, const Camera& camera, const select_options& options,
                                        progress on_progress) {
  const auto& threads = detail::threads_of(policy);
  const detail::viewed_points all{points};
  const detail::known_ranges ranges{threads, points, options};
  return detail::with_model(camera, [&](const auto& model) {
    const auto filter = [&](const ray_step& step, std::span<char> left) {
      assert(std::ranges::size(views) != 0);
      bool cancelled = false;
      detail::apply_rays(threads, all, step, views, model, left, cancelled, on_progress);
    };
    return detail::apply_chain(threads, all, ranges.all, chain, options, detail::filter_of(filter));
  });
}

}  // namespace orbis::cloud
