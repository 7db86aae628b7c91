// SPDX-License-Identifier: BSD-3-Clause
//
// Paths of a ball with a radius of 0.2 m through the known free space of a recording's map, between 100 random pairs of
// free places: median and 95th percentile of the time, and the mean of the length over the shortest that is known. That
// is the shortest of ours, and of what OMPL's BIT* finds within a second by the same exact tests, where OMPL is at
// hand.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#ifdef ORBIS_BENCH_WITH_OMPL
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/util/Console.h>

#include <orbis/interop/ompl.hpp>
#endif

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/path_search.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

constexpr double radius = 0.2;

using view_type = nav::planning_view<map>;
using pair_of_places = std::pair<vec3, vec3>;

#ifdef ORBIS_BENCH_WITH_OMPL
/// The length of what OMPL's BIT* finds within so many seconds; infinite if that is nothing.
double length_by_bit_star(const view_type& view, const octree::bounding_box& box, const pair_of_places& ends,
                          double seconds) {
  namespace ob = ompl::base;
  ompl::msg::noOutputHandler();
  const auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  ob::RealVectorBounds bounds{3};
  for (unsigned i = 0; i != 3; ++i) {
    bounds.setLow(i, box.min[static_cast<int>(i)]);
    bounds.setHigh(i, box.max[static_cast<int>(i)]);
  }
  space->setBounds(bounds);
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  interop::use_planning_space(information, view);
  information->setup();
  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<ob::RealVectorStateSpace> start{space}, goal{space};
  for (unsigned i = 0; i != 3; ++i) {
    start[i] = ends.first[static_cast<int>(i)];
    goal[i] = ends.second[static_cast<int>(i)];
  }
  problem->setStartAndGoalStates(start, goal);
  problem->setOptimizationObjective(std::make_shared<ob::PathLengthOptimizationObjective>(information));
  ompl::geometric::BITstar planner{information};
  planner.setProblemDefinition(problem);
  planner.setup();
  static_cast<ob::Planner&>(planner).solve(seconds);
  if (!problem->hasExactSolution()) return std::numeric_limits<double>::infinity();
  return problem->getSolutionPath()->as<ompl::geometric::PathGeometric>()->length();
}
#endif

/// A map with its field, pairs of places, and the length of the shortest path that is known for each.
struct planning_problem {
  map m;
  nav::distance_field field;
  view_type view;
  octree::bounding_box box;
  std::vector<pair_of_places> pairs;
  std::vector<double> shortest;
  double bit_star_over_shortest = 0.0;  ///< of those that it found, the sum
  std::size_t found_by_bit_star = 0;

  planning_problem(const std::vector<scan>& scans, double resolution)
      : m{whole_map(scans, resolution)}, field{m, {.reach = 1.0}}, view{m, field, radius}, box{m.bounds().value()} {
    random_bits random{1};
    const auto place = [&] {
      for (;;) {
        vec3 p;
        for (int i = 0; i != 3; ++i) p[i] = box.min[i] + random.uniform() * (box.max[i] - box.min[i]);
        if (view.is_free(p)) return p;
      }
    };
    while (pairs.size() != 100) {
      const vec3 a = place(), b = place();
      pairs.emplace_back(a, b);
    }
    for (const pair_of_places& p : pairs) {
      double least = std::numeric_limits<double>::infinity();
      for (const nav::path_method method : {nav::path_method::any_angle, nav::path_method::grid}) {
        const auto path = nav::find_path(view, p.first, p.second, {.method = method});
        if (path.status == nav::path_status::found) least = std::min(least, path.length);
      }
#ifdef ORBIS_BENCH_WITH_OMPL
      double peer = (p.second - p.first).norm();
      if (!view.is_free(p.first, p.second)) peer = length_by_bit_star(view, box, p, 1.0);
      least = std::min(least, peer);
      if (std::isfinite(peer)) ++found_by_bit_star, bit_star_over_shortest += peer / least;
#endif
      shortest.push_back(least);
    }
  }
  planning_problem(const planning_problem&) = delete;
  planning_problem& operator=(const planning_problem&) = delete;
};

const planning_problem& problem_of(const std::vector<scan>& (*scans)(), double resolution) {
  static std::map<std::pair<const std::vector<scan>*, double>, std::unique_ptr<planning_problem>> made;
  auto& p = made[{&scans(), resolution}];
  if (p == nullptr) p = std::make_unique<planning_problem>(scans(), resolution);
  return *p;
}

void bench_paths(benchmark::State& state, const planning_problem& problem, const nav::path_options& options) {
  for (auto _ : state) {
    std::vector<double> seconds;
    double over_shortest = 0.0;
    std::size_t found = 0, expanded = 0;
    for (std::size_t i = 0; i != problem.pairs.size(); ++i) {
      const auto& [from, to] = problem.pairs[i];
      const std::clock_t start = std::clock();
      const nav::found_path path = nav::find_path(problem.view, from, to, options);
      seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      expanded += path.expanded;
      if (path.status != nav::path_status::found) continue;
      ++found;
      over_shortest += path.length / problem.shortest[i];
    }
    state.counters["found"] = static_cast<double>(found);
    state.counters["expanded"] = static_cast<double>(expanded) / static_cast<double>(problem.pairs.size());
    state.counters["length_over_shortest"] = over_shortest / static_cast<double>(std::max<std::size_t>(1, found));
    if (problem.found_by_bit_star != 0)
      state.counters["bit_star_over_shortest"] =
          problem.bit_star_over_shortest / static_cast<double>(problem.found_by_bit_star);
    report_frames(state, std::move(seconds));
  }
}

[[maybe_unused]] const bool registered = [] {
  for_each_world("nav_path", [](const std::string& group, const std::vector<scan>& (*scans)(), double resolution) {
    const auto row = [](const std::string& row_name, auto body) { timed_by_itself(add_row(row_name, body), 3); };
    const auto ours = [&](const std::string& who, const nav::path_options& options) {
      row(group + who, [=](auto& s) { bench_paths(s, problem_of(scans, resolution), options); });
    };
    ours("/orbis", {});
    ours("/orbis_grid", {.method = nav::path_method::grid});
    ours("/orbis_grid_only", {.method = nav::path_method::grid, .shorten = false});
  });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
