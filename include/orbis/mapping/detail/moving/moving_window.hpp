// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Detection of moved objects in keyframes that are traversed once, in order.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/detail/moving/moving_judge.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/moving_options.hpp>

namespace orbis::mapping::detail {

/// Returns a depth image in the format that moving_judge reads: the image itself, or a copy in units of 0.25 mm,
/// excluding depths beyond 16 m. `copy` stores the pixels.
template <camera::depth_source Depth>
[[nodiscard]] camera::depth_view<std::uint16_t> stored_depths(const Depth& depth, image<std::uint16_t>& copy) {
  if constexpr (std::same_as<Depth, camera::depth_view<std::uint16_t>>) {
    return depth;
  } else {
    constexpr float scale = 4000.0F;
    if (copy.width() != depth.width() || copy.height() != depth.height())
      copy = image<std::uint16_t>(depth.width(), depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) {
        const float stored = depth(x, y) * scale;
        copy(x, y) = stored >= 1.0F && stored < 65535.0F ? static_cast<std::uint16_t>(stored) : std::uint16_t{0};
      }
    return camera::depth_view<std::uint16_t>{copy.view(), static_cast<double>(scale)};
  }
}

/// Delays each keyframe until the keyframes before and after it have been compared with it; returns the keyframes in
/// order, each with the cells that show moved objects. Keeps at most `options.keyframes` + 1 keyframes. Without
/// options, no keyframe is evaluated.
template <camera::camera_model Camera, keyframe_like Keyframe>
class moving_window {
 public:
  struct judged_keyframe {
    std::size_t number = 0;  ///< position in the input
    Keyframe keyframe;
    std::vector<removed_cell> removed{};  ///< cells that show moved objects
  };

  moving_window(const Camera& camera, const std::optional<moving_filter_options>& options) {
    if (options) judge_.emplace(camera, *options);
  }
  /// Adds the next keyframe. O(pixels + cells x options.keyframes).
  /// @pre the image has the camera's size; the pose is finite; `pop` has returned all finished keyframes
  template <execution_policy Policy>
  void push(const Policy& policy, Keyframe k) {
    const se3 T_world_camera = k.T_world_camera;
    kept_.push_back({{count_++, std::move(k)}, T_world_camera});
    assert(all_finite(T_world_camera.to_matrix()));
    if (!judge_) {
      kept_.back().is_judged = true;
      return;
    }
    if (judge_->is_full()) record_verdict(judge_->views().front());
    const auto pose_of = [&](const auto& view) { return std::optional{at(view.frame).T_world_camera}; };
    const judged_keyframe& now = kept_.back().item;
    judge_->add(policy, now.number, stored_depths(now.keyframe.depth, copy_), T_world_camera, pose_of);
    for (auto& view : judge_->views()) judge_->ask_newest(policy, view, pose_of);
  }
  /// Ends the input: evaluates all remaining keyframes.
  void finish() {
    if (judge_)
      for (auto& view : judge_->views())
        if (!at(view.frame).is_judged) record_verdict(view);
  }
  /// Returns the next keyframe with a final verdict, if there is one.
  [[nodiscard]] std::optional<judged_keyframe> pop() {
    if (kept_.empty() || !kept_.front().is_judged) return std::nullopt;
    judged_keyframe out = std::move(kept_.front().item);
    kept_.pop_front();
    return out;
  }

 private:
  struct entry {
    judged_keyframe item;
    se3 T_world_camera;
    bool is_judged = false;
  };
  [[nodiscard]] entry& at(std::uint64_t number) {
    assert(!kept_.empty() && number >= kept_.front().item.number);
    return kept_[static_cast<std::size_t>(number) - kept_.front().item.number];
  }
  template <class View>
  void record_verdict(View& view) {
    static_cast<void>(judge_->judge(view));
    judge_->accept(view);
    entry& e = at(view.frame);
    e.item.removed = view.removed_cells();
    e.is_judged = true;
  }

  std::optional<moving_judge<Camera>> judge_;
  std::size_t count_ = 0;
  std::deque<entry> kept_;
  image<std::uint16_t> copy_;
};

}  // namespace orbis::mapping::detail
