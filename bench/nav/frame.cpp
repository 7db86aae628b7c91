// SPDX-License-Identifier: BSD-3-Clause
//
// All that a frame costs a robot that plans: a depth image into the map, what has changed in it, and the distance field
// after that, beside OctoMap and DynamicEDT3D (B. Lau, C. Sprunk, W. Burgard, "Efficient grid-based spatial
// representations for robot navigation in dynamic environments", Robotics and Autonomous Systems 61, 2013), where that
// is installed. Theirs start from our map of the first frames. Of each the median over frames.
#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <dynamicEDT3D/dynamicEDTOctomap.h>

#include <orbis/nav/distance_field.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

constexpr double reach = 1.0;
constexpr std::size_t warm_up = 8, timed = 24, timed_octomap = 4;

void bench_frame(benchmark::State& state, const std::vector<scan>& scans, double resolution, octree::ray_mode mode) {
  const octree::integration_options options{.max_range = 5.0, .mode = mode};
  for (auto _ : state) {
    map m{resolution};
    m.track_changes();
    nav::distance_field field{m, {.reach = reach, .unknown = octree::occupancy::free}};
    std::vector<double> seconds;
    for (std::size_t i = 0; i != warm_up + timed; ++i) {
      const double inserted = insert(seq, m, scans[i], input::depth, options);
      const double updated = seconds_of([&] { field.update(m); });
      if (i >= warm_up) seconds.push_back(inserted + updated);
    }
    report_frames(state, std::move(seconds));
  }
}

void bench_frame_octomap(benchmark::State& state, const std::vector<scan>& scans, double resolution,
                         octree::ray_mode mode) {
  const octree::integration_options options{.max_range = 5.0, .mode = mode};
  for (auto _ : state) {
    map first{resolution};
    for (std::size_t i = 0; i != warm_up; ++i) insert(seq, first, scans[i], input::points, options);
    octomap::OcTree tree = to_octomap(first);
    // It has to be told its box: what these frames see, and the reach beside it.
    map all = first;
    for (std::size_t i = warm_up; i != warm_up + timed_octomap; ++i) insert(seq, all, scans[i], input::points, options);
    const auto bounds = all.bounds().value();
    const vec3f low = (bounds.min.array() - reach).cast<float>(), high = (bounds.max.array() + reach).cast<float>();
    DynamicEDTOctomap field{static_cast<float>(reach), &tree, to_octomap(low), to_octomap(high), false};
    field.update(true);
    std::vector<double> seconds;
    for (std::size_t i = warm_up; i != warm_up + timed_octomap; ++i) {
      const double inserted = insert(tree, scans[i], options);
      const double updated = seconds_of([&] { field.update(true); });
      seconds.push_back(inserted + updated);
    }
    report_frames(state, std::move(seconds));
  }
}

[[maybe_unused]] const bool registered = [] {
  for_each_world("nav_frame", [](const std::string& world, const std::vector<scan>& (*scans)(), double resolution) {
    for (const octree::ray_mode mode : {octree::ray_mode::discretized, octree::ray_mode::every_ray}) {
      const std::string group = world + (mode == octree::ray_mode::every_ray ? "/every_ray" : "/discretized");
      timed_by_itself(add_row(group + "/orbis", [=](auto& s) { bench_frame(s, scans(), resolution, mode); }), 3);
      timed_by_itself(add_row(group + "/octomap_dynamic_edt_3d",
                              [=](auto& s) { bench_frame_octomap(s, scans(), resolution, mode); }),
                      1);
    }
  });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
#endif
