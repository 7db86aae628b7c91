// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calls on a thread of another priority.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace app {

/// A thread with the priority of the one that makes it. A thread of low priority has those calls done here that take a
/// lock which a thread of higher priority waits for: where processors are few, the system may leave it without one for
/// long, and whoever waits for its locks as well.
class calls_aside {
 public:
  /// Throws if the system gives no thread.
  calls_aside() : thread_{[this] { work(); }} {}
  calls_aside(const calls_aside&) = delete;
  calls_aside& operator=(const calls_aside&) = delete;
  /// @pre no call is running
  ~calls_aside() {
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  /// Calls `f()` on the thread, and waits for it. Throws what it throws. For one thread at a time.
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
  std::thread thread_;  // the last to begin
};

}  // namespace app
