// SPDX-License-Identifier: BSD-3-Clause
//
// The occupancy octree beside OctoMap: insertion of one depth frame, search, rays, leaves and files.
// The frames come from a synthetic recording at 30 Hz; every row inserts the same ones, in turn, into
// a map that has seen them, as a camera that moves slowly would.
#include <cstddef>
#include <iosfwd>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <octomap/octomap.h>
#include <unistd.h>

#include <orbis/core/random.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/octree.hpp>

namespace {

using namespace orbis;
using octree::ray_mode;

struct scan {
  std::vector<vec3f> points;
  octomap::Pointcloud cloud;
  vec3f origin;
};

const std::vector<scan>& scans() {
  static const std::vector<scan> made = [] {
    constexpr std::size_t count = 4;
    const io::synthetic_recording room{{.frames = 400}};
    std::vector<scan> all(count);
    for (std::size_t i = 0; i != count; ++i) {
      const auto frame = room.frame(i).value();
      room.camera().model.visit([&](const auto& camera) {
        octree::append_world_points(frame.depth_metres(), camera, *frame.T_world_camera, all[i].points);
      });
      for (const vec3f& p : all[i].points) all[i].cloud.push_back(p.x(), p.y(), p.z());
      all[i].origin = frame.T_world_camera->translation().cast<float>();
    }
    return all;
  }();
  return made;
}

void insert(octree::occupancy_octree<>& map, const scan& s, ray_mode mode) {
  map.integrate(s.points, s.origin, {.max_range = 5.0, .mode = mode});
}
void insert(octomap::OcTree& map, const scan& s, ray_mode mode) {
  map.insertPointCloud(s.cloud, {s.origin.x(), s.origin.y(), s.origin.z()}, 5.0, false, mode == ray_mode::discretized);
}

template <class Map>
const Map& built_map(double resolution) {
  static std::vector<std::pair<double, std::unique_ptr<Map>>> maps;
  for (const auto& [r, map] : maps)
    if (r == resolution) return *map;
  auto map = std::make_unique<Map>(resolution);
  for (int round = 0; round != 3; ++round)
    for (const scan& s : scans()) insert(*map, s, ray_mode::discretized);
  maps.emplace_back(resolution, std::move(map));
  return *maps.back().second;
}

template <class Map>
void bench_insert(benchmark::State& state, double resolution, ray_mode mode) {
  Map map{built_map<Map>(resolution)};
  std::size_t i = 0, points = 0;
  for (auto _ : state) {
    const scan& s = scans()[i++ % scans().size()];
    insert(map, s, mode);
    points += s.points.size();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
}

/// Points all over the room, in random order or along lines.
std::vector<vec3f> query_points(bool coherent) {
  random_bits random{1};
  std::vector<vec3f> points;
  while (points.size() < 100000) {
    const auto at = [&] { return static_cast<float>(random.uniform(-3.0, 3.0)); };
    const vec3f a{at(), at(), at()}, b{at(), at(), at()};
    const int steps = coherent ? 100 : 1;
    for (int i = 0; i != steps; ++i) points.emplace_back(a + (b - a) * (static_cast<float>(i) * 0.01F));
  }
  return points;
}

template <class Map>
void bench_search(benchmark::State& state, double resolution, bool coherent) {
  const Map& map = built_map<Map>(resolution);
  const auto points = query_points(coherent);
  for (auto _ : state) {
    std::size_t occupied = 0;
    for (const vec3f& p : points) {
      if constexpr (std::is_same_v<Map, octomap::OcTree>) {
        const auto* node = map.search(octomap::point3d{p.x(), p.y(), p.z()});
        occupied += node != nullptr && map.isNodeOccupied(node) ? 1 : 0;
      } else {
        occupied += map.state(p) == octree::occupancy::occupied ? 1 : 0;
      }
    }
    benchmark::DoNotOptimize(occupied);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * points.size()));
}

template <class Map>
void bench_cast_ray(benchmark::State& state, double resolution) {
  const Map& map = built_map<Map>(resolution);
  const scan& s = scans().front();
  for (auto _ : state) {
    double sum = 0.0;
    for (std::size_t i = 0; i < s.points.size(); i += 97) {
      const vec3f direction = s.points[i] - s.origin;
      if constexpr (std::is_same_v<Map, octomap::OcTree>) {
        octomap::point3d end;
        if (map.castRay({s.origin.x(), s.origin.y(), s.origin.z()}, {direction.x(), direction.y(), direction.z()}, end,
                        true, 5.0))
          sum += static_cast<double>(end.x());
      } else if (const auto hit = map.cast_ray(s.origin, direction, 5.0, true)) {
        sum += hit.point.x();
      }
    }
    benchmark::DoNotOptimize(sum);
  }
}

template <class Map>
void bench_leaves(benchmark::State& state, double resolution) {
  const Map& map = built_map<Map>(resolution);
  for (auto _ : state) {
    double volume = 0.0;
    const auto add = [&](double size, bool occupied) { volume += occupied ? size * size * size : 0.0; };
    if constexpr (std::is_same_v<Map, octomap::OcTree>) {
      for (auto it = map.begin_leafs(), end = map.end_leafs(); it != end; ++it)
        add(it.getSize(), map.isNodeOccupied(*it));
    } else {
      map.for_each_leaf([&](const auto& leaf) { add(leaf.size, leaf.occupied); });
    }
    benchmark::DoNotOptimize(volume);
  }
}

/// Nothing on standard error while this lives.
class silence {
 public:
  silence() : kept_{dup(STDERR_FILENO)} {
    if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
      dup2(nowhere, STDERR_FILENO);
      close(nowhere);
    }
  }
  silence(const silence&) = delete;
  silence& operator=(const silence&) = delete;
  ~silence() {
    dup2(kept_, STDERR_FILENO);
    close(kept_);
  }

 private:
  int kept_;
};

template <class Map>
void bench_write_bt(benchmark::State& state, double resolution) {
  Map map{built_map<Map>(resolution)};
  const silence octomap_reports_each_file;
  for (auto _ : state) {
    std::ostringstream out;
    if constexpr (std::is_same_v<Map, octomap::OcTree>) {
      state.PauseTiming();
      octomap::OcTree copy{map};  // writing changes an OctoMap tree
      state.ResumeTiming();
      copy.writeBinary(out);
    } else {
      if (!write_bt(map, static_cast<std::ostream&>(out))) state.SkipWithError("not written");
    }
    benchmark::DoNotOptimize(out);
  }
}

template <class Map>
void register_rows(const std::string& who) {
  const auto add = [&](const std::string& name, auto body) {
    benchmark::RegisterBenchmark((name + "/" + who).c_str(), body)->Unit(benchmark::kMillisecond);
  };
  for (const auto& [name, resolution] : {std::pair{std::string{"10cm"}, 0.10}, std::pair{std::string{"5cm"}, 0.05},
                                         std::pair{std::string{"2cm"}, 0.02}}) {
    const double r = resolution;
    add("octree_insert/" + name + "/every_ray", [r](auto& s) { bench_insert<Map>(s, r, ray_mode::every_ray); });
    add("octree_insert/" + name + "/discretized", [r](auto& s) { bench_insert<Map>(s, r, ray_mode::discretized); });
    add("octree_search/" + name + "/random", [r](auto& s) { bench_search<Map>(s, r, false); });
    add("octree_search/" + name + "/coherent", [r](auto& s) { bench_search<Map>(s, r, true); });
    add("octree_cast_ray/" + name, [r](auto& s) { bench_cast_ray<Map>(s, r); });
    add("octree_leaves/" + name, [r](auto& s) { bench_leaves<Map>(s, r); });
    add("octree_write_bt/" + name, [r](auto& s) { bench_write_bt<Map>(s, r); });
  }
}

[[maybe_unused]] const bool registered = [] {
  register_rows<octree::occupancy_octree<>>("orbis");
  register_rows<octomap::OcTree>("octomap");
  return true;
}();

}  // namespace
