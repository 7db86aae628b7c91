// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Removes moving objects from a live map: the pixels of the last keyframes that the rays of other keyframes pass
/// through are taken out of their depth images while the camera moves.
///
/// The log-odds of a voxel become those of free space only if more rays pass through it than end in it. Somebody who
/// walks through a room leaves voxels in which one or two scans end and which few later scans see. The depth images of
/// a few keyframes tell more, because each measurement says that the space before its end is empty.
/// `cloud/ray_evidence.hpp` does the same for a whole cloud, and names its sources. Coarse depth images that decide and
/// can be overruled later are described by G. Kim, A. Kim, "Remove, then Revert: Static Point Cloud Map Construction
/// Using Multiresolution Range Images", IROS 2020.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

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

/// Judges the last keyframes of a live map by each other, and gives the map the result: a later keyframe whose rays
/// pass through what an earlier one shows takes it out, and one that shows it again brings it back. The result is a
/// depth image with fewer pixels (`live_map::set_depth`), so that the map stays the one of these images and the
/// keyframes' poses. Keyframes are compared at the poses that the map was told last (`live_map::wanted_pose`), for
/// those are of one moment; in the map, a keyframe that waits for a correction is still at an earlier one.
///
/// Keeps the last keyframes' depth images: 3.5 bytes a pixel for each. Memory is kept from keyframe to keyframe.
template <camera::camera_model Camera>
class moving_filter {
 public:
  using depth_view = camera::depth_view<std::uint16_t>;

  /// @pre options.keyframes > 0, min_through > 0; margins, slant, ratio and grow >= 0
  explicit moving_filter(Camera camera, const moving_filter_options& options = {})
      : judge_{std::move(camera), options} {}

  /// live_map::add_keyframe, without the pixels that the last keyframes look through; and then set_depth for those of
  /// them that this one judges otherwise than before, whose change the map follows with `correct`. A keyframe with a
  /// pose that is not finite goes to the map as it is. The same for every policy. Errors: those of both. O(pixels +
  /// cells x keyframes), and marking. @pre as for add_keyframe; `map` is always the same
  template <execution_policy Policy, octree::replayable_octree Octree, depth_history Depths>
  result<octree::integration_summary> add_keyframe(const Policy& policy, live_map<Octree, Camera, Depths>& map,
                                                   std::uint64_t frame, const depth_view& depth,
                                                   const se3& T_world_camera) {
    forget(frame);
    if (!T_world_camera.to_matrix().allFinite()) return map.add_keyframe(policy, frame, depth, T_world_camera);
    auto& now =
        judge_.add(policy, frame, depth, T_world_camera, [&](const auto& v) { return map.wanted_pose(v.frame); });
    result<octree::integration_summary> added{};
    if (judge_.judge(now) == 0) {
      added = map.add_keyframe(policy, frame, depth, T_world_camera);
    } else {
      judge_.accept(now);
      added = map.add_keyframe(policy, frame, judge_.masked(now), T_world_camera, completeness::filtered);
    }
    result<void> changed{};
    for (auto& v : judge_.views()) {
      if (&v == &now) continue;
      const std::size_t differ = judge_.judge(v);
      const bool leaves = judge_.is_full() && &v == &judge_.views().front();
      if (differ == 0 ||
          (!leaves && static_cast<double>(differ) < options().least_change * static_cast<double>(v.cells.size())))
        continue;
      judge_.accept(v);
      if (!map.contains(v.frame)) continue;
      if (auto set = map.set_depth(policy, v.frame, judge_.masked(v)); !set && changed) changed = std::move(set);
    }
    if (added && !changed) return fail(std::move(changed.error()));
    return added;
  }
  /// Judges this keyframe no more, nor by it: it was removed, or has got another verdict from elsewhere.
  void forget(std::uint64_t frame) { judge_.forget(frame); }
  /// Which share of a kept keyframe's cells is taken out; empty if it is not kept. O(cells).
  [[nodiscard]] std::optional<double> removed_share(std::uint64_t frame) const {
    for (const auto& v : judge_.views())
      if (v.frame == frame)
        return static_cast<double>(std::count(v.removed.begin(), v.removed.end(), std::uint8_t{1})) /
               static_cast<double>(v.removed.size());
    return std::nullopt;
  }
  [[nodiscard]] const moving_filter_options& options() const noexcept { return judge_.options(); }

 private:
  detail::moving_judge<Camera> judge_;
};

}  // namespace orbis::mapping
