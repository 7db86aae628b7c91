// SPDX-License-Identifier: BSD-3-Clause
//
// What a robot of 0.2 m radius does with paths between random free places of a recording's map: makes trajectories,
// keeps its path while the map changes beside it, finds another one when it is blocked, and looks for the next view.
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/nav/next_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/replanning.hpp>
#include <orbis/nav/robot_trajectory.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

/// A map that records its changes, with its field.
struct world {
  map m;
  nav::distance_field field;

  world(const std::vector<scan>& scans, double resolution) : m{whole_map(scans, resolution)}, field{m, {.reach = 1.0}} {
    m.track_changes();
    field.update(m);
  }
  [[nodiscard]] nav::planning_view<map> view() const { return {m, field, 0.2}; }
};

vec3 free_place(const world& w, random_bits& random) {
  const auto box = w.m.bounds().value();
  for (;;) {
    vec3 p;
    for (int i = 0; i != 3; ++i) p[i] = box.min[i] + random.uniform() * (box.max[i] - box.min[i]);
    if (w.view().is_free(p)) return p;
  }
}
/// Ways of more than one segment.
std::vector<std::vector<vec3>> paths_in(const world& w, std::size_t count) {
  random_bits random{1};
  std::vector<std::vector<vec3>> paths;
  for (std::size_t tries = 0; paths.size() != count && tries != 100 * count; ++tries) {
    const vec3 from = free_place(w, random), to = free_place(w, random);
    auto path = nav::find_path(w.view(), from, to, {.method = nav::path_method::grid});
    if (path.status == nav::path_status::found && path.points.size() > 2) paths.push_back(std::move(path.points));
  }
  return paths;
}

void bench_trajectory(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const world w{scans, resolution};
  const auto paths = paths_in(w, 20);
  for (auto _ : state) {
    std::vector<double> seconds;
    for (const auto& path : paths)
      seconds.push_back(seconds_of([&] { benchmark::DoNotOptimize(nav::make_trajectory(w.view(), path).duration()); }));
    report_frames(state, std::move(seconds));
  }
}

/// An octant becomes occupied, in the middle of each path or in the corner of the map, and is as before afterwards.
void bench_replanning(benchmark::State& state, const std::vector<scan>& scans, double resolution, bool touched) {
  world w{scans, resolution};
  const auto paths = paths_in(w, 20);
  const octree::voxel_key corner = w.m.grid().key(w.m.bounds().value().min).value();
  for (auto _ : state) {
    std::vector<double> seconds;
    std::size_t planned = 0;
    for (const auto& path : paths) {
      nav::replanner planner{path.back()};
      planner.update(w.view(), path.front());
      const auto& points = planner.path().points;
      const octree::voxel_key middle =
          w.m.grid().key(vec3{0.5 * (points[points.size() / 2 - 1] + points[points.size() / 2])}).value();
      const octree::voxel_key changed = touched ? middle : corner;
      octree::block<float> before;
      w.m.edit_octant(changed, [&](octree::block<float>& b) {
        before = b;
        b.known = ~std::uint64_t{0};
        b.value.fill(1.0F);
      });
      w.field.update(w.m);
      seconds.push_back(seconds_of([&] { planner.update(w.view(), path.front()); }));
      planned += planner.planned() - 1;
      w.m.edit_octant(changed, [&](octree::block<float>& b) { b = before; });
      w.field.update(w.m);
    }
    if (planned != (touched ? paths.size() : 0)) state.SkipWithError("not planned again when it should be");
    report_frames(state, std::move(seconds));
  }
}

void bench_next_view(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const world w{scans, resolution};
  const nav::frontiers frontiers{w.m};
  const auto places = nav::candidate_viewpoints(frontiers.clusters({.min_size = 20}), w.m.grid());
  random_bits random{1};
  const vec3 from = free_place(w, random);
  for (auto _ : state)
    scans.front().camera.visit([&](const auto& camera) {
      benchmark::DoNotOptimize(nav::next_best_view(w.view(), places, camera, from).status);
    });
  state.counters["places"] = static_cast<double>(places.size());
}

[[maybe_unused]] const bool registered = [] {
  for_each_world("nav_motion", [](const std::string& group, const std::vector<scan>& (*scans)(), double resolution) {
    const auto row = [&](const std::string& name, auto body) {
      timed_by_itself(add_row(group + name, [=](auto& s) { body(s, scans()); }), 3);
    };
    row("/trajectory/orbis", [=](auto& s, const auto& all) { bench_trajectory(s, all, resolution); });
    row("/replanning_untouched/orbis", [=](auto& s, const auto& all) { bench_replanning(s, all, resolution, false); });
    row("/replanning_touched/orbis", [=](auto& s, const auto& all) { bench_replanning(s, all, resolution, true); });
    add_row(group + "/next_view/orbis", [=](auto& s) { bench_next_view(s, scans(), resolution); })->Iterations(1);
  });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
