// SPDX-License-Identifier: BSD-3-Clause
//
// The distance field that follows a map, beside DynamicEDT3D (B. Lau, C. Sprunk, W. Burgard, "Efficient grid-based
// spatial representations for robot navigation in dynamic environments", Robotics and Autonomous Systems 61, 2013),
// where it is installed: the update after each frame of a recording, and the field of the whole map made afresh.
// And beside the distance transform of P. F. Felzenszwalb and D. P. Huttenlocher over the whole box
// (bench/nav/box_distances.hpp), which is made afresh each time. DynamicEDT3D is told the box and the voxels that
// changed, and finding these is not counted; ours looks for them itself. Times are CPU time.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
#include <dynamicEDT3D/dynamicEDT3D.h>
#endif

#include <orbis/nav/distance_field.hpp>

#include "nav/box_distances.hpp"
#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

constexpr double reach = 1.0;

template <class Work>
[[nodiscard]] double cpu_seconds_of(Work&& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Calls after_frame(map) after each frame, with the changes tracked.
template <class AfterFrame>
void grow(const std::vector<scan>& scans, double resolution, AfterFrame&& after_frame) {
  map m{resolution};
  m.track_changes();
  for (const scan& s : scans) {
    m.integrate(s.depth_metres(), s.camera, s.T_world_camera, {.max_range = 5.0});
    after_frame(m);
  }
}

void bench_update(benchmark::State& state, const std::vector<scan>& scans, double resolution,
                  octree::occupancy unknown) {
  for (auto _ : state) {
    nav::distance_field field{octree::voxel_grid{resolution}, {.reach = reach, .unknown = unknown}};
    std::vector<double> seconds;
    grow(scans, resolution, [&](const map& m) { seconds.push_back(cpu_seconds_of([&] { field.update(m); })); });
    state.counters["MB"] = 1e-6 * static_cast<double>(field.memory_bytes());
    report_frames(state, std::move(seconds));
  }
}
void bench_afresh(benchmark::State& state, const std::vector<scan>& scans, double resolution,
                  octree::occupancy unknown) {
  const map m = whole_map(scans, resolution);
  for (auto _ : state) {
    const nav::distance_field field{m, {.reach = reach, .unknown = unknown}};
    state.counters["MB"] = 1e-6 * static_cast<double>(field.memory_bytes());
  }
}

/// The box around what is known and what the field reaches beside it.
octree::key_box box_of(const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  const auto bounds = m.bounds().value();
  return octree::keys_between(m.grid(), bounds.min.array() - reach, bounds.max.array() + reach).value();
}
std::array<int, 3> place_in(const octree::key_box& box, const octree::voxel_key& k) {
  return {static_cast<int>(k.x - box.low.x), static_cast<int>(k.y - box.low.y), static_cast<int>(k.z - box.low.z)};
}
int reach_in_voxels(double resolution) { return static_cast<int>(std::ceil(reach / resolution - 1e-9)); }
std::array<int, 3> size_of(const octree::key_box& box) {
  return place_in(box, {box.high.x + 1, box.high.y + 1, box.high.z + 1});
}
/// `f(place)` for the occupied voxels.
template <class F>
void for_each_occupied(const map& m, const octree::key_box& box, const F& f) {
  octree::for_each_octant(m, [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
    if (level != 2) return;  // no leaf of this map is larger
    for (std::uint64_t rest = s.occupied; rest != 0; rest &= rest - 1) {
      const octree::voxel_key o = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(rest)));
      f(place_in(box, {k.x + o.x, k.y + o.y, k.z + o.z}));
    }
  });
}
void bench_afresh_felzenszwalb(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const octree::key_box box = box_of(scans, resolution);
  const auto size = size_of(box);
  const map m = whole_map(scans, resolution);
  box_distances theirs{size};
  for (auto _ : state) {
    theirs.clear();
    for_each_occupied(m, box, [&](const std::array<int, 3>& p) { theirs.occupy(p); });
    theirs.transform();
  }
  const nav::distance_field ours{m, {.reach = reach, .unknown = octree::occupancy::free}};
  const int r = reach_in_voxels(resolution);
  std::size_t wrong = 0;
  for (int z = 0; z != size[2]; ++z)
    for (int y = 0; y != size[1]; ++y)
      for (int x = 0; x != size[0]; ++x) {
        const std::uint16_t found =
            ours.voxels().squared({box.low.x + static_cast<std::uint32_t>(x), box.low.y + static_cast<std::uint32_t>(y),
                                   box.low.z + static_cast<std::uint32_t>(z)});
        const float truth = theirs.squared({x, y, z});
        const bool is_far = truth > static_cast<float>(r * r);
        wrong += found == nav::squared_distances::far ? !is_far : static_cast<float>(found) != truth;
      }
  state.counters["ours_wrong"] = static_cast<double>(wrong);
  state.counters["MB"] = 1e-6 * static_cast<double>(theirs.bytes());
}

#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
/// For the size of what it keeps of a voxel; the heap's own overhead is not counted.
struct their_sizes : DynamicEDT3D {
  [[nodiscard]] static double megabytes(const std::array<int, 3>& size) {
    const double rows = static_cast<double>(size[0]) * size[1];
    return 1e-6 * (rows * size[2] * (sizeof(dataCell) + sizeof(bool)) + 2 * rows * sizeof(void*));
  }
};
void bench_update_dynamic_edt(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const octree::key_box box = box_of(scans, resolution);
  const auto size = size_of(box);
  const int r = reach_in_voxels(resolution);
  for (auto _ : state) {
    DynamicEDT3D theirs{r * r};
    theirs.initializeEmpty(size[0], size[1], size[2]);
    nav::distance_field ours{octree::voxel_grid{resolution}, {.reach = reach, .unknown = octree::occupancy::free}};
    std::unordered_map<std::uint64_t, std::uint64_t> occupied;
    std::uint64_t seen = 0;
    std::vector<double> seconds;
    grow(scans, resolution, [&](const map& m) {
      std::vector<std::pair<std::array<int, 3>, bool>> flips;
      octree::octant_reader read{m};
      m.changes().for_each_since(seen, [&](const octree::voxel_key& k, std::uint64_t) {
        std::uint64_t& before = occupied[octree::morton_code(k)];
        const std::uint64_t now = read(k).occupied;
        for (unsigned i = 0; i != 64; ++i)
          if (((before ^ now) >> i & 1U) != 0) {
            const octree::voxel_key o = octree::morton_key(i);
            flips.emplace_back(place_in(box, {k.x + o.x, k.y + o.y, k.z + o.z}), (now >> i & 1U) != 0);
          }
        before = now;
      });
      seen = m.changes().revision();
      seconds.push_back(cpu_seconds_of([&] {
        for (const auto& [p, is_occupied] : flips)
          is_occupied ? theirs.occupyCell(p[0], p[1], p[2]) : theirs.clearCell(p[0], p[1], p[2]);
        theirs.update(true);
      }));
      ours.update(m);
    });
    // How far they are from the truth, which ours is (tests/nav).
    std::size_t wrong = 0;
    for (int z = 0; z != size[2]; ++z)
      for (int y = 0; y != size[1]; ++y)
        for (int x = 0; x != size[0]; ++x) {
          const std::uint16_t truth = ours.voxels().squared({box.low.x + static_cast<std::uint32_t>(x),
                                                             box.low.y + static_cast<std::uint32_t>(y),
                                                             box.low.z + static_cast<std::uint32_t>(z)});
          const int found = theirs.getSQCellDistance(x, y, z);
          const bool is_far = found >= r * r;  // theirs does not tell these apart
          wrong += truth == nav::squared_distances::far || truth == r * r ? !is_far : found != truth;
        }
    state.counters["wrong"] = static_cast<double>(wrong);
    state.counters["MB"] = their_sizes::megabytes(size);
    report_frames(state, std::move(seconds));
  }
}
void bench_afresh_dynamic_edt(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const octree::key_box box = box_of(scans, resolution);
  const auto size = size_of(box);
  const int r = reach_in_voxels(resolution);
  const map m = whole_map(scans, resolution);
  for (auto _ : state) {
    DynamicEDT3D theirs{r * r};
    theirs.initializeEmpty(size[0], size[1], size[2]);
    for_each_occupied(m, box, [&](const std::array<int, 3>& p) { theirs.occupyCell(p[0], p[1], p[2]); });
    theirs.update(true);
    state.counters["MB"] = their_sizes::megabytes(size);
  }
}
#endif

[[maybe_unused]] const bool registered = [] {
  for_each_world(
      "nav_distance_field", [](const std::string& group, const std::vector<scan>& (*scans)(), double resolution) {
        const auto row = [](const std::string& row_name, auto body) { timed_by_itself(add_row(row_name, body), 3); };
        for (const octree::occupancy unknown : {octree::occupancy::free, octree::occupancy::occupied}) {
          const std::string how = unknown == octree::occupancy::free ? "_unknown_free" : "_unknown_occupied";
          row(group + "/update/orbis" + how, [=](auto& s) { bench_update(s, scans(), resolution, unknown); });
          add_row(group + "/afresh/orbis" + how, [=](auto& s) { bench_afresh(s, scans(), resolution, unknown); });
        }
        add_row(group + "/afresh/felzenszwalb", [=](auto& s) { bench_afresh_felzenszwalb(s, scans(), resolution); });
#ifdef ORBIS_BENCH_WITH_DYNAMIC_EDT
        row(group + "/update/dynamic_edt_3d", [=](auto& s) { bench_update_dynamic_edt(s, scans(), resolution); });
        add_row(group + "/afresh/dynamic_edt_3d", [=](auto& s) { bench_afresh_dynamic_edt(s, scans(), resolution); });
#endif
      });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
