// SPDX-License-Identifier: BSD-3-Clause
//
// Paths of a ball with a radius of 0.2 m through the known free space of a recording's map, between 100 random pairs of
// free places: median and 95th percentile, and how much longer a path is than the straight line on average.
#include <algorithm>
#include <cstddef>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/path_search.hpp>

#include "octree_insertion.hpp"
#include "octree_support.hpp"

namespace orbis::bench {
namespace {

constexpr double radius = 0.2;

void bench_paths(benchmark::State& state, const std::vector<scan>& scans, double resolution, bool shorten) {
  map m{resolution};
  for (const scan& s : scans) m.integrate(s.depth_metres(), s.camera, s.T_world_camera, {.max_range = 5.0});
  const nav::distance_field field{m, {.reach = 1.0}};
  const nav::planning_view view{m, field, radius};
  const octree::bounding_box box = m.bounds().value();
  random_bits random{1};
  const auto place = [&] {
    for (;;) {
      vec3 p;
      for (int i = 0; i != 3; ++i) p[i] = box.min[i] + random.uniform() * (box.max[i] - box.min[i]);
      if (view.is_free(p)) return p;
    }
  };
  std::vector<std::pair<vec3, vec3>> pairs;
  while (pairs.size() != 100) {
    const vec3 a = place(), b = place();
    pairs.emplace_back(a, b);
  }
  for (auto _ : state) {
    std::vector<double> seconds;
    double longer = 0.0;
    std::size_t found = 0, expanded = 0;
    for (const auto& [a, b] : pairs) {
      const std::clock_t start = std::clock();
      const nav::found_path path = nav::find_path(view, a, b, {.shorten = shorten});
      seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      expanded += path.expanded;
      if (path.status != nav::path_status::found) continue;
      ++found;
      longer += path.length / (b - a).norm();
    }
    state.counters["found"] = static_cast<double>(found);
    state.counters["expanded"] = static_cast<double>(expanded) / 100.0;
    state.counters["length_over_straight"] = longer / static_cast<double>(std::max<std::size_t>(1, found));
    report_frames(state, std::move(seconds));
  }
}

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const std::string& name, const std::vector<scan>& (*scans)()) {
    for (const double resolution : {0.05, 0.02}) {
      const std::string group = "nav_path/" + name + "/" + in_centimetres(resolution);
      const auto row = [](const std::string& row_name, auto body) { timed_by_itself(add_row(row_name, body), 3); };
      row(group + "/orbis", [=](auto& s) { bench_paths(s, scans(), resolution, true); });
      row(group + "/orbis_grid_only", [=](auto& s) { bench_paths(s, scans(), resolution, false); });
    }
  };
  add("room", room);
  if (have_kitchen()) add("kitchen", kitchen);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
