// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A thread that works on what it is given, one after the other.
#pragma once

#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace orbis::slam::detail {

/// Jobs are done in the order in which they come. `stop` and the destructor let the job at hand end, and drop those
/// that wait. A job that asks its own worker by a pointer finds none while that is reset: stop the worker before.
/// @pre `work` does not throw
template <std::movable Job>
class worker {
 public:
  explicit worker(std::function<void(Job)> work) : work_{std::move(work)}, thread_{[this] { run(); }} {}
  worker(const worker&) = delete;
  worker& operator=(const worker&) = delete;
  ~worker() { stop(); }

  /// Returns when the job at hand is done; no other one is begun any more. Not to be called by a job.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// Once it is stopped, jobs are dropped.
  void push(Job job) {
    {
      const std::lock_guard lock(mutex_);
      if (ends_) return;
      jobs_.push_back(std::move(job));
    }
    changed_.notify_all();
  }

  /// How many jobs wait, without the one at hand.
  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
  }
  /// Whether there is nothing to do.
  [[nodiscard]] bool idle() const {
    const std::lock_guard lock(mutex_);
    return jobs_.empty() && !busy_;
  }
  /// Returns when fewer than `count` jobs wait.
  void wait_for_room(std::size_t count) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_.size() < count; });
  }
  /// Returns when there is nothing to do.
  void wait() const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_.empty() && !busy_; });
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return ends_ || !jobs_.empty(); });
      if (ends_) {
        jobs_.clear();  // so that nobody waits for them
        changed_.notify_all();
        return;
      }
      Job job = std::move(jobs_.front());
      jobs_.pop_front();
      busy_ = true;
      lock.unlock();
      changed_.notify_all();
      work_(std::move(job));
      lock.lock();
      busy_ = false;
      changed_.notify_all();
    }
  }

  std::function<void(Job)> work_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool busy_ = false;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace orbis::slam::detail
