// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The kinds of filter, by name.
#pragma once

#include <string_view>

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

}  // namespace orbis::cloud
