// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A live map with its own thread: callers add keyframes and poses without waiting, and read snapshots.
///
/// @code
///   using live = orbis::mapping::live_map_thread<orbis::octree::occupancy_octree<>, orbis::camera::pinhole>;
///   live map{camera, {.map = {.resolution = 0.05}}};
///   map.add_keyframe(frame, depth, T_world_camera);                      // the tracking thread
///   map.set_poses(poses, orbis::mapping::unlisted::hide);                // after local adjustment, loops, merges
///   ...
///   const auto seen = map.latest();                                      // any thread
///   if (seen->map.state(p) == orbis::octree::occupancy::occupied) ...
/// @endcode
///
/// With a SLAM system, the thread reads the poses itself:
///
/// @code
///   live map{camera, {.map = {.resolution = 0.05}}, {.poll_poses = orbis::mapping::follow_keyframes(slam)}};
///   slam.listen({.keyframe_culled = [&map](const auto& e) { map.remove(e.frame); }});  // frees their depth images
/// @endcode
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/depth_history.hpp>
#include <orbis/mapping/depth_store.hpp>
#include <orbis/mapping/detail/live/map_jobs.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/live_map_events.hpp>
#include <orbis/mapping/moving_filter.hpp>

namespace orbis::mapping {

struct live_map_thread_options {
  live_map_options map{};
  unsigned threads = 1;          ///< number of threads that work on the map, including its own; > 0
  std::size_t max_waiting = 16;  ///< maximum number of waiting keyframes and frames; > 0
  /// Maximum time that `add_keyframe` waits for room if only keyframes are waiting; afterwards the keyframe is dropped.
  std::chrono::milliseconds patience{100};
  /// Duration of a slice of a correction, after which keyframes that have arrived in the meantime are inserted.
  std::chrono::microseconds correction_slice{5000};
  std::chrono::milliseconds poll_interval{30};  ///< interval between calls to live_map_listeners::poll_poses
  /// Removal of moved objects, see moving_filter; empty: no removal. If set, poses are also polled before each
  /// keyframe, and the keyframe is inserted at its pose at that moment.
  std::optional<moving_filter_options> moving{};
};

/// A live_map with a thread and a bounded queue. Requests are processed in order; corrections run in slices while no
/// request is waiting, and one slice after each insertion. If the queue is full, frames between keyframes are dropped
/// first, the oldest one first; then `add_keyframe` waits for a while; then the keyframe is dropped. All drops are
/// counted and reported. Poses that arrive faster than they are processed are merged.
///
/// All member functions are thread-safe, except that `stop` and the destructor must be called from one thread only.
template <octree::replayable_octree Octree, camera::camera_model Camera, depth_history Depths = depth_store>
class live_map_thread {
 public:
  using map_type = live_map<Octree, Camera, Depths>;
  using snapshot_type = live_map_snapshot<Octree>;
  using depth_view = typename map_type::depth_view;

  /// @pre same as for live_map; options.threads > 0, options.max_waiting > 0
  explicit live_map_thread(Camera camera, const live_map_thread_options& options = {},
                           live_map_listeners<Octree> listeners = {}, Depths depths = Depths{})
      : options_{options},
        policy_{par.with(options.threads)},
        listeners_{std::move(listeners)},
        map_{std::move(camera), options.map, std::move(depths)} {
    if (options_.moving) moving_.emplace(map_.camera(), *options_.moving);
    publish();
    thread_ = std::thread{[this] { run(); }};
  }
  live_map_thread(const live_map_thread&) = delete;
  live_map_thread& operator=(const live_map_thread&) = delete;
  /// Waits for the current step to finish; drops waiting requests.
  ~live_map_thread() { stop(); }

  // -- input

  /// Adds a keyframe, see live_map::add_keyframe; the image is copied, and passed to `prepare` on the map's thread.
  /// Returns false if the keyframe was dropped: too many keyframes are waiting, or the thread has ended. O(pixels);
  /// waits at most `patience`. @pre depth has the camera's size
  bool add_keyframe(std::uint64_t frame, const depth_view& depth, const se3& T_world_camera) {
    return add_scan({.kind = job::keyframe, .frame = frame, .T = T_world_camera}, depth);
  }
  /// Adds a frame between keyframes, see live_map::add_frame; the image is copied and prepared as in add_keyframe.
  /// Never waits. Returns false if it was dropped; `refused` reports frames that the map rejects. O(pixels). @pre depth
  /// has the camera's size
  bool add_frame(std::uint64_t frame, const depth_view& depth, std::uint64_t keyframe, const se3& T_keyframe_camera) {
    return add_scan({.kind = job::between, .frame = frame, .keyframe_of = keyframe, .T = T_keyframe_camera}, depth);
  }
  /// Removes a keyframe, see live_map::remove.
  void remove(std::uint64_t frame) { push({.kind = job::removal, .frame = frame}); }
  /// Sets the current poses, see live_map::set_poses.
  void set_poses(std::vector<keyframe_position> poses, unlisted others = unlisted::keep) {
    push({.kind = job::positions, .poses = std::move(poses), .others = others});
  }
  /// Sets the robot's position (metres, world frame): corrections begin near it.
  void set_robot(const vec3& position) {
    const std::lock_guard lock{mutex_};
    robot_ = position;
  }

  // -- output

  /// The latest snapshot. Never waits for the map: the lock is held only while a pointer is copied. O(1).
  [[nodiscard]] std::shared_ptr<const snapshot_type> latest() const {
    const std::lock_guard lock{published_mutex_};
    return latest_;
  }
  /// The latest snapshot without pending corrections; unchanged while a correction is in progress. O(1).
  [[nodiscard]] std::shared_ptr<const snapshot_type> settled() const {
    const std::lock_guard lock{published_mutex_};
    return settled_;
  }
  [[nodiscard]] live_map_counters counters() const {
    const std::lock_guard lock{mutex_};
    return counters_;
  }
  /// The error that ended the thread, if any: an exception from a listener or from `Depths`, or lack of memory. It was
  /// also reported to `failed`. Waiting requests are then dropped, waiting calls return, no further input is accepted,
  /// and the snapshots no longer change. Code: errc::exception.
  [[nodiscard]] std::optional<error> failure() const {
    const std::lock_guard lock{mutex_};
    return failure_;
  }

  // -- waiting

  /// Waits until all requests are processed and no correction is pending, or the thread has ended. Must not be called
  /// from callbacks.
  void wait() {
    if (listeners_.poll_poses) push({.kind = job::poll});  // poses may have moved since the last poll
    wait_until_idle();
  }
  /// Brings the map up to date with all keyframes and poses (see live_map::finish), and waits as `wait` does.
  void finish() {
    push({.kind = job::finish});
    wait_until_idle();
  }
  /// Asks the thread to end after its current step; waiting calls return. Does not wait; call `stop` later. May be
  /// called from any thread.
  void request_stop() {
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
    }
    changed_.notify_all();
  }
  /// Ends the thread, and returns the map to the caller; drops waiting requests. After a failure the map may only be
  /// destroyed, because a step was interrupted. Must not be called from callbacks.
  map_type& stop() {
    request_stop();
    if (thread_.joinable()) thread_.join();
    moving_.reset();  // up to 24 images are no longer needed
    const std::lock_guard lock{mutex_};
    jobs_.clear();
    spare_ = {};
    return map_;
  }

 private:
  using clock = std::chrono::steady_clock;
  using job = detail::map_job;

  // -- the queue, guarded by `mutex_`

  [[nodiscard]] bool is_idle() const noexcept { return jobs_.empty() && !busy_ && pending_ == 0; }
  void wait_until_idle() const {
    std::unique_lock lock{mutex_};
    changed_.wait(lock, [&] { return ends_ || is_idle(); });
  }
  [[nodiscard]] bool is_full() const noexcept { return jobs_.images() >= options_.max_waiting; }
  void push(job j) {
    {
      const std::lock_guard lock{mutex_};
      if (ends_) return;
      jobs_.push(std::move(j));
    }
    changed_.notify_all();
  }
  [[nodiscard]] static depth_use intended_use(const job& j) noexcept {
    return j.kind == job::keyframe ? depth_use::keyframe : depth_use::frame;
  }
  bool add_scan(job j, const depth_view& depth) {
    j.since = clock::now();
    j.scale = depth.scale();
    j.min_depth = depth.min_depth();
    j.max_depth = depth.max_depth();
    j.pixels = recycled_copy(depth.pixels());
    std::optional<job> dropped;
    bool added = false;
    {
      std::unique_lock lock{mutex_};
      if (is_full()) {
        dropped = jobs_.pop_frame();
        if (!dropped && j.kind != job::between)
          changed_.wait_for(lock, options_.patience, [&] { return ends_ || !is_full(); });
        if (!dropped && is_full()) dropped = jobs_.pop_frame();  // one that arrived while this one was waiting
      }
      if (ends_) return false;
      added = !is_full();
      if (added) {
        jobs_.push(std::move(j));
        counters_.most_waiting = std::max(counters_.most_waiting, jobs_.images());
      } else {
        dropped = std::move(j);
      }
      if (dropped) {
        spare_.push_back(std::move(dropped->pixels));
        ++(dropped->kind == job::keyframe ? counters_.dropped_keyframes : counters_.dropped_frames);
      }
    }
    changed_.notify_all();
    if (dropped && listeners_.overflowed) listeners_.overflowed({dropped->frame, intended_use(*dropped)});
    return added;
  }
  /// Returns a copy of the image, in recycled memory if available.
  [[nodiscard]] image<std::uint16_t> recycled_copy(image_view<const std::uint16_t> pixels) {
    image<std::uint16_t> copy;
    {
      const std::lock_guard lock{mutex_};
      if (!spare_.empty()) {
        copy = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    copy_pixels<std::uint16_t>(pixels, copy);
    return copy;
  }

  // -- the thread

  void run() noexcept {
    try {
      work();
    } catch (const std::exception& e) {
      give_up(e.what());
    } catch (...) {
      give_up("unknown");
    }
  }
  void give_up(const char* what) noexcept {
    error why{errc::exception, "live map", {}};
    try {
      why.message = what;
    } catch (...) {
      why.message = "no memory";  // short enough to need no allocation
    }
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
      jobs_.clear();
      spare_.clear();
      try {
        failure_ = why;
      } catch (...) {
        failure_ = error{errc::exception, "live map", "out of memory"};
      }
    }
    changed_.notify_all();
    try {
      report(why);
    } catch (...) {  // a failing listener cannot be notified
    }
  }
  void work() {
    if (listeners_.started) listeners_.started();
    std::unique_lock lock{mutex_};
    auto next_poll = clock::now();
    for (;;) {
      const auto wakes = [&] { return ends_ || !jobs_.empty() || pending_ != 0; };
      if (!listeners_.poll_poses)
        changed_.wait(lock, wakes);
      else
        changed_.wait_until(lock, next_poll, wakes);
      if (ends_) return;
      busy_ = true;
      std::optional<job> next;
      if (!jobs_.empty()) next = jobs_.pop();
      const std::size_t waiting = jobs_.images();
      const std::optional<vec3> robot = robot_;
      lock.unlock();
      changed_.notify_all();
      if (next) work_on(*next, waiting);
      if (listeners_.poll_poses && clock::now() >= next_poll) {
        poll();
        next_poll = clock::now() + options_.poll_interval;
      }
      if (due() != 0) revise(options_.correction_slice);
      if (map_.pending() != 0) correct(robot);
      publish();
      lock.lock();
      if (next && next->has_image() && spare_.size() < options_.max_waiting) spare_.push_back(std::move(next->pixels));
      pending_ = map_.pending() + due();
      busy_ = false;
      if (is_idle()) changed_.notify_all();
    }
  }
  void work_on(job& j, std::size_t waiting) {
    const auto start = clock::now();
    if (j.has_image() && listeners_.prepare) listeners_.prepare(j.frame, intended_use(j), j.pixels.view());
    const depth_view depth{j.pixels.view(), j.scale, j.min_depth, j.max_depth};
    bool inserted = false;
    switch (j.kind) {
      case job::keyframe: {
        bool judged = moving_.has_value();
        if (moving_ && listeners_.poll_poses) {
          // Keyframes are compared at poses from the same moment: the current ones, including that of the new keyframe.
          const keyframe_poses& now = poll(true);
          const auto at = std::ranges::find(now.poses, j.frame, &keyframe_position::frame);
          judged = at != now.poses.end();
          if (judged) j.T = at->T_world_camera;
          if (!judged) moving_->forget(j.frame);  // its data may belong to another image
          if (std::ranges::find(now.removed, j.frame) != now.removed.end()) break;
        }
        const auto added = judged ? moving_->add_keyframe(policy_, map_, j.frame, depth, j.T)
                                  : map_.add_keyframe(policy_, j.frame, depth, j.T);
        if (!added) report(added.error());
        inserted = true;
        poll_always_ = poll_always_ || !judged;
        break;
      }
      case job::between:
        inserted = map_.add_frame(policy_, j.frame, depth, j.keyframe_of, j.T);
        if (!inserted) tell_refusal(j);
        break;
      case job::removal:
        if (moving_) moving_->forget(j.frame);
        map_.remove(j.frame);
        break;
      case job::positions: map_.set_poses(j.poses, j.others); break;
      case job::poll: poll(); break;
      case job::finish:
        if (listeners_.poll_poses) poll();
        revise(std::chrono::nanoseconds::max());
        for (;;) {  // each error removes a keyframe
          const auto finished = map_.finish(policy_);
          correction_.milliseconds += detail::milliseconds_since(start);
          if (finished) {
            correction_.keyframes += finished->keyframes;
            correction_.bricks += finished->bricks;
            break;
          }
          report(finished.error());
        }
        if (correction_.keyframes + correction_.bricks != 0) tell_correction();
        correction_ = {};
        break;
    }
    if (inserted) tell_insertion(j, waiting, detail::milliseconds_since(start));
  }
  /// Polls the current poses and passes them to the map. Returns the reply: empty if the poses have not changed.
  const keyframe_poses& poll(bool always = false) {
    polled_.poses.clear();
    polled_.removed.clear();
    if (!listeners_.poll_poses(polled_, std::exchange(poll_always_, false) || always)) return polled_;
    for (const std::uint64_t frame : polled_.removed) {
      if (moving_) moving_->forget(frame);
      map_.remove(frame);
    }
    if (!polled_.removed.empty()) {
      const std::lock_guard lock{mutex_};
      jobs_.forget(polled_.removed);
    }
    map_.set_poses(polled_.poses, unlisted::hide);
    return polled_;
  }
  /// Number of recent keyframes that are due for re-evaluation, see moving_filter::revise.
  [[nodiscard]] std::size_t due() const noexcept { return moving_ ? moving_->due() : 0; }
  void revise(std::chrono::nanoseconds time) {
    const auto start = clock::now();
    while (due() != 0) {  // at least one, regardless of the time limit
      if (const auto revised = moving_->revise(policy_, map_); !revised) report(revised.error());
      if (clock::now() - start >= time) return;
    }
  }
  void correct(const std::optional<vec3>& robot) {
    const auto start = clock::now();
    const auto progress = map_.correct(policy_, {.time = options_.correction_slice, .robot = robot});
    correction_.milliseconds += detail::milliseconds_since(start);
    if (!progress) {  // the keyframe whose image is lost was removed
      report(progress.error());
      if (map_.pending() == 0) tell_correction();
      return;
    }
    correction_.keyframes += progress->keyframes;
    correction_.bricks += progress->bricks;
    if (progress->done) tell_correction();
  }
  void tell_correction() {
    const live_correction_event event = std::exchange(correction_, {});
    {
      const std::lock_guard lock{mutex_};
      ++counters_.corrections;
    }
    if (listeners_.corrected) listeners_.corrected(event);
  }
  void tell_insertion(const job& j, std::size_t waiting, double milliseconds) {
    {
      const std::lock_guard lock{mutex_};
      ++(j.kind == job::keyframe ? counters_.keyframes : counters_.frames);
    }
    publish();
    if (listeners_.inserted)
      listeners_.inserted(
          {j.frame, j.kind == job::keyframe, milliseconds, detail::milliseconds_since(j.since), waiting});
  }
  void tell_refusal(const job& j) {
    {
      const std::lock_guard lock{mutex_};
      ++counters_.refused_frames;
    }
    if (listeners_.refused) listeners_.refused({j.frame, j.keyframe_of});
  }
  void publish() {
    const std::uint64_t revision = map_.changes().revision();
    const std::size_t pending = map_.pending();
    if (latest_ && latest_->revision == revision && latest_->pending == pending && latest_->keyframes == map_.size())
      return;
    auto next = std::make_shared<const snapshot_type>(
        snapshot_type{map_.snapshot(), revision, map_.size(), map_.frames(), pending});
    std::shared_ptr<const snapshot_type> before_latest, before_settled;  // freed after the lock is released
    {
      const std::lock_guard lock{published_mutex_};
      before_latest = std::exchange(latest_, next);
      if (pending == 0) before_settled = std::exchange(settled_, next);
    }
    if (listeners_.published) listeners_.published(*next, map_.changes());
  }
  void report(const error& e) const {
    if (listeners_.failed) listeners_.failed(e);
  }

  const live_map_thread_options options_;
  const parallel_policy policy_;
  const live_map_listeners<Octree> listeners_;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  detail::map_jobs jobs_;
  std::vector<image<std::uint16_t>> spare_;  ///< images kept so that their memory is reused
  std::size_t pending_ = 0;                  ///< pending work of the map
  bool busy_ = false;
  bool ends_ = false;
  std::optional<error> failure_;
  std::optional<vec3> robot_;
  live_map_counters counters_;

  mutable std::mutex published_mutex_;
  std::shared_ptr<const snapshot_type> latest_, settled_;

  map_type map_;  ///< used only by the thread, like the members below
  std::optional<moving_filter<Camera>> moving_;
  keyframe_poses polled_;  ///< result of the last poll
  bool poll_always_ = true;
  live_correction_event correction_;
  std::thread thread_;
};

}  // namespace orbis::mapping
