// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The threads of the page's server.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace app {

/// A fixed number of threads for connections. If too many connections wait, additional ones wait in the system's
/// bounded queue. `TaskQueue` is cpp-httplib's, whose `enqueue` returns void before version 0.15, and since then true
/// if the job was accepted: here every job is.
template <class TaskQueue>
class bounded_threads final : public TaskQueue {
  using taken = decltype(std::declval<TaskQueue&>().enqueue(std::function<void()>{}));

 public:
  /// `waiting`: maximum number of waiting jobs, above which `enqueue` blocks. `failed` is called on a thread of this
  /// object if a job throws. If the system provides fewer threads, these do all the work; throws if it provides none.
  /// @pre threads > 0
  bounded_threads(std::size_t threads, std::size_t waiting, std::function<void(std::exception_ptr)> failed)
      : waiting_{waiting}, failed_{std::move(failed)} {
    threads_.reserve(threads);
    while (threads_.size() != threads) {
      try {
        threads_.emplace_back([this] { work(); });
      } catch (const std::exception&) {
        if (threads_.empty()) throw;
        break;
      }
    }
  }
  bounded_threads(const bounded_threads&) = delete;
  bounded_threads& operator=(const bounded_threads&) = delete;
  ~bounded_threads() override { end(); }  // the server does not call `shutdown` if it ends by an exception

  taken enqueue(std::function<void()> job) override {
    {
      std::unique_lock lock{mutex_};
      changed_.wait(lock, [&] { return jobs_.size() < waiting_; });
      jobs_.push_back(std::move(job));
    }
    changed_.notify_all();
    if constexpr (!std::is_void_v<taken>) return taken{true};
  }
  /// Finishes the waiting jobs and ends the threads.
  void shutdown() override { end(); }

 private:
  void end() {
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
    }
    changed_.notify_all();
    for (std::thread& t : threads_)
      if (t.joinable()) t.join();
  }
  void work() {
    for (;;) {
      std::function<void()> job;
      {
        std::unique_lock lock{mutex_};
        changed_.wait(lock, [&] { return ends_ || !jobs_.empty(); });
        if (jobs_.empty()) return;
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      changed_.notify_all();
      try {
        job();
      } catch (...) {
        failed_(std::current_exception());
      }
    }
  }

  const std::size_t waiting_;
  const std::function<void(std::exception_ptr)> failed_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace app
