// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A sequence of filters with their parameters, as chosen by the automatic selection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/statistical.hpp>

namespace orbis::cloud {

/// Kinds of filters, with the criterion by which they remove points.
enum class filter_mode {
  none,                   ///< keeps all (finite) points
  ray_evidence,           ///< depth rays of other views pass through the point
  statistical,            ///< mean neighbour distance above mu + alpha sigma
  radius,                 ///< fewer than a minimum number of neighbours within a radius
  log_statistical,        ///< log mean neighbour distance relative to its median over the cloud
  range_log_statistical,  ///< log mean neighbour distance relative to a line over log range
  local_log_statistical,  ///< log mean neighbour distance relative to that of the surroundings
  isolation,              ///< groups of a few points that are far from all others relative to the usual spacing
  cluster                 ///< small components of the neighbour graph that are far from the large ones
};

[[nodiscard]] constexpr std::string_view to_string(filter_mode mode) noexcept {
  switch (mode) {
    case filter_mode::none: return "none";
    case filter_mode::ray_evidence: return "ray-evidence";
    case filter_mode::statistical: return "statistical";
    case filter_mode::radius: return "radius";
    case filter_mode::log_statistical: return "log-statistical";
    case filter_mode::range_log_statistical: return "range-log-statistical";
    case filter_mode::local_log_statistical: return "local-log-statistical";
    case filter_mode::isolation: return "isolation";
    case filter_mode::cluster: return "cluster";
  }
  return "unknown";
}

/// Usual log spacing as a function of range: `intercept + slope * log(range)`.
struct log_line {
  double intercept = 0;
  double slope = 0;
  [[nodiscard]] double at(double log_range) const noexcept { return intercept + slope * log_range; }
};

/// Removes points that the views contradict: points that rays pass through and, with `need_support`, points that no
/// view measured. Stray pixels (`remove_stray_pixels`) do not count as measurements. Needs the views.
struct ray_step {
  ray_evidence_options evidence{.resolve_ghosts = false, .ratio = 0.5};
  std::vector<std::uint32_t> distrusted{};  ///< indices of the views that do not count as evidence
  bool need_support = false;                ///< true to remove points without support; for clouds built from the views
};

/// Criteria for neighbours that form a surface; density tests keep points on surfaces.
struct surface_test {
  double flatness = 0.15;   ///< maximum deviation from a plane, in units of the mean neighbour distance
  double same_scale = 0.7;  ///< neighbours whose log spacing is lower by more than this give no support
  std::size_t support = 3;  ///< supporting neighbours required among the nearest 8, unless the point is in a plane
};

/// Removes points whose log spacing exceeds the usual one by more than the threshold, unless they lie on a surface.
struct density_step {
  filter_mode mode = filter_mode::log_statistical;  ///< one of the three log-statistical modes
  std::size_t neighbors = 8;                        ///< number of neighbours over which the spacing is averaged; > 0
  log_line usual{};      ///< log spacing of the bulk as a function of log range; slope 0: constant
  double offset = 0;     ///< log spacing of the bulk relative to its surroundings, in the local mode
  double threshold = 0;  ///< outliers: log spacing - usual > threshold
  surface_test surface{};
  /// Usual log spacing on surfaces as a function of log range; neighbours that are not much sparser than this count as
  /// points on a surface. Empty: `usual`.
  std::optional<log_line> surface_spacing{};

  [[nodiscard]] const log_line& surface_line() const noexcept { return surface_spacing ? *surface_spacing : usual; }
};

/// Removes groups of fewer than `min_size` points whose distance to other points exceeds `reach` times the usual
/// spacing, or the spacing of the surroundings if that is larger.
struct isolation_step {
  std::size_t neighbors = 8;  ///< number of neighbours over which the spacing is averaged; > 0
  log_line usual{};           ///< log spacing of the bulk as a function of log range; slope 0: constant
  double offset = 0;          ///< log spacing of the bulk relative to its surroundings
  double reach = 2.5;
  std::size_t min_size = 30;
};

using filter_step =
    std::variant<ray_step, density_step, isolation_step, cluster_options, statistical_options, radius_options>;
/// Filters in order; each step tests the points that the previous ones kept. The density, isolation and cluster tests
/// share one neighbour search, among the points that remain before the first of these tests.
using filter_chain = std::vector<filter_step>;

[[nodiscard]] inline filter_mode step_mode(const filter_step& step) noexcept {
  return std::visit(
      [](const auto& s) {
        using S = std::remove_cvref_t<decltype(s)>;
        if constexpr (std::is_same_v<S, ray_step>) {
          return filter_mode::ray_evidence;
        } else if constexpr (std::is_same_v<S, density_step>) {
          return s.mode;
        } else if constexpr (std::is_same_v<S, isolation_step>) {
          return filter_mode::isolation;
        } else if constexpr (std::is_same_v<S, cluster_options>) {
          return filter_mode::cluster;
        } else if constexpr (std::is_same_v<S, statistical_options>) {
          return filter_mode::statistical;
        } else {
          static_assert(std::is_same_v<S, radius_options>, "step type without a mode");
          return filter_mode::radius;
        }
      },
      step);
}
[[deprecated("use step_mode")]] [[nodiscard]] inline filter_mode mode_of(const filter_step& step) noexcept {
  return step_mode(step);
}

/// Returns the names of the steps joined by plus signs, such as "range-log-statistical+cluster"; "none" for an empty
/// chain.
[[nodiscard]] inline std::string to_string(const filter_chain& chain) {
  if (chain.empty()) return std::string{to_string(filter_mode::none)};
  std::string out;
  for (const filter_step& step : chain) {
    if (!out.empty()) out += '+';
    out += to_string(step_mode(step));
  }
  return out;
}

}  // namespace orbis::cloud
