// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A background thread for one piece of work at a time: starting a thread for each piece would take longer.
#pragma once

#include <cassert>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

namespace app {

/// A thread for one piece of work at a time. It starts with the first piece; the destructor waits for the last one.
class background_thread {
 public:
  background_thread() = default;
  background_thread(const background_thread&) = delete;
  background_thread& operator=(const background_thread&) = delete;
  ~background_thread() {
    {
      const std::lock_guard lock{mutex_};
      is_stopped_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  /// Runs `work` on the thread. If no thread can be created, returns a future without state (`valid()` is false), so
  /// that the caller does the work. @pre the future of the previous piece is ready
  template <class Work>
  [[nodiscard]] std::future<std::invoke_result_t<Work>> start(Work work) {
    if (!thread_.joinable()) try {
        thread_ = std::thread{[this] { run(); }};
      } catch (const std::system_error&) {
        return {};
      }
    const auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work>()>>(std::move(work));
    {
      const std::lock_guard lock{mutex_};
      assert(!next_);
      next_ = [task] { (*task)(); };
    }
    changed_.notify_one();
    return task->get_future();
  }

 private:
  void run() {
    std::unique_lock lock{mutex_};
    for (;;) {
      changed_.wait(lock, [this] { return next_ || is_stopped_; });
      if (!next_) return;
      {
        const auto work = std::exchange(next_, {});
        lock.unlock();
        work();
      }
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> next_;
  bool is_stopped_ = false;
  std::thread thread_;
};

}  // namespace app
