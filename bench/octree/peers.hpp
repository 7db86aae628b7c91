// SPDX-License-Identifier: BSD-3-Clause
//
// What the octree's benchmarks share: frames of a camera at 30 Hz, and the same map as ours and as
// OctoMap's.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include <benchmark/benchmark.h>
#include <octomap/octomap.h>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/occupancy_octree.hpp>

namespace orbis::bench {

using map = octree::occupancy_octree<>;

/// A depth image from a known place.
struct scan {
  image<std::uint16_t> depth;
  double depth_scale = 0.0;
  camera::any_camera camera;
  se3 T_world_camera;

  [[nodiscard]] camera::depth_view<std::uint16_t> depth_metres() const {
    return camera::depth_view<std::uint16_t>(depth.view(), depth_scale);
  }
  [[nodiscard]] vec3f origin() const { return T_world_camera.translation().cast<float>(); }
  [[nodiscard]] std::vector<vec3f> points() const;
};

/// The first 64 frames of a synthetic room, and of a real kitchen where it is at hand. Made when
/// first asked for.
[[nodiscard]] const std::vector<scan>& room();
[[nodiscard]] const std::vector<scan>& kitchen();
[[nodiscard]] bool have_kitchen();

[[nodiscard]] inline octomap::point3d to_octomap(const vec3f& p) { return {p.x(), p.y(), p.z()}; }
[[nodiscard]] octomap::Pointcloud to_octomap(const std::vector<vec3f>& points);

/// Our map as OctoMap's, with OctoMap's own parameters.
[[nodiscard]] octomap::OcTree to_octomap(const map& m);
/// OctoMap's `.ot` file of a tree: equal bytes are equal maps.
[[nodiscard]] std::string ot_of(const octomap::OcTree& tree);

/// The map of the first `frames` frames of the room, mode discretized, up to 5 m.
[[nodiscard]] const map& room_map(double resolution, int frames = 50);
[[nodiscard]] const octomap::OcTree& room_octomap(double resolution, int frames = 50);
/// Either of them.
template <class Map>
[[nodiscard]] const Map& room_as(double resolution) {
  if constexpr (std::is_same_v<Map, octomap::OcTree>)
    return room_octomap(resolution);
  else
    return room_map(resolution);
}

/// Nothing on standard error while this lives: OctoMap reports each file there.
class silence {
 public:
  silence();
  silence(const silence&) = delete;
  silence& operator=(const silence&) = delete;
  ~silence();

 private:
  int kept_;
};

/// "10cm", "5cm" ...
[[nodiscard]] std::string in_centimetres(double metres);

inline benchmark::internal::Benchmark* add_row(const std::string& name, std::function<void(benchmark::State&)> body) {
  return benchmark::RegisterBenchmark(name.c_str(), std::move(body))->Unit(benchmark::kMillisecond);
}

}  // namespace orbis::bench
