// SPDX-License-Identifier: BSD-3-Clause
//
// soak [RECORDING [FRAMES]]: a robot that does not stop. Plays a recording forwards and backwards, again and again, for
// so many frames (10,000), through SLAM with threads and the live map, and prints a row for each tenth: what tracking
// takes, how long a reader waits for the locks, and corrections hold them at most, the memory of the process, and how
// large the maps are. Then two copies of the map are merged while the recording goes on. Without a recording, a
// synthetic room. Ends with 1 if memory grows by more than a fifth after the second round, frames are lost, something
// was left out of the live map, the copies do not become one map, or their merger holds the locks for more than 20 ms.
#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <orbis/camera/any.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/mapping/live_map_thread.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/slam/system.hpp>

#include "support/synthetic/sequence.hpp"

namespace {

using namespace orbis;
using soak_clock = std::chrono::steady_clock;

double milliseconds_since(soak_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(soak_clock::now() - start).count();
}

/// Megabytes of memory that the process has.
double resident_megabytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  statm >> pages >> resident;
  return 1e-6 * resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Megabytes of the heap that are in use: what is kept, without what malloc holds for later. 0 where nobody tells.
double heap_megabytes() {
#ifdef __GLIBC__
  const struct mallinfo2 heap = mallinfo2();
  return 1e-6 * static_cast<double>(heap.uordblks + heap.hblkhd);
#else
  return 0.0;
#endif
}

double part_of(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(part * static_cast<double>(values.size())))];
}

/// A reader that asks again and again, as a viewer does, and notes how long it waited.
class impatient_reader {
 public:
  explicit impatient_reader(const slam::rgbd_system<camera::any_camera>& slam)
      : thread_{[this, &slam] {
          while (!ends_) {
            const auto start = soak_clock::now();
            slam.inspect([](const slam::atlas&) {});
            const double waited = milliseconds_since(start);
            {
              const std::lock_guard lock{mutex_};
              waited_.push_back(waited);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds{2});
          }
        }} {}
  ~impatient_reader() {
    ends_ = true;
    thread_.join();
  }
  impatient_reader(const impatient_reader&) = delete;
  impatient_reader& operator=(const impatient_reader&) = delete;

  /// What was noted since the last call.
  [[nodiscard]] std::vector<double> take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(waited_, {});
  }

 private:
  std::atomic<bool> ends_{false};
  std::mutex mutex_;
  std::vector<double> waited_;
  std::thread thread_;
};

/// The longest time for which a correction held the locks, milliseconds. The calls come from threads of the system.
class longest_hold {
 public:
  [[nodiscard]] auto listener() {
    return [this](const slam::correction_event& e) {
      const std::lock_guard lock{mutex_};
      longest_ = std::max(longest_, e.locked_milliseconds);
    };
  }
  /// Since the last call.
  [[nodiscard]] double take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(longest_, 0.0);
  }

 private:
  std::mutex mutex_;
  double longest_ = 0.0;
};

/// The frame of the recording that comes `i`-th when it is played to and fro.
std::size_t to_and_fro(std::size_t i, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t at = i % (2 * (size - 1));
  return at < size ? at : 2 * (size - 1) - at;
}

/// Loads two copies of a map and goes on with the recording until they are one map, at most once to and fro. Returns
/// how long the locks were held at once, at most; nothing if the copies did not become one map.
template <class Recording>
std::optional<double> merge_copies(const Recording& recording, const slam::options& settings,
                                   const std::filesystem::path& map) {
  longest_hold hold;
  slam::rgbd_system<camera::any_camera> slam{recording.camera().model, settings};
  slam.listen({.map_corrected = hold.listener()});
  if (!slam.load_map(map) || !slam.load_map(map)) return std::nullopt;
  for (std::size_t i = 0; i != 2 * recording.size() && slam.counters().maps_merged == 0; ++i) {
    auto frame = recording.frame(to_and_fro(i, recording.size()));
    if (!frame) return std::nullopt;
    frame->timestamp = static_cast<double>(i) / 30.0;
    slam.track(*frame);
  }
  slam.wait();
  return slam.counters().maps_merged == 1 ? std::optional{hold.take()} : std::nullopt;
}

/// Merges copies of a map several times. Returns how long the locks were held in the best case: in others, a thread
/// that held them may have been left without a processor.
template <class Recording>
std::optional<double> merge_copies(const Recording& recording, const slam::rgbd_system<camera::any_camera>& slam,
                                   const slam::options& settings) {
  const auto file = std::filesystem::temp_directory_path() / ("soak_" + std::to_string(getpid()) + ".map");
  std::optional<double> least;
  bool all = slam.save_map(file).has_value();
  for (int i = 0; all && i != 5; ++i) {
    const std::optional<double> held = merge_copies(recording, settings, file);
    all = held.has_value();
    if (held) least = std::min(*held, least.value_or(*held));
  }
  std::filesystem::remove(file);
  return all ? least : std::nullopt;
}

template <class Recording>
int soak(const Recording& recording, std::size_t frames) {
  const camera::camera_settings camera = recording.camera();
  const auto depth_of = [&](const camera::rgbd_frame& f) {
    return camera::depth_view<std::uint16_t>{f.depth, camera.depth_scale};
  };
  slam::options settings;
  settings.threads = {.enabled = true, .wait = true};
  settings.trajectory_frames = 5000;  // three minutes
  longest_hold hold;
  slam::rgbd_system<camera::any_camera> slam{camera.model, settings};

  using live_map = mapping::live_map_thread<octree::occupancy_octree<>, camera::any_camera>;
  mapping::live_map_thread_options map_options;
  map_options.patience = std::chrono::seconds{10};  // the recording is played faster than a camera would bring it
  map_options.moving.emplace();
  live_map map{camera.model, map_options, {.poll_poses = mapping::follow_keyframes(slam)}};
  slam.listen({.keyframe_culled = [&map](const auto& e) { map.remove(e.frame); }, .map_corrected = hold.listener()});

  std::printf("%8s %22s %22s %8s %8s %8s %10s %10s %8s %6s\n", "frames", "track ms (50/95/max)", "lock ms (50/95/max)",
              "held ms", "MB", "heap MB", "keyframes", "landmarks", "leaves", "lost");
  std::vector<double> tracking;
  const std::size_t two_rounds = 4 * recording.size();
  double memory_then = 0.0, memory_now = 0.0;
  {
    impatient_reader reader{slam};
    std::size_t lost_before = 0;
    for (std::size_t i = 0; i != frames; ++i) {
      auto frame = recording.frame(to_and_fro(i, recording.size()));
      if (!frame) {
        std::fprintf(stderr, "soak: %s\n", frame.error().to_string().c_str());
        return 2;
      }
      frame->timestamp = static_cast<double>(i) / 30.0;
      const slam::track_result r = slam.track(*frame);
      tracking.push_back(r.timings.tracking_ms);
      if (r.keyframe && r.T_world_camera) map.add_keyframe(i, depth_of(*frame), *r.T_world_camera);
      if ((i + 1) % std::max<std::size_t>(1, frames / 10) != 0) continue;
      slam.wait();
      map.wait();
      const std::vector<double> waited = reader.take();
      const std::size_t lost = slam.counters().lost;
      memory_now = resident_megabytes();
      if (memory_then == 0.0 && i >= two_rounds) memory_then = memory_now;
      std::printf("%8zu %6.1f %6.1f %8.1f %6.2f %6.2f %8.1f %8.2f %8.0f %8.1f %10zu %10zu %8zu %6zu\n", i + 1,
                  part_of(tracking, 0.5), part_of(tracking, 0.95), part_of(tracking, 1.0), part_of(waited, 0.5),
                  part_of(waited, 0.95), part_of(waited, 1.0), hold.take(), memory_now, heap_megabytes(),
                  slam.keyframes().size(), slam.landmark_count(), map.latest()->map.counts().leaves,
                  lost - lost_before);
      std::fflush(stdout);
      lost_before = lost;
      tracking.clear();
    }
  }

  int status = 0;
  const auto complain = [&](const std::string& what) {
    std::printf("soak: %s\n", what.c_str());
    status = 1;
  };
  const auto counters = map.counters();
  if (const auto failed = map.failure()) complain("the live map ended: " + failed->message);
  if (counters.dropped_keyframes != 0) complain(std::to_string(counters.dropped_keyframes) + " keyframes left out");
  if (slam.counters().lost != 0) complain(std::to_string(slam.counters().lost) + " frames lost");
  if (memory_then != 0.0 && memory_now > 1.2 * memory_then) complain("memory grows by more than a fifth");
  constexpr double longest = 20.0;  // milliseconds
  if (const auto held = merge_copies(recording, slam, settings); !held) {
    complain("two copies of the map did not become one");
  } else {
    std::printf("two copies of the map were merged, with the locks held for %.2f ms at once\n", *held);
    if (*held > longest) complain("the locks were held for too long");
  }
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t frames = 10000;
  if (argc > 3 || (argc > 1 && std::string_view{argv[1]} == "--help")) {
    std::puts("usage: soak [RECORDING [FRAMES]]    without a recording: a synthetic room");
    return argc > 3 ? 2 : 0;
  }
  if (argc == 3) {
    const char* const end = argv[2] + std::strlen(argv[2]);
    if (const auto [at, e] = std::from_chars(argv[2], end, frames); e != std::errc{} || at != end || frames == 0) {
      std::fprintf(stderr, "soak: \"%s\" is no number of frames\n", argv[2]);
      return 2;
    }
  }
  if (argc == 1) return soak(test::room_round({.sequence = {.frames = 300}}), frames);
  const auto recording = io::open_recording(argv[1]);
  if (!recording) {
    std::fprintf(stderr, "soak: %s\n", recording.error().to_string().c_str());
    return 2;
  }
  return soak(*recording, frames);
}
