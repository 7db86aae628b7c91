// SPDX-License-Identifier: BSD-3-Clause
//
// Insertion of one 640x480 depth frame at 30 Hz: by resolution and mode, as points and as a depth image.
#include "octree/insertion.hpp"

#include <algorithm>

namespace orbis::bench {

void report_frames(benchmark::State& state, std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  state.SetIterationTime(seconds[seconds.size() / 2]);
  state.counters["p95_ms"] = 1e3 * seconds[seconds.size() * 95 / 100];
  state.counters["frames"] = static_cast<double>(seconds.size());
}

double insert(octomap::OcTree& tree, const scan& s, const octree::integration_options& options) {
  const octomap::Pointcloud cloud = to_octomap(s.points());
  const double range = std::isinf(options.max_range) ? -1.0 : options.max_range;
  return seconds_of([&] {
    tree.insertPointCloud(cloud, to_octomap(s.origin()), range, false, options.mode == octree::ray_mode::discretized);
  });
}

void bench_octomap_insertion(benchmark::State& state, const insertion& what) {
  const std::vector<scan>& scans = what.scans();
  for (auto _ : state) {
    map ours{what.resolution};
    for (std::size_t i = 0; i != what.warm_up; ++i) insert(seq, ours, scans[i], input::points, what.options);
    octomap::OcTree theirs = to_octomap(ours);
    std::vector<double> seconds;
    for (std::size_t i = what.warm_up; i != what.warm_up + what.timed_octomap; ++i) {
      seconds.push_back(insert(theirs, scans[i], what.options));
      insert(seq, ours, scans[i], input::points, what.options);
    }
    report_frames(state, std::move(seconds));
    if (ot_bytes(ours) != ot_of(theirs)) state.SkipWithError("not our map");
  }
}

namespace {

using octree::ray_mode;

void add_rows(const std::string& group, const insertion& what) {
  timed_by_itself(add_row(group + "/orbis", [=](auto& s) { bench_insertion(s, seq, what, input::points); }), 3);
  timed_by_itself(add_row(group + "/orbis_depth", [=](auto& s) { bench_insertion(s, seq, what, input::depth); }), 3);
  timed_by_itself(add_row(group + "/octomap", [=](auto& s) { bench_octomap_insertion(s, what); }),
                  what.timed_octomap > 4 ? 2 : 1);
}

[[maybe_unused]] const bool registered = [] {
  struct cost {
    double resolution;
    std::size_t timed, octomap_every_ray, octomap_discretized;
  };
  for (const cost& c : {cost{0.10, 24, 8, 16}, cost{0.05, 24, 6, 12}, cost{0.02, 16, 3, 4}, cost{0.01, 8, 1, 2}}) {
    const auto rows = [&](const std::string& group, auto scans) {
      add_rows(group + "/every_ray", {.scans = scans,
                                      .resolution = c.resolution,
                                      .options = {.max_range = 5.0, .mode = ray_mode::every_ray},
                                      .timed = c.timed,
                                      .timed_octomap = c.octomap_every_ray});
      add_rows(group + "/discretized", {.scans = scans,
                                        .resolution = c.resolution,
                                        .options = {.max_range = 5.0, .mode = ray_mode::discretized},
                                        .timed = c.timed,
                                        .timed_octomap = c.octomap_discretized});
    };
    rows("octree_insert/" + in_centimetres(c.resolution), room);
    if (c.resolution < 0.1 && have_kitchen()) rows("octree_insert/kitchen/" + in_centimetres(c.resolution), kitchen);
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
