// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An occupancy map that grows with each keyframe, and is updated when keyframe poses change.
///
/// @code
///   using live = orbis::mapping::live_map<orbis::octree::occupancy_octree<>, orbis::camera::pinhole>;
///   live map{camera, {.resolution = 0.05}};
///   map.add_keyframe(seq, frame, depth, T_world_camera);        // in the map immediately
///   ...
///   map.set_poses(keyframes);                                   // after each step of the SLAM system
///   map.correct(seq, {.time = 5ms, .robot = T_world_camera.translation()});
///   const auto snapshot = map.snapshot();                       // for readers on other threads
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <ranges>
#include <span>
#include <string>
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
#include <orbis/mapping/detail/live/view_frustum.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/scan_history.hpp>

namespace orbis::mapping {

namespace detail {

[[nodiscard]] inline double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace detail

struct live_map_options {
  double resolution = 0.05;                   ///< edge length of a voxel, metres; > 0
  octree::integration_options integration{};  ///< options for every depth image
  /// Tolerance in voxels, >= 0: a keyframe is moved in the map when a change of its pose moves a point in its view by
  /// more than this. 0: when any bit of the pose changes, so that the map corresponds to the current poses whenever
  /// nothing is pending.
  double tolerance = 0.25;
  /// Number of keyframes that are moved before the map is updated, > 0: a larger number reduces the work; a smaller one
  /// updates the map earlier.
  std::size_t keyframes_per_replay = 16;
  /// Maximum number of frames between keyframes in the map; older ones are dropped. 0: keyframes only.
  std::size_t max_frames = 0;
};

/// The pose of a keyframe; any type with these members works.
struct keyframe_position {
  std::uint64_t frame = 0;  ///< index of its frame
  se3 T_world_camera;
};
template <class P>
concept keyframe_position_like = requires(const P& p) {
  { p.frame } -> std::convertible_to<std::uint64_t>;
  { p.T_world_camera } -> std::convertible_to<se3>;
};

/// Treatment of keyframes that are not listed: they keep their poses, or are removed from the map until they are listed
/// again (for example keyframes of another map of the atlas).
enum class unlisted { keep, hide };

/// State of a keyframe's depth image: as the camera measured it, or without the pixels that a filter removed.
enum class completeness { complete, filtered };

/// Limits of one call to live_map::correct.
struct correction_limits {
  /// Time limit; the keyframe or the batch of a few dozen bricks in progress is finished first.
  std::chrono::nanoseconds time = std::chrono::nanoseconds::max();
  std::optional<vec3> robot{};  ///< position in the world frame; keyframes near it are moved first
};

/// Result of a call to live_map::correct.
struct correction_progress {
  std::size_t keyframes = 0;  ///< number of moved keyframes
  std::size_t bricks = 0;     ///< number of updated bricks
  bool done = false;          ///< true if nothing is pending
};

/// An occupancy octree built from the depth images of keyframes. It stores the observations of each keyframe (see
/// octree::scan_history) and its depth image (in `Depths`), so that a keyframe can be moved, changed and removed.
///
/// When nothing is pending, the map is bit-identical to the one that `integrate` builds from the depth images in the
/// order of their frames, each at the `used_pose` of its keyframe. With tolerance 0 or after `finish`, these poses
/// equal the current ones; otherwise, they are within the tolerance of the current ones. The map depends neither on
/// policies nor on time limits.
///
/// Not thread-safe; live_map_thread.hpp provides a map with its own thread. With orbis::compiled, an octree with a
/// model other than log_odds<> also needs octree/scan_history-inl.hpp.
template <octree::replayable_octree Octree, camera::camera_model Camera, depth_history Depths = depth_store>
class live_map {
 public:
  using octree_type = Octree;
  using depth_view = camera::depth_view<std::uint16_t>;

  /// @pre options.resolution > 0 and finite; tolerance >= 0; keyframes_per_replay > 0
  explicit live_map(Camera camera, const live_map_options& options = {}, Depths depths = Depths{})
      : camera_{std::move(camera)},
        options_{options},
        frustum_{camera_},
        depths_{std::move(depths)},
        history_{options.resolution} {
    assert(options.tolerance >= 0 && options.keyframes_per_replay > 0);
  }

  // -- scans

  /// Adds a keyframe, or replaces the depth image and pose of an existing one. `frame`: the index of its frame, which
  /// orders keyframes; `depth`: as integrated into the map, without the pixels that a filter removed; `T_world_camera`:
  /// if it is not finite, the keyframe waits outside the map for a pose. The newest keyframe is in the map immediately.
  /// `what` is only recorded, see is_filtered. `whole`: the stored values of `depth` including the pixels that a filter
  /// removed, which set_depth may restore; empty: none was removed. Errors: those of `Depths::put`; the keyframe is
  /// nevertheless in the map. O(marking, see octree::scan_marker) and Depths::put. @pre the images have the camera's
  /// size
  template <execution_policy Policy>
  result<octree::integration_summary> add_keyframe(const Policy& policy, std::uint64_t frame, const depth_view& depth,
                                                   const se3& T_world_camera,
                                                   completeness what = completeness::complete,
                                                   image_view<const std::uint16_t> whole = {}) {
    const auto summary = insert(policy, frame, depth, T_world_camera, what);
    const bool is_masked = masks_depth<Depths> && !whole.empty();
    auto kept = depths_.put(frame, is_masked ? whole : depth.pixels());
    if (is_masked)
      if (auto masked = mask(frame, depth.pixels()); kept) kept = std::move(masked);
    if (!kept) return fail(std::move(kept.error()));
    return summary;
  }
  /// Replaces the set of pixels that are removed from the depth image of a keyframe, for example when a filter has a
  /// new result. Removed pixels are 0 in `depth`. `correct` updates the map. Errors: not_found; those of
  /// `Depths::mask`, or of `Depths::put` if there is no `mask`.
  /// @pre depth has the camera's size; its nonzero pixels equal those of the keyframe's image (`whole` in add_keyframe)
  template <execution_policy Policy>
  result<void> set_depth(const Policy& policy, std::uint64_t frame, const depth_view& depth) {
    const entry* const k = find(frame);
    if (k == nullptr) return fail(errc::not_found, "keyframe " + std::to_string(frame), "the map has no such keyframe");
    const se3 pose = k->wanted ? *k->wanted : se3{so3{}, filled<vec3>(std::numeric_limits<double>::quiet_NaN())};
    insert(policy, frame, depth, pose, completeness::filtered);
    return mask(frame, depth.pixels());
  }
  /// Removes pixels from the depth images of several keyframes: `remove_pixels(i, depth, pixels)` sets the pixels to
  /// remove from the image of `frames[i]` to 0 in `pixels`, a copy of the stored values of `depth`; it is called on
  /// several threads. Keyframes are changed in groups of one per thread; if `remove_pixels` throws, the whole group is
  /// unchanged. `correct` updates the map. Stops when `on_progress`, which counts the keyframes, returns false. Errors:
  /// not_found, before anything is changed; those of `Depths::get`, in which case the keyframe is removed and the rest
  /// of its group is unchanged; those of set_depth, after all keyframes are processed; cancelled. For each keyframe
  /// O(pixels), Depths::get and mask, and marking. @pre no frame is listed twice
  template <execution_policy Policy, class RemovePixels>
  result<void> edit_depths(const Policy& policy, std::span<const std::uint64_t> frames,
                           const RemovePixels& remove_pixels, progress on_progress = {}) {
    assert(are_different(frames));
    for (const std::uint64_t frame : frames)
      if (find(frame) == nullptr)
        return fail(errc::not_found, "keyframe " + std::to_string(frame), "the map has no such keyframe");
    result<void> kept{};
    const std::size_t at_once = std::max(1U, policy.threads());
    for (std::size_t next = 0; next != frames.size();) {
      const std::size_t count = std::min(at_once, frames.size() - next);
      const auto group = frames.subspan(next, count);
      const auto edit = [&](const auto& how, std::size_t i) {
        worker& w = workers_[i];
        const entry& k = *find(group[i]);
        w.edited = w.depth;
        remove_pixels(next + i, make_view(k, w.depth), w.edited.view());
        if (k.wanted)
          w.marker.mark(how, history_.grid(), make_view(k, w.edited), camera_, *k.wanted, options_.integration,
                        w.voxels);
      };
      if (auto read = read_and_work(policy, group, edit); !read) return read;
      for (std::size_t i = 0; i != count; ++i) {
        worker& w = workers_[i];
        entry& k = *find(group[i]);
        if (k.used) drop_frames_after(k.frame);
        k.filtered = true;
        k.reach = std::min(detail::largest_depth(make_view(k, w.edited)), options_.integration.max_range);
        set_waiting(k, false);
        k.used = k.wanted;
        if (k.used) history_.set(k.frame, w.voxels);
        if (auto masked = mask(k.frame, w.edited.view()); !masked) kept = std::move(masked);
      }
      next += count;
      if (!on_progress(next, frames.size())) return fail(errc::cancelled, {}, "cancelled");
    }
    return kept;
  }
  /// Adds a frame that lies between keyframes. Its pose was measured relative to `keyframe`, and it is inserted
  /// relative to that keyframe's pose in the map. It adds observations to the map but is not kept for corrections: it
  /// is removed from the map when there are more than `max_frames`, when its keyframe moves, is hidden or removed, and
  /// with `finish`. Accepts any depth source. Returns false if `max_frames` is 0, the keyframe is not in the map, the
  /// pose is not finite, or the frame is a keyframe. O(marking). @pre depth has the camera's size
  template <execution_policy Policy, camera::depth_source Depth>
  bool add_frame(const Policy& policy, std::uint64_t frame, const Depth& depth, std::uint64_t keyframe,
                 const se3& T_keyframe_camera) {
    assert(depth.width() == camera_.width() && depth.height() == camera_.height());
    const entry* const k = find(keyframe);
    if (options_.max_frames == 0 || k == nullptr || !k->used || find(frame) != nullptr || !if_finite(T_keyframe_camera))
      return false;
    std::erase_if(frames_, [&](const transient& t) { return t.frame == frame; });
    // Drop several at a time, so that the bricks they share are replayed only once.
    if (frames_.size() >= options_.max_frames) drop_oldest_frames(1 + options_.max_frames / 4);
    history_.set(policy, frame, depth, camera_, *k->used * T_keyframe_camera, options_.integration);
    frames_.push_back({frame, keyframe});
    return true;
  }
  /// Removes a culled keyframe; `correct` updates the map. Returns false if it does not exist. O(bricks of the
  /// keyframe).
  bool remove(std::uint64_t frame) {
    entry* const k = find(frame);
    if (k == nullptr) return false;
    hide(*k);
    depths_.erase(frame);
    keyframes_.erase(keyframes_.begin() + (k - keyframes_.data()));
    return true;
  }

  // -- corrections

  /// Sets the current poses of keyframes, in any order; `correct` updates the map. Frames that are not keyframes of the
  /// map are skipped; a pose that is not finite hides its keyframe. Returns the number of keyframes waiting to be
  /// moved. O(poses x log keyframes), about 0.1 us each.
  template <std::ranges::input_range Poses>
  requires keyframe_position_like<std::ranges::range_value_t<Poses>> std::size_t set_poses(
      const Poses& poses, unlisted others = unlisted::keep) {
    ++round_;
    for (const auto& p : poses) {
      entry* const k = find(p.frame);
      if (k == nullptr) continue;
      k->listed = round_;
      want(*k, if_finite(se3(p.T_world_camera)));
    }
    if (others == unlisted::hide)
      for (entry& k : keyframes_)
        if (k.listed != round_) want(k, std::nullopt);
    return waiting_;
  }
  /// Moves keyframes whose poses are out of tolerance to their current poses, and updates the map, until the time
  /// limit. Keyframes whose views moved far and that are close to the robot come first. Every call makes progress if
  /// anything is pending. Errors: those of `Depths::get`. A keyframe whose image is lost is removed; the next call
  /// continues with the others. O(keyframes) and, for each keyframe that is moved, marking and replaying; O(1) if
  /// nothing is pending.
  template <execution_policy Policy>
  result<correction_progress> correct(const Policy& policy, const correction_limits& limits = {}) {
    correction_progress progress;
    if (pending() == 0) {
      progress.done = true;
      return progress;
    }
    const auto start = std::chrono::steady_clock::now();
    const auto left = [&] {
      const auto used = std::chrono::steady_clock::now() - start;
      return used < limits.time ? limits.time - used : std::chrono::nanoseconds{0};
    };
    const auto has_time = [&] { return left() > std::chrono::nanoseconds{0}; };
    const auto replay = [&] {
      progress.bricks += history_.replay(policy, {.time = left()});
      if (history_.stale_bricks() == 0) moved_since_replay_ = 0;
    };
    list_by_priority(limits.robot);
    std::size_t next = 0;
    while (next != queue_.size() && (next == 0 || has_time())) {
      if (moved_since_replay_ >= options_.keyframes_per_replay && history_.stale_bricks() != 0) {
        replay();
        if (!has_time()) break;
      }
      const std::size_t count = std::min<std::size_t>(std::max(1U, policy.threads()), queue_.size() - next);
      if (auto moved = move_next(policy, next, count); !moved) return fail(std::move(moved.error()));
      progress.keyframes += count;
      moved_since_replay_ += count;
      next += count;
    }
    if (next == queue_.size() && (next == 0 || has_time())) replay();
    progress.done = pending() == 0;
    return progress;
  }
  /// Moves every keyframe whose pose differs in any bit from its pose in the map, drops the frames between keyframes,
  /// and updates the map, which then equals the map rebuilt from the current keyframes and poses. Returns the work
  /// done. Errors: those of `correct`.
  template <execution_policy Policy>
  result<correction_progress> finish(const Policy& policy) {
    correction_progress all{.keyframes = 0, .bricks = 0, .done = true};
    drop_oldest_frames(frames_.size());
    for (entry& k : keyframes_)
      if (k.used && k.wanted && differ(*k.used, *k.wanted)) set_waiting(k, true);
    while (pending() != 0) {
      const auto corrected = correct(policy);
      if (!corrected) return fail(corrected.error());
      all.keyframes += corrected->keyframes;
      all.bricks += corrected->bricks;
    }
    return all;
  }
  /// Amount of pending work: number of keyframes waiting to be moved plus number of stale bricks. O(1).
  [[nodiscard]] std::size_t pending() const noexcept { return waiting_ + history_.stale_bricks(); }

  // -- queries

  /// Returns the current map, which can be read at any time.
  [[nodiscard]] const Octree& map() const noexcept { return history_.map(); }
  /// A copy for readers on other threads; it shares memory with the map (copy on write). O(pages of 4 KB).
  [[nodiscard]] Octree snapshot() const { return history_.map(); }
  /// Log of changed voxels, see octree::scan_history::changes.
  [[nodiscard]] const octree::change_log& changes() const noexcept { return history_.changes(); }
  [[nodiscard]] octree::change_log& changes() noexcept { return history_.changes(); }
  [[nodiscard]] const Camera& camera() const noexcept { return camera_; }
  [[nodiscard]] const live_map_options& options() const noexcept { return options_; }
  [[nodiscard]] const Depths& depths() const noexcept { return depths_; }
  /// Number of keyframes, including hidden ones; `frames`: number of frames between keyframes in the map.
  [[nodiscard]] std::size_t size() const noexcept { return keyframes_.size(); }
  [[nodiscard]] std::size_t frames() const noexcept { return frames_.size(); }
  [[nodiscard]] bool contains(std::uint64_t frame) const noexcept { return find(frame) != nullptr; }
  /// Returns the pose of a keyframe in the map; empty if the keyframe is not in the map. O(log keyframes).
  [[nodiscard]] std::optional<se3> used_pose(std::uint64_t frame) const {
    const entry* const k = find(frame);
    return k == nullptr ? std::nullopt : k->used;
  }
  /// Returns the latest pose set for a keyframe, to which `correct` moves it; empty if the keyframe is hidden or does
  /// not exist. O(log keyframes).
  [[nodiscard]] std::optional<se3> wanted_pose(std::uint64_t frame) const {
    const entry* const k = find(frame);
    return k == nullptr ? std::nullopt : k->wanted;
  }
  /// Returns true if a keyframe's depth image lacks pixels that a filter removed: the image was changed by `set_depth`
  /// or `edit_depths`, or passed to `add_keyframe` as filtered. O(log keyframes).
  [[nodiscard]] bool is_filtered(std::uint64_t frame) const noexcept {
    const entry* const k = find(frame);
    return k != nullptr && k->filtered;
  }
  /// Heap memory in bytes, excluding that of `Depths`. O(bricks + keyframes).
  [[nodiscard]] std::size_t bytes() const noexcept {
    std::size_t n = history_.bytes() + history_.buffer_bytes() + map().memory_bytes() + map().buffer_bytes() +
                    keyframes_.capacity() * sizeof(entry) + frames_.capacity() * sizeof(transient) +
                    queue_.capacity() * sizeof(ranked) + group_.capacity() * sizeof(std::uint64_t) +
                    workers_.capacity() * sizeof(worker);
    for (const worker& w : workers_) {
      n += w.marker.bytes() + w.voxels.bytes();
      n += (w.depth.pixels().size() + w.edited.pixels().size()) * sizeof(std::uint16_t);
    }
    return n;
  }

 private:
  struct entry {
    std::uint64_t frame = 0;
    std::optional<se3> used;    ///< pose in the map
    std::optional<se3> wanted;  ///< target pose; empty: not in the map
    double scale = 1.0;         ///< scale of its depth image, see camera::depth_view
    float min_depth = 0.0F, max_depth = 0.0F;
    double reach = 0.0;  ///< largest depth in its image, metres
    bool waiting = false;
    bool filtered = false;
    std::uint64_t listed = 0;  ///< index of the last call to set_poses that listed the keyframe
  };
  struct transient {
    std::uint64_t frame, keyframe;
  };
  struct ranked {
    double urgency;
    std::uint64_t frame;
  };
  /// Buffers of one thread for marking a keyframe.
  struct worker {
    image<std::uint16_t> depth, edited;
    result<void> read;
    octree::scan_marker marker;
    octree::scan voxels;
  };

  /// Inserts an image into the map, but not into `depths_`.
  template <class Policy>
  octree::integration_summary insert(const Policy& policy, std::uint64_t frame, const depth_view& depth,
                                     const se3& T_world_camera, completeness what) {
    assert(depth.width() == camera_.width() && depth.height() == camera_.height());
    std::erase_if(frames_, [&](const transient& t) { return t.frame == frame; });  // it becomes a keyframe
    entry& k = make(frame);
    if (k.used) drop_frames_after(frame);
    k.filtered = what == completeness::filtered;
    k.scale = depth.scale();
    k.min_depth = depth.min_depth();
    k.max_depth = depth.max_depth();
    k.reach = std::min(detail::largest_depth(depth), options_.integration.max_range);
    set_waiting(k, false);
    k.wanted = if_finite(T_world_camera);
    k.used = k.wanted;
    if (k.used) return history_.set(policy, frame, depth, camera_, *k.used, options_.integration);
    history_.remove(frame);
    return {};
  }
  result<void> mask(std::uint64_t frame, image_view<const std::uint16_t> pixels) {
    if constexpr (masks_depth<Depths>)
      return depths_.mask(frame, pixels);
    else
      return depths_.put(frame, pixels);
  }
  [[nodiscard]] static std::optional<se3> if_finite(const se3& T) {
    return all_finite(T.to_matrix()) ? std::optional{T} : std::nullopt;
  }
  [[nodiscard]] static bool are_different(std::span<const std::uint64_t> frames) {
    std::vector<std::uint64_t> sorted(frames.begin(), frames.end());
    std::sort(sorted.begin(), sorted.end());
    return std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  }
  [[nodiscard]] static bool differ(const se3& a, const se3& b) { return a.to_matrix() != b.to_matrix(); }
  [[nodiscard]] static bool is_before(const entry& k, std::uint64_t frame) noexcept { return k.frame < frame; }
  [[nodiscard]] const entry* find(std::uint64_t frame) const noexcept {
    const auto at = std::lower_bound(keyframes_.begin(), keyframes_.end(), frame, is_before);
    return at == keyframes_.end() || at->frame != frame ? nullptr : &*at;
  }
  [[nodiscard]] entry* find(std::uint64_t frame) noexcept {
    return const_cast<entry*>(std::as_const(*this).find(frame));
  }
  [[nodiscard]] entry& make(std::uint64_t frame) {
    const auto at = std::lower_bound(keyframes_.begin(), keyframes_.end(), frame, is_before);
    if (at != keyframes_.end() && at->frame == frame) return *at;
    return *keyframes_.insert(at, entry{.frame = frame, .used = {}, .wanted = {}});
  }
  void set_waiting(entry& k, bool waiting) noexcept {
    waiting_ += static_cast<std::size_t>(waiting) - static_cast<std::size_t>(k.waiting);
    k.waiting = waiting;
  }
  /// Removes a keyframe from the map.
  void hide(entry& k) {
    k.wanted.reset();
    set_waiting(k, false);
    if (!k.used) return;
    k.used.reset();
    drop_frames_after(k.frame);
    history_.remove(k.frame);
  }
  void want(entry& k, const std::optional<se3>& pose) {
    if (!pose) {
      hide(k);
      return;
    }
    if (k.wanted && !differ(*k.wanted, *pose)) return;
    k.wanted = pose;
    const double tolerance = options_.tolerance * options_.resolution;
    set_waiting(k, !k.used || (tolerance > 0 ? frustum_.displacement(*k.used, *pose, k.reach) > tolerance
                                             : differ(*k.used, *pose)));
  }
  /// Lists the waiting keyframes, the most urgent first; equally urgent ones are in the order of their frames.
  void list_by_priority(const std::optional<vec3>& robot) {
    queue_.clear();
    if (waiting_ == 0) return;
    for (const entry& k : keyframes_) {
      if (!k.waiting) continue;
      const double moved = k.used ? frustum_.displacement(*k.used, *k.wanted, k.reach) : k.reach;
      const double distance = robot ? norm(k.wanted->translation() - *robot) : 0.0;
      queue_.push_back({moved / (1.0 + distance), k.frame});
    }
    std::sort(queue_.begin(), queue_.end(), [](const ranked& a, const ranked& b) {
      return a.urgency != b.urgency ? a.urgency > b.urgency : a.frame < b.frame;
    });
  }
  /// Moves `count` keyframes of the queue, each on its own thread.
  template <class Policy>
  result<void> move_next(const Policy& policy, std::size_t next, std::size_t count) {
    group_.clear();
    for (std::size_t i = 0; i != count; ++i) group_.push_back(queue_[next + i].frame);
    const auto mark = [&](const auto& how, std::size_t i) {
      worker& w = workers_[i];
      const entry& k = *find(group_[i]);
      w.marker.mark(how, history_.grid(), make_view(k, w.depth), camera_, *k.wanted, options_.integration, w.voxels);
    };
    if (auto read = read_and_work(policy, group_, mark); !read) return read;
    for (std::size_t i = 0; i != count; ++i) {
      entry& k = *find(queue_[next + i].frame);
      drop_frames_after(k.frame);
      history_.set(k.frame, workers_[i].voxels);
      k.used = k.wanted;
      set_waiting(k, false);
    }
    return {};
  }
  /// Reads the depth images of the keyframes `frames`, and calls `work(policy, i)` for each image that could be read,
  /// on separate threads if there are several. A keyframe whose image is lost is removed.
  template <class Policy, class Work>
  result<void> read_and_work(const Policy& policy, std::span<const std::uint64_t> frames, const Work& work) {
    const std::size_t count = frames.size();
    if (workers_.size() < count) workers_.resize(count);
    const auto read = [&](std::size_t i) { workers_[i].read = depths_.get(frames[i], workers_[i].depth); };
    constexpr bool reads_in_parallel = requires(const Depths& depths, image<std::uint16_t>& out) {
      depths.get(0, out);
    };
    if (!reads_in_parallel || count == 1)
      for (std::size_t i = 0; i != count; ++i) read(i);
    if (count == 1) {
      if (workers_[0].read) work(policy, 0);
    } else {
      for_each_index(policy, count, 1, [&](std::size_t i) {
        if (reads_in_parallel) read(i);
        if (workers_[i].read) work(seq, i);
      });
    }
    for (std::size_t i = 0; i != count; ++i) {
      if (workers_[i].read) continue;
      remove(frames[i]);
      return fail(std::move(workers_[i].read.error()));
    }
    return {};
  }
  [[nodiscard]] static depth_view make_view(const entry& k, const image<std::uint16_t>& pixels) {
    return depth_view{pixels.view(), k.scale, k.min_depth, k.max_depth};
  }
  /// Drops the oldest frames between keyframes.
  void drop_oldest_frames(std::size_t count) {
    count = std::min(count, frames_.size());
    for (std::size_t i = 0; i != count; ++i) history_.remove(frames_[i].frame);
    frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(count));
  }
  void drop_frames_after(std::uint64_t keyframe) {
    std::erase_if(frames_, [&](const transient& t) {
      if (t.keyframe == keyframe) history_.remove(t.frame);
      return t.keyframe == keyframe;
    });
  }

  Camera camera_;
  live_map_options options_;
  detail::view_frustum frustum_;
  Depths depths_;
  octree::scan_history<Octree> history_;
  std::vector<entry> keyframes_;   ///< sorted by frame
  std::vector<transient> frames_;  ///< in order of arrival
  std::size_t waiting_ = 0;        ///< number of waiting keyframes
  std::size_t moved_since_replay_ = 0;
  std::uint64_t round_ = 0;  ///< number of calls to set_poses
  std::vector<ranked> queue_;
  std::vector<std::uint64_t> group_;  ///< keyframes that are moved together
  std::vector<worker> workers_;
};

}  // namespace orbis::mapping
