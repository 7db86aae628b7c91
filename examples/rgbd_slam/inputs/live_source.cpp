// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/live_source.hpp"

#include <chrono>
#include <exception>
#include <utility>

namespace app {

using namespace std::chrono_literals;
using orbis::errc;
using orbis::fail;

namespace {
constexpr auto poll_interval = 50ms;  // time between checks of whether the run has ended
constexpr auto longest_wait = 10s;    // time without a frame after which the camera counts as disconnected
}  // namespace

live_source::live_source(std::unique_ptr<camera_device> device)
    : device_{std::move(device)}, thread_{[this] { take_frames(); }} {}

live_source::~live_source() {
  stops_ = true;
  thread_.join();
}

orbis::result<std::optional<source_frame>> live_source::next_of_device() {
  try {
    return device_->next(poll_interval);
  } catch (const std::exception& e) {  // from the library, or out of memory
    return fail(errc::unreadable, device_->name, e.what());
  }
}

void live_source::take_frames() {
  while (!stops_) {
    auto frame = next_of_device();
    const std::lock_guard lock{mutex_};
    if (!frame) {
      ended_ = std::move(frame.error());
      changed_.notify_all();
      return;
    }
    if (!*frame) continue;
    if (newest_) ++dropped_;
    newest_ = **std::move(frame);
    changed_.notify_all();
  }
}

orbis::result<source_frame> live_source::next(const std::function<bool()>& is_over) {
  const auto begin = std::chrono::steady_clock::now();
  std::unique_lock lock{mutex_};
  while (!newest_) {
    if (ended_) return fail(*ended_);
    if (is_over()) return fail(errc::cancelled, device_->name, "interrupted while waiting for a frame");
    if (std::chrono::steady_clock::now() - begin > longest_wait)
      return fail(errc::unreadable, device_->name, "no frame arrived for 10 s");
    changed_.wait_for(lock, poll_interval);
  }
  return *std::exchange(newest_, std::nullopt);
}

}  // namespace app
