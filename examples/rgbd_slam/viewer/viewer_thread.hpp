// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The thread that draws, and how frames and answers come to it.
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

#include "viewer/backend.hpp"
#include "viewer/calls_aside.hpp"
#include "viewer/scene_builder.hpp"

namespace app {

/// Draws on a thread of low priority. What asks others (`scene_sources::graph` and `numbers`), and so takes their
/// locks, is called on a second thread, of the priority of the one that made this. An exception in any of this closes
/// the viewer, and reaches nobody else.
class viewer_thread {
 public:
  using open_backend = std::function<orbis::result<std::unique_ptr<viewer_backend>>()>;

  /// See scene_builder. `no_voxels`: why there is no live map; empty: there is one.
  viewer_thread(std::string title, std::size_t frames, orbis::camera::ray_table rays, double resolution,
                std::string no_voxels = {});
  viewer_thread(const viewer_thread&) = delete;
  viewer_thread& operator=(const viewer_thread&) = delete;
  ~viewer_thread();

  /// Calls `open` on the new thread, which then draws; returns where it is to be seen. Errors: those of `open`. If that
  /// throws, or the system gives no thread, the viewer is closed, and nothing is returned but an empty string. Call it
  /// once.
  [[nodiscard]] orbis::result<std::string> start(open_backend open);
  /// Whether somebody may be looking.
  [[nodiscard]] bool is_open() const noexcept { return is_open_; }

  /// Hands the frame over that `make()` returns, if somebody may be looking. Waits for no thread. For one thread.
  template <std::invocable Make>
  void show(Make&& make) noexcept {
    if (!is_open()) return;
    try {
      builder_.hand_over(std::forward<Make>(make)());
    } catch (...) {
      close(std::current_exception());
    }
  }

  /// From now on the sources are asked. Waits for the drawing of a scene, as the next two.
  void connect(scene_sources sources);
  /// Asks the sources once more, and never again.
  void disconnect();
  /// Shows the map that was made in the end.
  void show_map(const std::vector<voxel>& voxels);

  /// Why the viewer was closed by an exception; empty if it was not, or if this was told before.
  [[nodiscard]] std::string take_trouble();

 private:
  void close(std::exception_ptr why) noexcept;
  void run(const open_backend& open, std::promise<orbis::result<std::string>>& opened);
  void draw_until_the_end(viewer_backend& backend);

  scene_builder builder_;  // guarded by mutex_, but for `hand_over`
  std::atomic<bool> is_open_{false}, ends_{false};
  std::mutex trouble_mutex_;
  std::exception_ptr trouble_;
  bool is_told_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  scene_sources sources_;
  std::unique_ptr<calls_aside> aside_;
  std::thread thread_;
};

}  // namespace app
