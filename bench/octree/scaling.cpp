// SPDX-License-Identifier: BSD-3-Clause
//
// How insertion grows with range, and shrinks with threads. (With resolution: see insertion.cpp.)
#include <limits>

#include "octree/insertion.hpp"

namespace orbis::bench {
namespace {

using octree::ray_mode;

[[maybe_unused]] const bool registered = [] {
  struct reach {
    const char* name;
    double metres;
  };
  for (const auto& [name, metres] :
       {reach{"2m", 2.0}, reach{"5m", 5.0}, reach{"unlimited", std::numeric_limits<double>::infinity()}}) {
    const insertion what{.options = {.max_range = metres}, .timed = 12, .timed_octomap = 4};
    const std::string group = "octree_insert_range/5cm/" + std::string{name};
    timed_by_itself(add_row(group + "/orbis", [=](auto& s) { bench_insertion(s, seq, what, input::points); }), 3);
    timed_by_itself(add_row(group + "/orbis_depth", [=](auto& s) { bench_insertion(s, seq, what, input::depth); }), 3);
    timed_by_itself(add_row(group + "/octomap", [=](auto& s) { bench_octomap_insertion(s, what); }), 1);
  }
  for (const double resolution : {0.05, 0.02})
    for (const input how : {input::points, input::depth}) {
      const insertion what{.resolution = resolution, .options = {.max_range = 5.0}, .timed = 12};
      const std::string group = "octree_insert_threads/" + in_centimetres(resolution) +
                                (how == input::points ? "/every_ray/points" : "/every_ray/depth");
      timed_by_itself(add_row(group + "/orbis", [=](auto& s) { bench_insertion(s, seq, what, how); }), 3);
      timed_by_itself(add_row(group + "/orbis_2_threads", [=](auto& s) { bench_insertion(s, par.with(2), what, how); }),
                      3);
    }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
