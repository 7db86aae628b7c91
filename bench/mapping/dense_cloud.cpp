// SPDX-License-Identifier: BSD-3-Clause
//
// Keyframes added to a dense cloud, moved, and read back; the peer is what one would write at first:
// every point un-projected and its sums, in doubles, put into a std::unordered_map.
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <string>
#include <unordered_map>
#include <vector>

#include <benchmark/benchmark.h>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/dense_cloud.hpp>

#include "mapping/depth_keyframes.hpp"

namespace {

using orbis::bench::depth_keyframes;

/// By hand.
class plain_cloud {
 public:
  explicit plain_cloud(double size) : size_{size} {}
  void add_keyframe(const orbis::mapping::keyframe<>& k, const orbis::camera::pinhole& camera, int stride) {
    const orbis::mat4 T = k.T_world_camera.to_matrix();
    for (int y = 0; y < camera.height(); y += stride) {
      for (int x = 0; x < camera.width(); x += stride) {
        const double z = k.depth(x, y);
        if (z <= 0 || z > 4) continue;
        const orbis::vec3 p{(x - camera.k().cx) / camera.k().fx * z, (y - camera.k().cy) / camera.k().fy * z, z};
        const orbis::vec3 w = T.topLeftCorner<3, 3>() * p + T.topRightCorner<3, 1>();
        std::uint64_t key = 0;
        for (Eigen::Index a = 0; a != 3; ++a) {
          const auto cell = static_cast<std::int64_t>(std::floor(w[a] / size_));
          key = key << 21U | (static_cast<std::uint64_t>(cell) & 0x1fffffU);
        }
        sum& s = voxels_[key];
        s.position += w;
        const orbis::rgb8 c = k.color(x, y);
        s.color += orbis::vec3(c.r, c.g, c.b);
        s.range = std::min(s.range, p.norm());
        s.count += 1;
      }
    }
  }
  [[nodiscard]] std::size_t size() const { return voxels_.size(); }

 private:
  struct sum {
    orbis::vec3 position = orbis::vec3::Zero();
    orbis::vec3 color = orbis::vec3::Zero();
    double range = 1e9;
    double count = 0;
  };
  double size_;
  std::unordered_map<std::uint64_t, sum> voxels_;
};

/// All keyframes once; the time is that of one of them.
template <class Add>
void each_keyframe(benchmark::State& state, std::size_t count, Add&& add_keyframe) {
  std::size_t i = 0;
  for (auto _ : state) {
    add_keyframe(i % count);
    ++i;
  }
}

void add(int stride, double voxel) {
  const std::string size = std::to_string(static_cast<int>(std::lround(1000 * voxel)));
  const std::string group = "dense_cloud_splice/640x480/stride:" + std::to_string(stride) + "/mm:" + size + "/";
  const auto row = [](const std::string& name, auto run) {
    benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  const orbis::mapping::dense_options options{.stride = stride, .voxel_size = voxel};
  const auto ours = [=](const auto& policy) {
    return [=](benchmark::State& state) {
      const depth_keyframes& scene = depth_keyframes::room();
      orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, options};
      for (std::size_t i = 0; i != scene.size(); ++i) dense.add_keyframe(policy, scene.keyframe(i));
      each_keyframe(state, scene.size(), [&](std::size_t i) { dense.add_keyframe(policy, scene.keyframe(i)); });
      state.counters["voxels"] = static_cast<double>(dense.size());
      state.counters["bytes_per_voxel"] = static_cast<double>(dense.memory_bytes()) / static_cast<double>(dense.size());
    };
  };
  row(group + "orbis", ours(orbis::seq));
  row(group + "orbis_par2", ours(orbis::par.with(2)));
  if (voxel > 0) {
    row(group + "unordered_map", [=](benchmark::State& state) {
      const depth_keyframes& scene = depth_keyframes::room();
      plain_cloud plain{voxel};
      for (std::size_t i = 0; i != scene.size(); ++i) plain.add_keyframe(scene.keyframe(i), scene.camera, stride);
      each_keyframe(state, scene.size(),
                    [&](std::size_t i) { plain.add_keyframe(scene.keyframe(i), scene.camera, stride); });
      state.counters["voxels"] = static_cast<double>(plain.size());
    });
    // What a correction costs: as much as splicing twice.
    row("dense_cloud_move/640x480/stride:" + std::to_string(stride) + "/mm:" + size + "/orbis",
        [=](benchmark::State& state) {
          const depth_keyframes& scene = depth_keyframes::room();
          orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, options};
          for (std::size_t i = 0; i != scene.size(); ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
          bool there = false;
          each_keyframe(state, scene.size(), [&](std::size_t i) {
            auto k = scene.keyframe(i);
            if (i == 0) there = !there;
            if (there) k.T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{0.02, 0.01, 0}} * k.T_world_camera;
            dense.move(orbis::seq, k, i);
          });
        });
    row("dense_cloud_read/640x480/stride:" + std::to_string(stride) + "/mm:" + size + "/orbis",
        [=](benchmark::State& state) {
          const depth_keyframes& scene = depth_keyframes::room();
          orbis::mapping::dense_cloud dense{orbis::camera::ray_table{scene.camera}, options};
          for (std::size_t i = 0; i != scene.size(); ++i) dense.add_keyframe(orbis::seq, scene.keyframe(i));
          for (auto _ : state) benchmark::DoNotOptimize(dense.cloud());
          state.counters["voxels"] = static_cast<double>(dense.size());
        });
  }
}

const bool registered = [] {
  for (const int stride : {1, 2}) {
    for (const double voxel : {0.01, 0.05}) add(stride, voxel);
  }
  add(2, 0.0);
  return true;
}();

}  // namespace
