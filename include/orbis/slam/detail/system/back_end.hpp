// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The back end: mapping, loop closing and global adjustment, synchronously or in separate threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/loops/loop_closer.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

namespace orbis::slam::detail {

/// Calls `work` for each job in the order of `push`. `stop` and the destructor wait for the current job and discard the
/// others. If jobs use a pointer to their worker, call `stop` before resetting the pointer. If `work` throws, the
/// worker ends: the other jobs are discarded, and `push`, `wait` and `wait_for_room` rethrow the exception afterwards.
template <std::movable Job>
class worker {
 public:
  explicit worker(std::function<void(Job)> work) : work_{std::move(work)}, thread_{[this] { run(); }} {}
  worker(const worker&) = delete;
  worker& operator=(const worker&) = delete;
  ~worker() { stop(); }

  /// Waits for the current job; no other job is started. Must not be called by a job.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// Appends a job; after `stop`, discards it.
  void push(Job job) {
    push_unless(std::move(job), [](const auto&, const Job&) { return false; });
  }
  /// Like `push`, but does nothing if an equal job is already in the queue.
  void push_once(Job job) requires std::equality_comparable<Job> {
    push_unless(std::move(job), [](const auto& jobs, const Job& other) {
      return std::find(jobs.begin(), jobs.end(), other) != jobs.end();
    });
  }

  /// The number of jobs in the queue, excluding the current one.
  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
  }
  /// Returns true if no job is running or waiting.
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
  /// Waits until no job is running or waiting.
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
        jobs_.clear();  // so that no caller waits for them
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

/// Processes each new keyframe: local mapping, then loop closing, then, if a loop was closed, global adjustment. With
/// threads, each of the three has a separate thread and passes the keyframe to the next. The mapping thread also
/// localises young frames again. All queues are bounded: mapping waits while too many keyframes are waiting for
/// loop closing, and a map is queued for adjustment at most once.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class back_end {
 public:
  /// `improve_frame`: improves the pose of one frame after a keyframe has been mapped, and returns false if there is
  /// none; it is called with `shared.lock()` held, for one frame at a time.
  explicit back_end(
      shared_state<Camera, D, Places>& shared, std::function<bool()> improve_frame = [] { return false; })
      : shared_{shared}, mapper_{shared}, closer_{shared}, improve_frame_{std::move(improve_frame)} {
    if (!shared.settings.threads.enabled) return;
    global_ = std::make_unique<worker<map_id>>([this](map_id m) { closer_.adjust_globally(m); });
    loops_ = std::make_unique<worker<map_keyframe>>([this](map_keyframe k) {
      if (!stopped_ && closer_.close(k))
        global_->push_once(shared_.locked([&] { return shared_.atlas.current(k).map; }));
    });
    mapping_ = std::make_unique<worker<map_keyframe>>([this](map_keyframe k) {
      if (stopped_) return;
      // If `track` waits for mapping, the load of the machine must affect only the time, not the map.
      map_keyframe_and_frames(
          k, [this] { return stopped_ || (!shared_.settings.threads.wait && mapping_->waiting() != 0); });
      loops_->wait_for_room(most_waiting());
      loops_->push(k);
    });
  }
  back_end(const back_end&) = delete;
  back_end& operator=(const back_end&) = delete;
  /// Waits for the current jobs and discards the others.
  ~back_end() {
    stop();
    // Each worker pushes jobs to the next one and queries its own queue: none may be destroyed until all have stopped.
    if (mapping_) mapping_->stop();
    if (loops_) loops_->stop();
    if (global_) global_->stop();
  }

  /// Processes a keyframe or, with threads, adds it to the queue. Must be called without a lock held.
  void process(map_keyframe k) {
    if (mapping_) return mapping_->push(k);
    if (stopped_) return;
    map_keyframe_and_frames(k, [this] { return stopped_.load(); });
    if (!stopped_ && closer_.close(k)) closer_.adjust_globally(shared_.atlas.current(k).map);
  }
  /// Requests that the work end soon: adjustments end early; waiting and later keyframes are not processed. May be
  /// called from any thread.
  void stop() noexcept {
    stopped_ = true;
    closer_.stop();
  }
  /// Returns true if the maximum number of keyframes are waiting, so that no more should be created.
  [[nodiscard]] bool is_full() const { return mapping_ && mapping_->waiting() >= most_waiting(); }
  /// Waits until `is_full` is false.
  void wait_for_room() const {
    if (mapping_) mapping_->wait_for_room(most_waiting());
  }
  /// Waits until the threads are idle.
  void wait() const {
    if (mapping_) mapping_->wait();
    if (loops_) loops_->wait();
    if (global_) global_->wait();
  }

 private:
  void map_keyframe_and_frames(map_keyframe k, const std::function<bool()>& stop_requested) {
    mapper_.process(k, stop_requested);
    if (stopped_ || !shared_.locked(improve_frame_)) return;  // at least one, even if another keyframe waits
    while (!stop_requested() && shared_.locked(improve_frame_)) {
    }
  }
  [[nodiscard]] std::size_t most_waiting() const {
    return shared_.settings.threads.max_waiting == 0 ? 1 : shared_.settings.threads.max_waiting;
  }

  shared_state<Camera, D, Places>& shared_;
  std::atomic<bool> stopped_{false};
  local_mapper<Camera, D, Places> mapper_;
  loop_closer<Camera, D, Places> closer_;
  std::function<bool()> improve_frame_;
  std::unique_ptr<worker<map_id>> global_;  ///< null, like the other workers, if there are no threads
  std::unique_ptr<worker<map_keyframe>> loops_, mapping_;
};

}  // namespace orbis::slam::detail
