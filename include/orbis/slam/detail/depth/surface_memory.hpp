// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The surfaces of the last keyframes, which follow corrections of the map.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/detail/depth/alignment.hpp>
#include <orbis/slam/detail/depth/surface.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

/// Surfaces by the keyframe that they move with. When there is no room, the one that was asked for longest ago goes.
class surface_memory {
 public:
  explicit surface_memory(std::size_t capacity) : capacity_{std::max<std::size_t>(capacity, 1)} {}

  /// Keeps a surface, which is exchanged for one whose memory may be used again.
  void keep(map_keyframe anchor, const se3& T_anchor_camera, surface& s) {
    if (kept_.size() < capacity_) kept_.emplace_back();
    kept& k =
        *std::min_element(kept_.begin(), kept_.end(), [](const kept& a, const kept& b) { return a.used < b.used; });
    k.anchor = anchor;
    k.T_anchor_camera = T_anchor_camera;
    k.used = ++clock_;
    std::swap(k.seen, s);
  }

  /// The surfaces that a camera at a pose in the active map is nearest to, at most `count`, the nearest first. They
  /// stay valid until the next one is kept. O(surfaces).
  template <feature_descriptor D>
  void around(const basic_atlas<D>& maps, const se3& T_world_camera, std::size_t count,
              std::vector<placed_surface>& to) {
    near_.clear();
    for (std::uint32_t i = 0; i != kept_.size(); ++i) {
      const map_keyframe k = maps.current(kept_[i].anchor);
      if (k.map != maps.active_id() || !maps.active().remembers(k.keyframe)) continue;
      const se3 T = maps.active().pose_of(k.keyframe) * kept_[i].T_anchor_camera;
      near_.push_back({distance(T, T_world_camera), i, T});
    }
    std::sort(near_.begin(), near_.end(), [](const near& a, const near& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
    });
    to.clear();
    for (std::size_t i = 0; i < std::min(count, near_.size()); ++i) {
      kept& k = kept_[near_[i].index];
      k.used = ++clock_;
      to.push_back({&k.seen, near_[i].T_world_camera});
    }
  }

  /// How far the view has changed between two poses: metres, where a radian counts as two of them.
  [[nodiscard]] static double distance(const se3& a, const se3& b) {
    const se3 between = a.inverse() * b;
    return norm(between.translation()) + 2.0 * between.rotation().angle();
  }

 private:
  struct kept {
    map_keyframe anchor;
    se3 T_anchor_camera;
    std::uint64_t used = 0;
    surface seen;
  };
  struct near {
    double distance;
    std::uint32_t index;
    se3 T_world_camera;
  };

  std::size_t capacity_;
  std::uint64_t clock_ = 0;
  std::vector<kept> kept_;
  std::vector<near> near_;  ///< its memory is used again
};

}  // namespace orbis::slam::detail
