// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A thread with a queue of jobs.
#pragma once

#include <algorithm>
#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace orbis::slam::detail {

/// Calls `work` for each job, in the order in which they are pushed. `stop` and the destructor wait for the running job
/// and drop the others. While jobs use a pointer to their worker, call `stop` before the pointer is reset. If `work`
/// throws, that is the end: the other jobs are dropped, and `push`, `wait` and `wait_for_room` throw the same from then
/// on.
template <std::movable Job>
class worker {
 public:
  explicit worker(std::function<void(Job)> work) : work_{std::move(work)}, thread_{[this] { run(); }} {}
  worker(const worker&) = delete;
  worker& operator=(const worker&) = delete;
  ~worker() { stop(); }

  /// Waits for the running job; no other one is begun any more. Not to be called by a job.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// Appends a job; drops it after `stop`.
  void push(Job job) {
    push_unless(std::move(job), [](const auto&, const Job&) { return false; });
  }
  /// As `push`, unless an equal job is in the queue already.
  void push_once(Job job) requires std::equality_comparable<Job> {
    push_unless(std::move(job), [](const auto& jobs, const Job& other) {
      return std::find(jobs.begin(), jobs.end(), other) != jobs.end();
    });
  }

  /// The number of jobs in the queue, without the running one.
  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
  }
  /// Whether no job runs or waits.
  [[nodiscard]] bool idle() const {
    const std::lock_guard lock(mutex_);
    return jobs_.empty() && !busy_;
  }
  /// Waits until fewer than `count` jobs are in the queue.
  void wait_for_room(std::size_t count) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_.size() < count; });
    rethrow_failure();
  }
  /// Waits until no job runs or waits.
  void wait() const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_.empty() && !busy_; });
    rethrow_failure();
  }

 private:
  template <class Unwanted>
  void push_unless(Job job, Unwanted&& is_unwanted) {
    {
      const std::lock_guard lock(mutex_);
      rethrow_failure();
      if (ends_ || is_unwanted(jobs_, job)) return;
      jobs_.push_back(std::move(job));
    }
    changed_.notify_all();
  }
  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }
  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return ends_ || !jobs_.empty(); });
      if (ends_) {
        jobs_.clear();  // nobody shall wait for them
        changed_.notify_all();
        return;
      }
      Job job = std::move(jobs_.front());
      jobs_.pop_front();
      busy_ = true;
      lock.unlock();
      changed_.notify_all();
      std::exception_ptr thrown;
      try {
        work_(std::move(job));
      } catch (...) {
        thrown = std::current_exception();
      }
      lock.lock();
      if (thrown) {
        failure_ = std::move(thrown);
        ends_ = true;
      }
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
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace orbis::slam::detail
