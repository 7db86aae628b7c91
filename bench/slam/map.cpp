// SPDX-License-Identifier: BSD-3-Clause
//
// What a keyframe and a frame cost the map as it grows: a long walk in which each keyframe shows most of what the ten
// before it showed. All rows should stay level from a hundred keyframes to thousands, but for `recount`, which finds
// the neighbours of a keyframe by counting over all keyframes, and for those over the whole map.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/map_file.hpp>

namespace {

using namespace orbis;

constexpr std::uint32_t keypoints = 300, fresh = 30;

slam::frame next_frame(const slam::map& m, random_bits& random) {
  slam::frame f;
  f.index = m.keyframe_end().value();
  f.T_world_camera = se3(so3{}, vec3(0.05 * static_cast<double>(f.index), 0.0, 0.0));
  f.features.keypoints.resize(keypoints);
  f.features.descriptors.resize(keypoints);
  for (std::uint32_t i = 0; i != keypoints; ++i) {
    f.features.keypoints[i].x = static_cast<float>(random.uniform(0.0, 640.0));
    f.features.keypoints[i].y = static_cast<float>(random.uniform(0.0, 480.0));
    for (auto& w : f.features.descriptors[i].words) w = random();
  }
  f.depth.assign(keypoints, 2.0F);
  f.rays.assign(keypoints, vec3(0.1, 0.1, 1.0));
  f.landmarks.assign(keypoints, slam::no_id);
  if (!m.keyframes().empty()) {
    const auto& last = m.keyframes().back().landmarks;
    for (std::uint32_t i = fresh; i != keypoints; ++i) f.landmarks[i - fresh] = last[i];
  }
  return f;
}

void add_keyframe(slam::map& m, random_bits& random) {
  const auto id = m.add_keyframe(next_frame(m, random));
  for (std::uint32_t i = 0; i != keypoints; ++i) {
    if (m.at(id).landmarks[i] == slam::no_id) {
      m.add_landmark(id, i);
    } else {
      m.update_landmark(m.at(id).landmarks[i]);
    }
  }
}

const slam::map& walk(std::size_t length) {
  static std::map<std::size_t, slam::map> walks;
  const auto [at, is_new] = walks.try_emplace(length, 8, 1.2);
  random_bits random(1);
  if (is_new)
    for (std::size_t i = 0; i != length; ++i) add_keyframe(at->second, random);
  return at->second;
}

template <class Work>
void add_row(const std::string& what, std::size_t length, Work&& work) {
  benchmark::RegisterBenchmark(("slam_map/" + what + "/" + std::to_string(length) + "_keyframes/orbis").c_str(),
                               [=](benchmark::State& state) { work(state, walk(length)); })
      ->Unit(benchmark::kMicrosecond);
}

[[maybe_unused]] const bool registered = [] {
  for (const std::size_t length : {std::size_t{100}, std::size_t{1000}, std::size_t{4000}}) {
    add_row("local_landmarks", length, [](benchmark::State& state, const slam::map& m) {
      random_bits random(2);
      const slam::frame f = next_frame(m, random);
      const auto reference = m.keyframes().back().id;
      for (auto _ : state) benchmark::DoNotOptimize(slam::detail::local_landmarks(m, f, reference, 40));
    });
    add_row("neighbors", length, [](benchmark::State& state, const slam::map& m) {
      const auto k = m.keyframes().back().id;
      for (auto _ : state) benchmark::DoNotOptimize(m.covisibility().neighbors(k));
    });
    add_row("neighbors_recount", length, [](benchmark::State& state, const slam::map& m) {
      const auto& seen = m.keyframes().back().landmarks;
      for (auto _ : state) {
        std::vector<std::uint32_t> shared(m.keyframe_end().value(), 0);
        for (const slam::landmark_id l : seen)
          for (const slam::observation& o : m.landmark_at(l).observations) ++shared[o.keyframe.value()];
        std::vector<slam::covisible> found;
        for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k)
          if (shared[k.value()] >= 15) found.push_back({k, shared[k.value()]});
        std::sort(found.begin(), found.end(), slam::stronger);
        benchmark::DoNotOptimize(found);
      }
    });
    add_row("add_and_cull_keyframe", length, [](benchmark::State& state, const slam::map& m) {
      slam::map grown = m;
      random_bits random(3);
      for (auto _ : state) {
        add_keyframe(grown, random);
        const auto newest = grown.keyframes().back().id;
        slam::detail::cull_landmarks(grown, newest, {});
        slam::detail::cull_keyframes(grown, newest, 3.2, {}, [](slam::keyframe_id) { return false; });
      }
    });
    add_row("essential_graph", length, [](benchmark::State& state, const slam::map& m) {
      for (auto _ : state) benchmark::DoNotOptimize(slam::detail::essential_graph(m));
    });
    add_row("file", length, [](benchmark::State& state, const slam::map& m) {
      for (auto _ : state) {
        const std::string bytes = slam::map_bytes(m);
        benchmark::DoNotOptimize(slam::parse_map(std::as_bytes(std::span{bytes})));
        state.counters["bytes_per_keyframe"] =
            static_cast<double>(bytes.size()) / static_cast<double>(m.keyframes().size());
      }
    });
  }
  return true;
}();

}  // namespace
