// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The back end: mapping, loop closing and global adjustment, at once or in threads of their own.
#pragma once

#include <cstddef>
#include <memory>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/loops/loop_closer.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>
#include <orbis/slam/detail/system/worker.hpp>

namespace orbis::slam::detail {

/// Works on each new keyframe: local mapping, then loop closing, then, if a loop was closed, global adjustment. With
/// threads each of the three has one, and passes the keyframe on to the next. No queue grows without a bound: mapping
/// waits while too many keyframes wait for loop closing, and a map waits once for its adjustment.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class back_end {
 public:
  explicit back_end(shared_state<Camera, D, Places>& shared) : shared_{shared}, mapper_{shared}, closer_{shared} {
    if (!shared.settings.threads.enabled) return;
    global_ = std::make_unique<worker<map_id>>([this](map_id m) { closer_.adjust_globally(m); });
    loops_ = std::make_unique<worker<map_keyframe>>([this](map_keyframe k) {
      if (closer_.close(k)) global_->push_once(shared_.locked([&] { return shared_.atlas.current(k).map; }));
    });
    mapping_ = std::make_unique<worker<map_keyframe>>([this](map_keyframe k) {
      // Where frames wait for the mapping, the load of the machine decides about time, not about the map.
      mapper_.process(k, [this] { return !shared_.settings.threads.wait && mapping_->waiting() != 0; });
      loops_->wait_for_room(most_waiting());
      loops_->push(k);
    });
  }
  back_end(const back_end&) = delete;
  back_end& operator=(const back_end&) = delete;
  /// Waits for the running jobs and drops the others.
  ~back_end() {
    closer_.stop();
    // Each passes jobs to the next one, and queries its own queue: none is destroyed until all have stopped.
    if (mapping_) mapping_->stop();
    if (loops_) loops_->stop();
    if (global_) global_->stop();
  }

  /// Works on a keyframe, or, with threads, adds it to the queue. No lock is held.
  void process(map_keyframe k) {
    if (mapping_) return mapping_->push(k);
    mapper_.process(k, [] { return false; });
    if (closer_.close(k)) closer_.adjust_globally(shared_.atlas.current(k).map);
  }
  /// Whether so many keyframes wait that no further one should be made.
  [[nodiscard]] bool is_full() const { return mapping_ && mapping_->waiting() >= most_waiting(); }
  /// Waits until `is_full` is false.
  void wait_for_room() const {
    if (mapping_) mapping_->wait_for_room(most_waiting());
  }
  /// Waits until the threads have nothing to do.
  void wait() const {
    if (mapping_) mapping_->wait();
    if (loops_) loops_->wait();
    if (global_) global_->wait();
  }

 private:
  [[nodiscard]] std::size_t most_waiting() const {
    return shared_.settings.threads.max_waiting == 0 ? 1 : shared_.settings.threads.max_waiting;
  }

  shared_state<Camera, D, Places>& shared_;
  local_mapper<Camera, D, Places> mapper_;
  loop_closer<Camera, D, Places> closer_;
  std::unique_ptr<worker<map_id>> global_;  ///< null without threads, as the others
  std::unique_ptr<worker<map_keyframe>> loops_, mapping_;
};

}  // namespace orbis::slam::detail
