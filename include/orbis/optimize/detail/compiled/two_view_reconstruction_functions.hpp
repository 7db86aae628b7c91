// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The reconstruction of two_view.hpp: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/optimize_two_view.cpp.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view.hpp>

namespace orbis::optimize::detail {

ORBIS_COMPILED_ONCE result<two_view_reconstruction> reconstruction_of_matches(const std::vector<image_match>& matches,
                                                                              std::size_t n,
                                                                              const two_view_options& options) {
  constexpr const char* where = "two views";
  if (matches.size() < std::max<std::size_t>(options.min_points, 8))
    return fail(errc::no_data, where,
                "of " + std::to_string(n) + " matches " + std::to_string(matches.size()) + " can be used, " +
                    std::to_string(std::max<std::size_t>(options.min_points, 8)) + " are needed");
  auto motion = essential_of_matches(matches, n, {.threshold = 2.0, .max_iterations = options.max_iterations});
  if (!motion) return fail(std::move(motion.error()));
  two_view_reconstruction out;
  out.inliers = motion->inliers.size();
  std::vector<double> depths;
  std::vector<std::pair<std::uint32_t, vec3>> found;
  for (const image_match& m : matches) {
    if (!std::binary_search(motion->inliers.begin(), motion->inliers.end(), m.original)) continue;
    const triangulation t = triangulate(se3(), m.first.direction(), motion->T_first_second, m.second.direction(),
                                        {.min_parallax = options.min_parallax});
    if (!t.ok()) continue;
    found.emplace_back(m.original, t.point);
    depths.push_back(t.point.z());
  }
  if (found.size() < options.min_points || 2 * found.size() < out.inliers)
    return fail(errc::degenerate, where, "too little parallax");
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2), depths.end());
  const double unit = 1.0 / depths[depths.size() / 2];
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [match, point] : found) {
    out.matches.push_back(match);
    out.points.push_back(unit * point);
  }
  out.parallax = motion->parallax;
  out.rmse = motion->rmse;
  out.T_first_second = se3(motion->T_first_second.rotation(), unit * motion->T_first_second.translation());
  return out;
}

}  // namespace orbis::optimize::detail
