// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What has moved away in a whole range of keyframes.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ranges>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/detail/moving/moving_judge.hpp>
#include <orbis/mapping/keyframe.hpp>

namespace orbis::mapping::detail {

/// A depth image as a moving_judge wants it: itself, or a copy in quarters of a millimetre, without what is farther
/// away than 16 m. `copy` keeps the pixels.
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

/// For each keyframe the cells that the rays of those before and after it pass through; empty for those without a
/// finite pose, or whose depth image has not the camera's size. `go_on()` is called after each keyframe; if it returns
/// false, so does this, as far as it got. O(keyframes x (pixels + cells x options.keyframes)).
template <execution_policy Policy, keyframe_range Keyframes, camera::camera_model Camera, class GoOn>
[[nodiscard]] std::vector<std::vector<removed_cell>> find_moving(const Policy& policy, const Keyframes& keyframes,
                                                                 const Camera& camera,
                                                                 const moving_filter_options& options,
                                                                 const GoOn& go_on) {
  std::vector<std::vector<removed_cell>> found(std::ranges::size(keyframes));
  std::vector<se3> poses;
  moving_judge<Camera> judge{camera, options};
  const auto settle = [&](auto& view) {
    static_cast<void>(judge.judge(view));
    judge.accept(view);
    found[view.frame] = view.removed_cells();
  };
  image<std::uint16_t> copy;
  for (const auto& k : keyframes) {
    poses.push_back(k.T_world_camera);
    const bool fits = k.depth.width() == camera.width() && k.depth.height() == camera.height();
    if (fits && poses.back().to_matrix().allFinite()) {
      if (judge.is_full()) settle(judge.views().front());
      const auto pose_of = [&](const auto& v) { return std::optional{poses[v.frame]}; };
      judge.add(policy, poses.size() - 1, stored_depths(k.depth, copy), poses.back(), pose_of);
      for (auto& v : judge.views()) judge.ask_newest(policy, v, pose_of);
    }
    if (!go_on()) return found;
  }
  for (auto& view : judge.views()) settle(view);
  return found;
}

}  // namespace orbis::mapping::detail
