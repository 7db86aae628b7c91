// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The frames of a camera for a program that may be slower than it.
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

/// Takes frames from a camera on a thread of its own and keeps the newest: whoever asks for the next one gets it. One
/// that was not asked for before the next came is dropped and counted.
class live_source {
 public:
  explicit live_source(std::unique_ptr<camera_device> device);
  ~live_source();
  live_source(const live_source&) = delete;
  live_source& operator=(const live_source&) = delete;

  [[nodiscard]] const camera_device& device() const { return *device_; }
  /// Waits for a frame that has not been asked for. Errors: that of the device, which then gives no more, after its
  /// last frame; cancelled, once `is_over()` holds while none comes, or when none has come for ten seconds
  /// (unreadable).
  [[nodiscard]] orbis::result<source_frame> next(const std::function<bool()>& is_over);
  /// Frames so far that nobody asked for in time. From any thread.
  [[nodiscard]] std::size_t dropped() const { return dropped_; }

 private:
  [[nodiscard]] orbis::result<std::optional<source_frame>> next_of_device();
  void take_frames();

  std::unique_ptr<camera_device> device_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<source_frame> newest_;  // guarded by mutex_
  std::optional<orbis::error> ended_;   // likewise
  std::atomic<bool> stops_{false};
  std::atomic<std::size_t> dropped_{0};
  std::thread thread_;
};

}  // namespace app
