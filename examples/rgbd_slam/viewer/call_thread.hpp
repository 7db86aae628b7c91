// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A thread that makes calls with another priority.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace app {

/// A thread that makes calls on behalf of a low-priority thread, with the priority of its own creator. The calls lock
/// mutexes that high-priority threads need, so the higher priority avoids priority inversion: on a machine with few
/// cores, a low-priority thread may not be scheduled for a long time while it holds a lock.
class call_thread {
 public:
  /// Throws if no thread can be created.
  call_thread() : thread_{[this] { work(); }} {}
  call_thread(const call_thread&) = delete;
  call_thread& operator=(const call_thread&) = delete;
  /// @pre no call is running
  ~call_thread() {
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  /// Calls `f()` on the thread, waits for it, and rethrows its exception. Only one caller at a time may use it.
  void call(const std::function<void()>& f) {
    std::unique_lock lock{mutex_};
    call_ = &f;
    changed_.notify_all();
    changed_.wait(lock, [&] { return call_ == nullptr; });
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }

 private:
  void work() {
    std::unique_lock lock{mutex_};
    for (;;) {
      changed_.wait(lock, [&] { return ends_ || call_ != nullptr; });
      if (call_ == nullptr) return;
      try {
        (*call_)();
      } catch (...) {
        thrown_ = std::current_exception();
      }
      call_ = nullptr;
      changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  const std::function<void()>* call_ = nullptr;
  std::exception_ptr thrown_;
  bool ends_ = false;
  std::thread thread_;  // last member: starts after the others are initialised
};

}  // namespace app
