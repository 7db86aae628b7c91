// SPDX-License-Identifier: BSD-3-Clause
//
// A live map that follows corrected poses, beside a map rebuilt from the same depth images and poses, by us and by
// OctoMap. 100 keyframes of a recording; before the correction they have drifted, up to 10 cm and 2 degrees at the last
// one. One iteration is one whole correction, checked for equal bytes. Times are CPU time, but for rows with threads.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/synthetic.hpp>
#include <orbis/mapping/depth_store.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/octree/files.hpp>

#include "mapping/memory_depths.hpp"
#include "octree/insertion.hpp"

namespace orbis::bench {
namespace {

/// Depth images compressed, as by default; or as they are, in memory.
template <class Depths = mapping::depth_store>
using live = mapping::live_map<map, camera::pinhole, Depths>;
const octree::integration_options options{.max_range = 5.0};
constexpr std::size_t keyframe_count = 100;

/// Seconds of CPU time that `work` takes.
template <class Work>
[[nodiscard]] double cpu_seconds_of(Work&& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct keyframes {
  camera::pinhole camera;
  std::vector<scan> scans;   ///< at the true poses
  std::vector<se3> drifted;  ///< poses as they were believed before the correction
};
template <class Recording>
keyframes keyframes_of(const Recording& recording) {
  keyframes all{*recording.camera().model.template get_if<camera::pinhole>(), {}, {}};
  random_bits random{3};
  vec3 axis, direction;
  for (vec3* const v : {&axis, &direction}) {
    for (int i = 0; i != 3; ++i) (*v)[i] = random.normal();
    v->normalize();
  }
  const std::size_t step = std::max<std::size_t>(1, recording.size() / keyframe_count);
  for (std::size_t i = 0; i != keyframe_count; ++i) {
    auto frame = recording.frame(i * step).value();
    const double part = static_cast<double>(i + 1) / static_cast<double>(keyframe_count);
    const se3 drift{so3::exp(axis * (part * 2.0 * 3.14159265358979 / 180.0)), direction * (part * 0.10)};
    all.scans.push_back(
        {std::move(frame.depth), frame.depth_scale, recording.camera().model, frame.T_world_camera.value()});
    all.drifted.push_back(drift * all.scans.back().T_world_camera);
  }
  return all;
}
/// Of the kitchen where it is at hand, else of a synthetic room.
const keyframes& recorded() {
  static const keyframes all = [] {
    const char* set = std::getenv("ORBIS_DATA_DIR");
    const auto folder = std::filesystem::path{set != nullptr && *set != '\0' ? set : ORBIS_DATA_DIR} / "kitchen";
    if (have_kitchen()) return keyframes_of(io::open_recording(folder).value());
    return keyframes_of(io::synthetic_recording{{.frames = 400}});
  }();
  return all;
}

map rebuilt(double resolution) {
  const keyframes& k = recorded();
  map m{resolution};
  for (const scan& s : k.scans) m.integrate(s.depth_metres(), k.camera, s.T_world_camera, options);
  return m;
}
/// The keyframes from `first_drifted` on at the poses of before the correction, the others where they are.
template <class Depths>
live<Depths> drifted_map(double resolution, std::size_t first_drifted) {
  const keyframes& k = recorded();
  live<Depths> m{k.camera, {.resolution = resolution, .integration = options, .tolerance = 0.0}};
  for (std::size_t i = 0; i != k.scans.size(); ++i)
    static_cast<void>(m.add_keyframe(seq, i, k.scans[i].depth_metres(),
                                     i < first_drifted ? k.scans[i].T_world_camera : k.drifted[i]));
  return m;
}
std::vector<mapping::keyframe_position> corrected_poses() {
  std::vector<mapping::keyframe_position> all;
  for (const scan& s : recorded().scans) all.push_back({all.size(), s.T_world_camera});
  return all;
}

template <class Depths, class Policy>
void bench_correction(benchmark::State& state, const Policy& policy, double resolution, std::size_t first_drifted) {
  const auto poses = corrected_poses();
  for (auto _ : state) {
    live<Depths> m = drifted_map<Depths>(resolution, first_drifted);
    std::size_t moved = 0;
    const auto correct = [&] {
      m.set_poses(poses);
      if (const auto done = m.correct(policy)) moved = done->keyframes;
    };
    state.SetIterationTime(policy.threads() == 1 ? cpu_seconds_of(correct) : seconds_of(correct));
    state.counters["keyframes"] = static_cast<double>(moved);
    state.counters["kB_per_keyframe_with_map"] = 1e-3 * static_cast<double>(m.bytes()) / keyframe_count;
    if constexpr (requires { m.depths().bytes_in_memory(); })
      state.counters["depth_kB_per_keyframe"] =
          1e-3 * static_cast<double>(m.depths().bytes_in_memory()) / keyframe_count;
    if (octree::ot_bytes(m.map()) != octree::ot_bytes(rebuilt(resolution))) state.SkipWithError("not the rebuilt map");
  }
}
/// Of poses that are all told again, and have not changed.
void bench_tick(benchmark::State& state, double resolution) {
  const auto poses = corrected_poses();
  live<> m = drifted_map<mapping::depth_store>(resolution, keyframe_count);
  for (auto _ : state) {
    m.set_poses(poses, mapping::unlisted::hide);
    benchmark::DoNotOptimize(m.correct(seq));
  }
}
void bench_rebuilt(benchmark::State& state, double resolution) {
  for (auto _ : state) state.SetIterationTime(cpu_seconds_of([&] { benchmark::DoNotOptimize(rebuilt(resolution)); }));
}
/// The first `count` keyframes, scaled up to all of them: OctoMap takes minutes.
void bench_octomap_rebuilt(benchmark::State& state, double resolution, bool discretized, std::size_t count) {
  for (auto _ : state) {
    octomap::OcTree tree{resolution};
    double seconds = 0;
    for (std::size_t i = 0; i != count; ++i) {
      const scan& s = recorded().scans[i * keyframe_count / count];
      const octomap::Pointcloud cloud = to_octomap(s.points());
      seconds += cpu_seconds_of(
          [&] { tree.insertPointCloud(cloud, to_octomap(s.origin()), options.max_range, false, discretized); });
    }
    state.SetIterationTime(seconds * static_cast<double>(keyframe_count) / static_cast<double>(count));
  }
}
/// One keyframe after the other, with its depth image compressed; or all frames between keyframes, which are not kept.
void bench_insertion_live(benchmark::State& state, double resolution, bool as_keyframes) {
  const keyframes& k = recorded();
  for (auto _ : state) {
    live<> m{k.camera, {.resolution = resolution, .integration = options, .max_frames = 30}};
    std::vector<double> seconds;
    static_cast<void>(m.add_keyframe(seq, 0, k.scans[0].depth_metres(), k.scans[0].T_world_camera));
    for (std::size_t i = 1; i != k.scans.size(); ++i) {
      const scan& s = k.scans[i];
      seconds.push_back(cpu_seconds_of([&] {
        if (as_keyframes)
          static_cast<void>(m.add_keyframe(seq, i, s.depth_metres(), s.T_world_camera));
        else
          m.add_frame(seq, i, s.depth_metres(), 0, k.scans[0].T_world_camera.inverse() * s.T_world_camera);
        static_cast<void>(m.correct(seq));
      }));
    }
    report_frames(state, std::move(seconds));
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const double resolution : {0.05, 0.02}) {
    const std::string group = "live_map/" + in_centimetres(resolution);
    const auto row = [](const std::string& name, auto body, int repetitions = 3) {
      timed_by_itself(add_row(name, body), repetitions);
    };
    const auto correction = [&](const std::string& name, std::size_t first_drifted) {
      row(group + name + "/orbis",
          [=](auto& s) { bench_correction<test::memory_depths>(s, seq, resolution, first_drifted); });
      row(group + name + "/orbis_compressed",
          [=](auto& s) { bench_correction<mapping::depth_store>(s, seq, resolution, first_drifted); });
      row(group + name + "/orbis_compressed_2_threads",
          [=](auto& s) { bench_correction<mapping::depth_store>(s, par.with(2), resolution, first_drifted); });
      row(group + name + "/orbis_rebuilt", [=](auto& s) { bench_rebuilt(s, resolution); });
      const std::size_t few = resolution < 0.05 ? 5 : 10;
      row(
          group + name + "/octomap_rebuilt", [=](auto& s) { bench_octomap_rebuilt(s, resolution, false, few); }, 1);
      row(
          group + name + "/octomap_rebuilt_discretized",
          [=](auto& s) { bench_octomap_rebuilt(s, resolution, true, few); }, 1);
    };
    correction("/all_moved", 0);
    correction("/last_third_moved", keyframe_count - keyframe_count / 3);
    add_row(group + "/nothing_moved/orbis", [=](auto& s) { bench_tick(s, resolution); });
    row(group + "/insert_keyframe/orbis", [=](auto& s) { bench_insertion_live(s, resolution, true); });
    row(group + "/insert_frame/orbis", [=](auto& s) { bench_insertion_live(s, resolution, false); });
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
