// SPDX-License-Identifier: BSD-3-Clause
//
// What a frame costs the whole system, stage by stage, with and without threads; and, over ten thousand frames of one
// building, what of this grows with the map: tracking should not. The time of a row is that of one frame on the mean.
//
// The long walk takes minutes: it is a row only where ORBIS_BENCH_LONG is set in the environment.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/camera/settings.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/system-inl.hpp>
#include <orbis/slam/system.hpp>

#include "support/synthetic/read_ahead.hpp"
#include "support/synthetic/sequence.hpp"

namespace {

using namespace orbis;
namespace syn = test;
using bench_clock = std::chrono::steady_clock;

/// Notes when a signature was asked for last: looking for loops begins with one.
class stamped_places : public slam::bag_of_words_places {
 public:
  using stamp = std::atomic<bench_clock::rep>;
  explicit stamped_places(std::shared_ptr<stamp> last) : last_{std::move(last)} {}
  [[nodiscard]] signature describe(const features::features& f) const {
    *last_ = bench_clock::now().time_since_epoch().count();
    return slam::bag_of_words_places::describe(f);
  }

 private:
  std::shared_ptr<stamp> last_;
};

using slam_system = slam::rgbd_system<camera::any_camera, features::orb_extractor, slam::orb_matchers, stamped_places>;

/// Milliseconds.
struct samples {
  std::vector<double> values;
  void add(double v) { values.push_back(v); }
  /// The value that this part of all is below.
  [[nodiscard]] double at(double part) const {
    if (values.empty()) return 0.0;
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(part * static_cast<double>(sorted.size())))];
  }
  void report(benchmark::State& state, const std::string& name) const {
    state.counters[name + "_median"] = at(0.5);
    state.counters[name + "_p95"] = at(0.95);
  }
};

/// What some frames took: `mapping` and `loops` (looking for them, without what closing them took) by keyframe.
struct stage_times {
  samples features, tracking, mapping, loops;
};

/// A system, and the time its stages take.
class measured_system {
 public:
  measured_system(const camera::camera_settings& camera, const slam::options& settings)
      : threaded_{settings.threads.enabled},
        slam_{camera.model, settings, features::orb_extractor{settings.features}, stamped_places{last_described_}} {
    slam::listeners all;
    all.map_corrected = [this](const slam::correction_event& e) {
      correcting_us_ += static_cast<std::int64_t>(1e3 * e.milliseconds);
    };
    slam_.listen(std::move(all));
  }

  void track(const camera::rgbd_frame& f, stage_times& times) {
    const std::int64_t corrected_before = correcting_us_;
    const slam::track_result r = slam_.track(f);
    const auto now = bench_clock::now().time_since_epoch();
    sum_ms_ += r.timings.features_ms + r.timings.tracking_ms + r.timings.mapping_ms;
    times.features.add(r.timings.features_ms);
    times.tracking.add(r.timings.tracking_ms);
    if (!r.keyframe) return;
    times.mapping.add(r.timings.mapping_ms);
    if (threaded_) return;
    const std::chrono::duration<double, std::milli> since = now - bench_clock::duration{last_described_->load()};
    times.loops.add(since.count() - 1e-3 * static_cast<double>(correcting_us_ - corrected_before));
  }

  /// Of a row of its own.
  void report(benchmark::State& state) {
    slam_.wait();
    const slam::track_counters c = slam_.counters();
    state.SetIterationTime(1e-3 * sum_ms_ / static_cast<double>(std::max<std::size_t>(1, c.frames)));
    state.counters["keyframes"] = static_cast<double>(keyframes());
    state.counters["landmarks"] = static_cast<double>(slam_.landmark_count());
    state.counters["lost"] = static_cast<double>(c.lost);
    state.counters["loops_closed"] = static_cast<double>(c.loops_closed);
    state.counters["correcting_ms"] = 1e-3 * static_cast<double>(correcting_us_);
  }
  [[nodiscard]] std::size_t keyframes() const {
    return slam_.inspect([](const slam::atlas& all) { return all.active().keyframes().size(); });
  }

 private:
  bool threaded_;
  std::shared_ptr<stamped_places::stamp> last_described_ = std::make_shared<stamped_places::stamp>();
  std::atomic<std::int64_t> correcting_us_{0};
  double sum_ms_ = 0.0;
  slam_system slam_;
};

/// The first frames of a recording, in memory.
struct kept_frames {
  camera::camera_settings camera;
  std::vector<camera::rgbd_frame> frames;
};
constexpr std::size_t kept = 120;

template <class Recording>
kept_frames keep(const Recording& all) {
  kept_frames out{all.camera(), {}};
  for (std::size_t i = 0; i != std::min(kept, all.size()); ++i)
    if (auto frame = all.frame(i)) out.frames.push_back(*std::move(frame));
  return out;
}
const kept_frames& room() {
  static const kept_frames made = keep(syn::room_round({.sequence = {.frames = static_cast<int>(kept)}}));
  return made;
}
const kept_frames& kitchen() {
  static const kept_frames read = keep(io::open_recording(ORBIS_DATA_DIR "/kitchen").value());
  return read;
}

/// With threads, frames come when a camera would bring them: what tracking then waits for is the locks.
void stages(benchmark::State& state, const kept_frames& recording, bool threads) {
  for (auto _ : state) {
    slam::options settings;
    settings.threads.enabled = threads;
    measured_system slam{recording.camera, settings};
    stage_times times;
    const auto start = bench_clock::now();
    for (const camera::rgbd_frame& f : recording.frames) {
      if (threads)
        std::this_thread::sleep_until(start +
                                      std::chrono::duration<double>(f.timestamp - recording.frames.front().timestamp));
      slam.track(f, times);
    }
    slam.report(state);
    times.features.report(state, "features");
    times.tracking.report(state, "tracking");
    if (!threads) times.mapping.report(state, "mapping");
  }
}

/// Bytes of memory that the process has; 0 where it cannot be told.
double resident_bytes() {
  std::ifstream all("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  all >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Once round a building of 200 m: new ground all the way, until the loop closes at the end. Of all stages the first
/// tenth is compared with the last one before the camera comes back.
void growth(benchmark::State& state) {
  const syn::loop_options building{.building = {.core_length = 60.0, .core_width = 35.0},
                                   .walk = {.overlap = 4.0, .look_aside = -0.35},
                                   .sequence = {.width = 320, .height = 240}};
  for (auto _ : state) {
    const auto walk = syn::corridor_loop(building);
    const std::size_t count = walk.size(), tenth = count / 10;
    const std::size_t back = count - static_cast<std::size_t>(building.walk.overlap * walk.options().fps) - 150;
    measured_system slam{walk.camera(), {}};
    syn::read_ahead frames{walk, 2};
    stage_times first, last, rest;
    double bytes = 0.0, bytes_before = 0.0;
    std::size_t keyframes = 0, keyframes_before = 0, i = 0;
    for (auto frame = frames.next(); frame; frame = frames.next(), ++i) {
      if (i == tenth) bytes_before = resident_bytes(), keyframes_before = slam.keyframes();
      if (i == back) bytes = resident_bytes(), keyframes = slam.keyframes();
      slam.track(frame->value(), i < tenth ? first : (i >= back - tenth && i < back ? last : rest));
    }
    slam.report(state);
    first.tracking.report(state, "tracking_first");
    last.tracking.report(state, "tracking_last");
    first.mapping.report(state, "mapping_first");
    last.mapping.report(state, "mapping_last");
    first.loops.report(state, "loops_first");
    last.loops.report(state, "loops_last");
    state.counters["bytes_per_keyframe"] =
        (bytes - bytes_before) / static_cast<double>(std::max<std::size_t>(1, keyframes - keyframes_before));
  }
}

template <class Work>
void add_row(const std::string& name, Work&& work) {
  benchmark::RegisterBenchmark(("slam_tracking/" + name).c_str(), std::forward<Work>(work))
      ->UseManualTime()
      ->Iterations(1)
      ->Unit(benchmark::kMillisecond);
}

[[maybe_unused]] const bool registered = [] {
  std::error_code none;
  const bool with_kitchen = std::filesystem::exists(ORBIS_DATA_DIR "/kitchen", none);
  for (const bool threads : {false, true}) {
    const std::string who = threads ? "/orbis_threads" : "/orbis";
    add_row("room_640x480" + who, [=](benchmark::State& state) { stages(state, room(), threads); });
    if (with_kitchen) add_row("kitchen" + who, [=](benchmark::State& state) { stages(state, kitchen(), threads); });
  }
  if (std::getenv("ORBIS_BENCH_LONG") != nullptr)
    benchmark::RegisterBenchmark("slam_tracking/growth_320x240/orbis", growth)
        ->UseManualTime()
        ->Iterations(1)
        ->Repetitions(1)
        ->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
