// SPDX-License-Identifier: BSD-3-Clause
#include "filters.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

namespace app {
namespace {

using orbis::mapping::filter_kind;

struct named_filter {
  std::string_view name;
  filter_kind kind;
};
constexpr std::array filters{named_filter{"auto", filter_kind::automatic},
                             named_filter{"none", filter_kind::none},
                             named_filter{"statistical", filter_kind::statistical},
                             named_filter{"radius", filter_kind::radius},
                             named_filter{"log-statistical", filter_kind::log_statistical},
                             named_filter{"cluster", filter_kind::cluster},
                             named_filter{"ray-evidence", filter_kind::ray_evidence}};

}  // namespace

std::vector<std::string> filter_names() {
  std::vector<std::string> names;
  for (const named_filter& f : filters) names.emplace_back(f.name);
  return names;
}

orbis::mapping::filter_options filter_options(const settings& s) {
  orbis::mapping::filter_options options;
  const auto* const named =
      std::find_if(filters.begin(), filters.end(), [&](const auto& f) { return f.name == s.filter; });
  if (named != filters.end()) options.kind = named->kind;
  if (s.neighbors) {
    options.automatic.neighbors = *s.neighbors;
    options.statistical.neighbors = *s.neighbors;
    options.radius.min_neighbors = *s.neighbors;
    options.log_statistical.neighbors = *s.neighbors;
    options.cluster.neighbors = *s.neighbors;
  }
  options.statistical.sigma_multiplier = s.sigma;
  options.radius.radius = s.radius;
  return options;
}

std::string describe_filter(const settings& s) {
  const orbis::mapping::filter_options options = filter_options(s);
  char text[128];
  switch (options.kind) {
    case filter_kind::statistical:
      std::snprintf(text, sizeof text, ", %zu neighbours, sigma %g", options.statistical.neighbors, s.sigma);
      return s.filter + text;
    case filter_kind::radius:
      std::snprintf(text, sizeof text, ", %zu neighbours within %g m", options.radius.min_neighbors, s.radius);
      return s.filter + text;
    default: return s.filter;
  }
}

}  // namespace app
