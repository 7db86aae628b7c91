// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frames of a live camera, for programs that may be slower than the camera.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include <orbis/core/result.hpp>

#include "inputs/camera_device.hpp"
#include "source.hpp"

namespace app {

/// Reads frames from a camera on a separate thread and stores the newest one for the next request. A frame that is not
/// requested before the next one arrives is dropped and counted.
class live_source {
 public:
  explicit live_source(std::unique_ptr<camera_device> device);
  ~live_source();
  live_source(const live_source&) = delete;
  live_source& operator=(const live_source&) = delete;

  [[nodiscard]] const camera_device& device() const { return *device_; }
  /// Waits for a new frame. Errors: the device's error, after its last frame; cancelled, if `is_over()` returns true
  /// during the wait; unreadable, if no frame arrives for ten seconds.
  [[nodiscard]] orbis::result<source_frame> next(const std::function<bool()>& is_over);
  /// The number of frames dropped so far. May be called from any thread.
  [[nodiscard]] std::size_t dropped() const { return dropped_; }

 private:
  [[nodiscard]] orbis::result<std::optional<source_frame>> next_of_device();
  void take_frames();

  std::unique_ptr<camera_device> device_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<source_frame> newest_;  // guarded by mutex_
  std::optional<orbis::error> ended_;   // guarded by mutex_
  std::atomic<bool> stops_{false};
  std::atomic<std::size_t> dropped_{0};
  std::thread thread_;
};

}  // namespace app
