// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The viewer's drawing thread and its data.
#pragma once

#include <atomic>
#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/camera/rays.hpp>
#include <orbis/core/result.hpp>

#include "background.hpp"
#include "viewer/backend.hpp"
#include "viewer/scene_builder.hpp"

namespace app {

/// Draws on a low-priority thread. Sources that lock the mutexes of other threads (`scene_sources::graph` and
/// `numbers`) are called on a second thread with the priority of the creator. An exception on these threads closes the
/// viewer and does not propagate.
class viewer_thread {
 public:
  using open_backend = std::function<orbis::result<std::unique_ptr<viewer_backend>>()>;

  /// See `scene_builder`. `no_voxels`: the reason why there is no live map; empty if there is one.
  viewer_thread(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                std::string no_voxels = {});
  viewer_thread(const viewer_thread&) = delete;
  viewer_thread& operator=(const viewer_thread&) = delete;
  ~viewer_thread();

  /// Calls `open` on a new thread, which then draws; returns the viewer's address. Errors: those of `open`. If `open`
  /// throws or no thread can be created, closes the viewer and returns an empty string. Call it once.
  [[nodiscard]] orbis::result<std::string> start(open_backend open);
  /// Returns true if the viewer is open.
  [[nodiscard]] bool is_open() const noexcept { return is_open_; }

  /// If the viewer is open, shows the frame that `make()` returns. Does not block. Call it from one thread only.
  template <std::invocable Make>
  void show(Make&& make) noexcept {
    if (!is_open()) return;
    try {
      builder_.push(std::forward<Make>(make)());
    } catch (...) {
      close(std::current_exception());
    }
  }

  /// Replaces the camera. This and the next three functions wait until the current drawing is complete.
  void set_camera(orbis::camera::ray_table rays);
  /// Connects the sources of a run.
  void connect(scene_sources sources);
  /// Queries the sources one last time and disconnects them.
  void disconnect();
  /// Shows the final map.
  void show_map(const std::vector<voxel>& voxels);

  /// The message of the exception that closed the viewer; empty if there was none or it was already returned.
  [[nodiscard]] std::string take_error();

 private:
  void close(std::exception_ptr why) noexcept;
  void run(const open_backend& open, std::promise<orbis::result<std::string>>& opened);
  void draw_until_closed(viewer_backend& backend);

  scene_builder builder_;  // guarded by mutex_, except `push`
  std::atomic<bool> is_open_{false}, ends_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
  bool is_reported_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  scene_sources sources_;
  /// Makes the calls that lock mutexes of high-priority threads, with the priority of the thread that created it: on a
  /// machine with few cores, a low-priority thread may not be scheduled for a long time while it holds a lock.
  std::unique_ptr<background_thread> aside_;
  std::thread thread_;
};

}  // namespace app
