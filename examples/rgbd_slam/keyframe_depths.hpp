// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The depth images of the keyframes: compressed once, in the background, and shared by tracking, the live map and the
/// final map.
#pragma once

#include <cstdint>
#include <future>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <utility>

#include <orbis/mapping/depth_store.hpp>

#include "background.hpp"
#include "priority.hpp"

namespace app {

/// A thread-safe `depth_store`.
class keyframe_depths {
 public:
  /// If `in_background` is false, images are compressed on the caller's thread.
  keyframe_depths(orbis::mapping::depth_store_options options, bool in_background)
      : store_{std::move(options)}, background_{in_background} {}
  keyframe_depths(const keyframe_depths&) = delete;
  keyframe_depths& operator=(const keyframe_depths&) = delete;

  /// Copies the image. First waits until the previous image is compressed, and rethrows any exception thrown by its
  /// compression. Call it from one thread only.
  void put(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    finish();
    std::shared_future<void> ahead;
    if (background_)
      ahead = thread_
                  .start([this, frame, copy = depth] {
                    if (!std::exchange(is_lowered_, true)) lower_priority(live_map_niceness);
                    keep(frame, copy);
                  })
                  .share();
    if (!ahead.valid()) keep(frame, depth);
    const std::lock_guard lock{ahead_mutex_};
    ahead_ = std::move(ahead);
  }
  /// Waits until the last image is compressed, and rethrows any exception thrown by its compression.
  void finish() const {
    if (const std::shared_future<void> last = ahead(); last.valid()) last.get();
  }

  /// See `depth_store`. The following functions first wait until the last image is compressed.
  [[nodiscard]] orbis::result<void> get(std::uint64_t frame, orbis::image<std::uint16_t>& out) const {
    wait();
    const std::shared_lock lock{mutex_};
    return store_.get(frame, out);
  }
  [[nodiscard]] orbis::result<void> get_whole(std::uint64_t frame, orbis::image<std::uint16_t>& out) const {
    wait();
    const std::shared_lock lock{mutex_};
    return store_.get_whole(frame, out);
  }
  orbis::result<void> mask(std::uint64_t frame, orbis::image_view<const std::uint16_t> pixels) {
    wait();
    const std::lock_guard lock{mutex_};
    return store_.mask(frame, pixels);
  }
  void erase(std::uint64_t frame) {
    wait();
    const std::lock_guard lock{mutex_};
    store_.erase(frame);
  }
  void free_buffers() {
    wait();
    const std::lock_guard lock{mutex_};
    store_.free_buffers();
  }
  /// The spill file error that forced images to be kept in memory; empty if there was none.
  [[nodiscard]] std::optional<orbis::error> unspilled() const {
    wait();
    const std::shared_lock lock{mutex_};
    return unspilled_;
  }

 private:
  [[nodiscard]] std::shared_future<void> ahead() const {
    const std::lock_guard lock{ahead_mutex_};
    return ahead_;
  }
  void wait() const {
    if (const std::shared_future<void> last = ahead(); last.valid()) last.wait();
  }
  void keep(std::uint64_t frame, const orbis::image<std::uint16_t>& depth) {
    const std::lock_guard lock{mutex_};
    if (auto kept = store_.put(frame, depth); !kept) unspilled_ = kept.error();
  }

  mutable std::shared_mutex mutex_;  // guards the store
  orbis::mapping::depth_store store_;
  std::optional<orbis::error> unspilled_;
  bool background_;
  mutable std::mutex ahead_mutex_;
  std::shared_future<void> ahead_;  // compression of the last image
  bool is_lowered_ = false;         // true once the thread has lowered its priority; used by that thread only
  background_thread thread_;        // uses the other members
};

/// The depth images of the live map, without the pixels that its filters removed. Models `mapping::masks_depth`.
class live_depths {
 public:
  /// @pre `all` contains each image before it is added here, and outlives this object
  explicit live_depths(keyframe_depths& all) : all_{&all} {}
  orbis::result<void> put(std::uint64_t frame, orbis::image_view<const std::uint16_t> pixels) {
    return all_->mask(frame, pixels);
  }
  orbis::result<void> mask(std::uint64_t frame, orbis::image_view<const std::uint16_t> pixels) {
    return all_->mask(frame, pixels);
  }
  [[nodiscard]] orbis::result<void> get(std::uint64_t frame, orbis::image<std::uint16_t>& out) const {
    return all_->get(frame, out);
  }
  void erase(std::uint64_t) {}  // the final map may need it

 private:
  keyframe_depths* all_;
};

}  // namespace app
