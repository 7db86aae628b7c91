// SPDX-License-Identifier: BSD-3-Clause
//
// Inserting frames one after the other, as a camera that moves slowly delivers them, and timing each.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/octree/files.hpp>

#include "octree/peers.hpp"

namespace orbis::bench {

/// How the frames are handed over.
enum class input { points, depth };

struct insertion {
  const std::vector<scan>& (*scans)() = room;
  double resolution = 0.05;
  octree::integration_options options{.max_range = 5.0};
  /// Not timed: the first frames, after which what is free is free for good.
  std::size_t warm_up = 8;
  std::size_t timed = 24;         ///< frames of ours
  std::size_t timed_octomap = 8;  ///< the first of these; OctoMap takes seconds for some
};

/// The row's time is the median over the frames, `p95_ms` the time that one in twenty exceeds.
void report_frames(benchmark::State& state, std::vector<double> seconds);

/// Seconds that `work` takes.
template <class Work>
[[nodiscard]] double seconds_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Inserts a frame; the time it takes.
template <class Policy>
double insert(const Policy& policy, map& m, const scan& s, input how, const octree::integration_options& options) {
  if (how == input::points) {
    const std::vector<vec3f> points = s.points();
    return seconds_of([&] { m.integrate(policy, points, s.origin(), options); });
  }
  return s.camera.visit([&](const auto& camera) {
    return seconds_of([&] { m.integrate(policy, s.depth_metres(), camera, s.T_world_camera, options); });
  });
}
double insert(octomap::OcTree& tree, const scan& s, const octree::integration_options& options);

template <class Policy>
void bench_insertion(benchmark::State& state, const Policy& policy, const insertion& what, input how) {
  const std::vector<scan>& scans = what.scans();
  for (auto _ : state) {
    map ours{what.resolution};
    std::vector<double> seconds;
    for (std::size_t i = 0; i != what.warm_up + what.timed; ++i) {
      const double took = insert(policy, ours, scans[i], how, what.options);
      if (i >= what.warm_up) seconds.push_back(took);
    }
    report_frames(state, std::move(seconds));
  }
  if (how == input::points && policy.threads() == 1) return;  // OctoMap's row compares with this one
  map ours{what.resolution}, reference{what.resolution};
  for (std::size_t i = 0; i != 3; ++i) {
    insert(policy, ours, scans[i], how, what.options);
    insert(seq, reference, scans[i], input::points, what.options);
  }
  if (ot_bytes(ours) != ot_bytes(reference)) state.SkipWithError("not the map of the points on one thread");
}

/// The map of all frames, from their depth images.
[[nodiscard]] inline map whole_map(const std::vector<scan>& scans, double resolution) {
  map m{resolution};
  for (const scan& s : scans) m.integrate(s.depth_metres(), s.camera, s.T_world_camera, {.max_range = 5.0});
  return m;
}

/// Calls `add(group, scans, resolution)` for the room and, where it is at hand, the kitchen, with voxels of 5 and 2 cm;
/// `group`: for the names of the rows.
template <class Add>
void for_each_world(const std::string& bench, Add&& add) {
  const auto with = [&](const std::string& name, const std::vector<scan>& (*scans)()) {
    for (const double resolution : {0.05, 0.02})
      add(bench + "/" + name + "/" + in_centimetres(resolution), scans, resolution);
  };
  with("room", room);
  if (have_kitchen()) with("kitchen", kitchen);
}

/// OctoMap starts from our map of the first frames, and must end with ours.
void bench_octomap_insertion(benchmark::State& state, const insertion& what);

/// One row's settings: the body is one iteration that times its frames itself.
inline void timed_by_itself(benchmark::internal::Benchmark* row, int repetitions) {
  row->UseManualTime()->Iterations(1)->Repetitions(repetitions);
}

}  // namespace orbis::bench
