// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes moving objects from a live map while the camera moves: pixels of the most recent keyframes' depth images are
/// removed if rays of other keyframes pass through them.
///
/// The log-odds of a voxel become those of free space only if more rays pass through it than end in it. A person
/// walking through a room leaves occupied voxels in which rays of one or two scans end and through which few later rays
/// pass. The depth images of a few keyframes contain more information, because each measurement shows that the space in
/// front of the measured point is empty. `cloud/ray_evidence.hpp` does the same for a whole cloud, and cites its
/// sources. Coarse depth images with decisions that can be reverted later are described by G. Kim, A. Kim, "Remove,
/// then Revert: Static Point Cloud Map Construction Using Multiresolution Range Images", IROS 2020.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/depth_history.hpp>
#include <orbis/mapping/detail/moving/moving_judge.hpp>
#include <orbis/mapping/live_map.hpp>
#include <orbis/mapping/moving_options.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/scan_history.hpp>

namespace orbis::mapping {

/// Compares the most recent keyframes of a live map with each other, and applies the result to the map: a surface is
/// removed from a keyframe when rays of other keyframes pass through it, and restored when enough later ones show it
/// again. A keyframe is inserted first; the others are compared with it afterwards, one at a time, so that no insertion
/// waits for the comparison. The result is a depth image with fewer pixels (`live_map::set_depth`); the map still
/// corresponds to the depth images and poses of its keyframes. Keyframes are compared at the latest poses given to the
/// map (`live_map::wanted_pose`), because these are consistent with each other, whereas a keyframe that waits for a
/// correction is still at an earlier pose in the map.
///
/// Stores the most recent keyframes' depth images, 3.5 bytes per pixel. Memory is reused from keyframe to keyframe.
template <camera::camera_model Camera>
class moving_filter {
 public:
  using depth_view = camera::depth_view<std::uint16_t>;

  /// @pre options.keyframes > 0, min_through > 0; margins, slant, ratio and grow >= 0
  explicit moving_filter(Camera camera, const moving_filter_options& options = {})
      : judge_{std::move(camera), options} {}

  /// Adds a keyframe to the map (live_map::add_keyframe), without the pixels that rays of the most recent keyframes
  /// pass through. Afterwards these keyframes are due for re-evaluation, see revise. A keyframe with a pose that is not
  /// finite is added to the map unchanged. The result is the same for every policy. Errors: those of
  /// live_map::add_keyframe and set_depth. O(pixels + cells x keyframes), and marking. @pre same as for
  /// live_map::add_keyframe; all calls pass the same `map`
  template <execution_policy Policy, octree::replayable_octree Octree, depth_history Depths>
  result<octree::integration_summary> add_keyframe(const Policy& policy, live_map<Octree, Camera, Depths>& map,
                                                   std::uint64_t frame, const depth_view& depth,
                                                   const se3& T_world_camera) {
    result<void> settled{};
    for (auto& v : judge_.views()) {
      judge_.ask_newest(policy, v, pose_in(map));
      if (v.unjudged && leaves_next(v)) settled = change(policy, map, v);
    }
    forget(frame);
    if (!all_finite(T_world_camera.to_matrix())) return map.add_keyframe(policy, frame, depth, T_world_camera);
    auto& now = judge_.add(policy, frame, depth, T_world_camera, pose_in(map));
    result<octree::integration_summary> added{};
    if (judge_.judge(now) == 0) {
      added = map.add_keyframe(policy, frame, depth, T_world_camera);
    } else {
      judge_.accept(now);
      added =
          map.add_keyframe(policy, frame, judge_.masked(now), T_world_camera, completeness::filtered, depth.pixels());
    }
    if (added && !settled) return fail(std::move(settled.error()));
    return added;
  }
  /// Number of recent keyframes that are due for re-evaluation, see revise. O(keyframes).
  [[nodiscard]] std::size_t due() const noexcept {
    return static_cast<std::size_t>(std::ranges::count_if(judge_.views(), [](const auto& v) { return is_due(v); }));
  }
  /// Re-evaluates one of the recent keyframes that are due, and updates its image in the map (live_map::set_depth) if
  /// the verdict has changed; live_map::correct then updates the map. Call it until no keyframe is due or a more urgent
  /// one arrives; the remaining keyframes are then evaluated together with that one. Errors: those of
  /// live_map::set_depth; the keyframe is nevertheless evaluated. O(cells), and marking if the image changes.
  template <execution_policy Policy, octree::replayable_octree Octree, depth_history Depths>
  result<void> revise(const Policy& policy, live_map<Octree, Camera, Depths>& map) {
    for (auto& v : judge_.views()) {
      if (!is_due(v)) continue;
      judge_.ask_newest(policy, v, pose_in(map));
      return change(policy, map, v);
    }
    return {};
  }
  /// Drops a keyframe from the comparison: it was removed, or its image was replaced.
  void forget(std::uint64_t frame) { judge_.forget(frame); }
  /// Share of a keyframe's cells that is removed; empty if the keyframe is not among the most recent ones. O(cells).
  [[nodiscard]] std::optional<double> removed_share(std::uint64_t frame) const {
    for (const auto& v : judge_.views())
      if (v.frame == frame)
        return static_cast<double>(std::count(v.removed.begin(), v.removed.end(), std::uint8_t{1})) /
               static_cast<double>(v.removed.size());
    return std::nullopt;
  }
  [[nodiscard]] const moving_filter_options& options() const noexcept { return judge_.options(); }

 private:
  using view = typename detail::moving_judge<Camera>::view;

  [[nodiscard]] static bool is_due(const view& v) noexcept { return v.due || v.unjudged; }
  template <class Map>
  [[nodiscard]] static auto pose_in(const Map& map) {
    return [&map](const view& v) { return map.wanted_pose(v.frame); };
  }
  [[nodiscard]] bool leaves_next(const view& v) const { return judge_.is_full() && &v == &judge_.views().front(); }
  /// Evaluates a keyframe of the map, and updates its image in the map if the verdict has changed for enough of its
  /// cells.
  template <class Policy, class Map>
  result<void> change(const Policy& policy, Map& map, view& v) {
    const std::size_t differ = judge_.judge(v);
    if (differ == 0) return {};
    const double least = leaves_next(v) ? 0.0 : options().least_change;
    if (static_cast<double>(differ) < least * static_cast<double>(v.cells.size())) return {};
    judge_.accept(v);
    if (!map.contains(v.frame)) return {};
    return map.set_depth(policy, v.frame, judge_.masked(v));
  }

  detail::moving_judge<Camera> judge_;
};

}  // namespace orbis::mapping
