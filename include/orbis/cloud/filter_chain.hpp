// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Several filters in order, with their parameters: what the automatic selection chooses.
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

/// The kinds of filter.
enum class filter_mode {
  none,                   ///< everything (finite) stays
  ray_evidence,           ///< what other views' depth rays pass through goes
  statistical,            ///< mu + alpha sigma of the mean neighbour distance
  radius,                 ///< a number of neighbours within a radius
  log_statistical,        ///< log mean neighbour distance against its median over the cloud
  range_log_statistical,  ///< log mean neighbour distance against a line over log range
  local_log_statistical,  ///< log mean neighbour distance against that of the surroundings
  isolation,              ///< groups of a few points away from everything by what is usual
  cluster                 ///< small components of the neighbour graph far from the large ones
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

/// `intercept + slope * log(range)`: the log spacing that is usual at a range.
struct log_line {
  double intercept = 0;
  double slope = 0;
  [[nodiscard]] double at(double log_range) const noexcept { return intercept + slope * log_range; }
};

/// Removes what the views exclude: points that rays pass through, and with `need_support` points that
/// no view measured, stray pixels (`remove_stray_pixels`) not counted. Needs the views.
struct ray_step {
  ray_evidence_options evidence{.resolve_ghosts = false, .ratio = 0.5};
  std::vector<std::uint32_t> distrusted{};  ///< views, by number, that count as no evidence
  bool need_support = false;                ///< the cloud was made of these views: each point is in one at least
};

/// When neighbours count as a surface: points on one are spared by the tests of density.
struct surface_test {
  double flatness = 0.15;   ///< `off_plane` up to here is a plane
  double same_scale = 0.7;  ///< neighbours denser by more, log, do not speak for a point,
  std::size_t support = 3;  ///< and so many of the nearest 8 have to, unless it lies in a plane itself
};

/// Removes points whose log spacing exceeds what is usual by more than the threshold, unless they lie on a surface.
struct density_step {
  filter_mode mode = filter_mode::log_statistical;  ///< or range_log_statistical, local_log_statistical
  std::size_t neighbors = 8;                        ///< over which the spacing is averaged; > 0
  log_line usual{};                                 ///< log spacing of the bulk at a log range; slope 0: at any
  double offset = 0;                                ///< of the local mode's bulk from its surroundings
  double threshold = 0;                             ///< outliers: log spacing - usual > threshold
  surface_test surface{};
  /// Log spacing of surfaces at a log range, by which neighbours count as one; empty: what is `usual`.
  std::optional<log_line> surface_spacing{};

  [[nodiscard]] const log_line& surface_line() const noexcept { return surface_spacing ? *surface_spacing : usual; }
};

/// Removes groups of fewer than `min_size` points that are further from others than `reach` times the
/// usual spacing, that of the surroundings if it is larger.
struct isolation_step {
  std::size_t neighbors = 8;  ///< over which the spacing is averaged; > 0
  log_line usual{};           ///< log spacing of the bulk at a log range; slope 0: at any
  double offset = 0;          ///< of the bulk from its surroundings, log
  double reach = 2.5;
  std::size_t min_size = 30;
};

using filter_step =
    std::variant<ray_step, density_step, isolation_step, cluster_options, statistical_options, radius_options>;
/// Each step judges what the ones before it left. The tests of density, isolation and clusters share one
/// pass over the neighbours of what there was before the first of them.
using filter_chain = std::vector<filter_step>;

[[nodiscard]] inline filter_mode mode_of(const filter_step& step) noexcept {
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
          static_assert(std::is_same_v<S, radius_options>, "a kind of step that has no mode");
          return filter_mode::radius;
        }
      },
      step);
}

/// The names of the steps with a plus between them, such as "range-log-statistical+cluster"; "none" for no step.
[[nodiscard]] inline std::string to_string(const filter_chain& chain) {
  if (chain.empty()) return std::string{to_string(filter_mode::none)};
  std::string out;
  for (const filter_step& step : chain) {
    if (!out.empty()) out += '+';
    out += to_string(mode_of(step));
  }
  return out;
}

}  // namespace orbis::cloud
