// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pose constraints from the depth image of a frame, and the keyframe surfaces with which the depth image is aligned.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/depth/alignment.hpp>
#include <orbis/slam/detail/depth/surface.hpp>
#include <orbis/slam/detail/depth/surface_samples.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Surfaces, each attached to the keyframe with which it moves. If the memory is full, the least recently used surface
/// is replaced.
class surface_memory {
 public:
  explicit surface_memory(std::size_t capacity) : capacity_{std::max<std::size_t>(capacity, 1)} {}

  /// Stores a surface, and returns another one in `s` whose memory can be reused.
  void keep(map_keyframe anchor, const se3& T_anchor_camera, surface& s) {
    if (kept_.size() < capacity_) kept_.emplace_back();
    kept& k =
        *std::min_element(kept_.begin(), kept_.end(), [](const kept& a, const kept& b) { return a.used < b.used; });
    k.anchor = anchor;
    k.T_anchor_camera = T_anchor_camera;
    k.used = ++clock_;
    std::swap(k.seen, s);
  }

  /// Finds the surfaces nearest to a camera pose in the active map, at most `count`, the nearest first. They remain
  /// valid until the next call to `keep`. O(surfaces).
  template <feature_descriptor D>
  void around(const basic_atlas<D>& maps, const se3& T_world_camera, std::size_t count,
              std::vector<placed_surface>& to) {
    near_.clear();
    for (std::uint32_t i = 0; i != kept_.size(); ++i) {
      const map_keyframe k = maps.current(kept_[i].anchor);
      if (k.map != maps.active_id() || !maps.active().remembers(k.keyframe)) continue;
      const se3 T = maps.active().pose(k.keyframe) * kept_[i].T_anchor_camera;
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

  /// Returns the change of view between two poses, in metres; a radian counts as two metres.
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
  std::vector<near> near_;  ///< reused working memory
};

/// The result of aligning the depth of a frame.
struct depth_alignment {
  moving_pose at;
  int determined = 0;   ///< number of pose directions that the surfaces determine, out of six
  double least = 0.0;   ///< strength of the weakest direction: see `depth_equations::least`
  association seen;     ///< counts at the aligned pose
  bool is_only = true;  ///< true if no other pose fits nearly as well
};

/// Returns start poses for depth alignment: the predicted pose, the last pose, and the last pose turned left and right,
/// up and down, by the angle that a hand-held camera may turn during `interval`. `interval`: seconds since `last`.
[[nodiscard]] inline std::array<moving_pose, 8> search_starts(const se3& last, const se3& predicted, double interval) {
  const double angle = std::clamp(interval, 0.05, 0.25);  // about a radian per second
  std::array<moving_pose, 8> starts;
  starts[0].T_world_camera = predicted;
  starts[1].T_world_camera = last;
  std::size_t next = 2;
  for (const double sign : {-1.0, 1.0}) {
    starts[next++].T_world_camera = last * se3(so3::exp(vec3(0.0, sign * angle, 0.0)), zeros<vec3>());
    starts[next++].T_world_camera = last * se3(so3::exp(vec3(0.0, 2.0 * sign * angle, 0.0)), zeros<vec3>());
    starts[next++].T_world_camera = last * se3(so3::exp(vec3(sign * angle, 0.0, 0.0)), zeros<vec3>());
  }
  return starts;
}

/// Keeps surfaces of keyframes and compares frames with them. For each frame, call `set_depth` first; calling `keep` at
/// the end is optional. Allocates nothing once its buffers are large enough.
template <camera::camera_model Camera>
class depth_tracker {
 public:
  depth_tracker(const camera_rig<Camera>& rig, const depth_term_options& settings)
      : rig_{rig}, options_{settings}, memory_{settings.surfaces} {}

  [[nodiscard]] bool is_on() const noexcept { return options_.enabled || options_.recovers; }

  /// Sets the depth image of the next frame. Takes about half a millisecond.
  template <camera::depth_source Depth>
  void set_depth(const Depth& depth) {
    samples_.clear();
    now_.cells.clear();
    if (!is_on() || depth.width() != rig_.camera().width() || depth.height() != rig_.camera().height()) return;
    builder_.build(rig_.camera(), depth, 1.0 / rig_.model.bf, rig_.min_depth, rig_.max_depth, now_);
    sampler_.choose(now_, options_.points, samples_);
  }
  /// Records that the next frame has no depth image.
  void clear_depth() {
    samples_.clear();
    now_.cells.clear();
  }

  /// Finds the surfaces around a pose in the active map, for the functions below. Returns true if there are any.
  template <feature_descriptor D>
  bool find_surfaces(const basic_atlas<D>& maps, const se3& T_world_camera) {
    placed_.clear();
    if (samples_.size() < options_.min_points) return false;
    memory_.around(maps, T_world_camera, 2, placed_);
    return !placed_.empty();
  }
  /// Returns the result of the last call to `find_surfaces`.
  [[nodiscard]] bool has_surfaces() const noexcept { return !placed_.empty(); }

  /// Returns a quadratic model of the depth cost near `at`, which must be close to the true pose; empty if the surfaces
  /// do not constrain the pose.
  /// @pre find_surfaces was called
  [[nodiscard]] std::optional<pose_quadratic> term_at(const moving_pose& at, const camera::shutter& shutter) {
    const association seen = associate<Camera>(samples_, 1, placed_, at, shutter, rig_, close, planes_);
    if (seen.consistent < options_.min_points / 2) return std::nullopt;
    depth_equations e = build_equations(planes_, at, options_.effective_points, options_.weakest);
    if (e.determined == 0) return std::nullopt;
    if (shutter.is_depth_early()) e.term.hold_twist();  // see `early_depth_twist`
    return e.term;
  }

  /// Counts the points of the frame that agree with the surfaces around it at a given pose. @pre find_surfaces was
  /// called
  [[nodiscard]] association agreement(const moving_pose& at, const camera::shutter& shutter) {
    return associate<Camera>(samples_, 1, placed_, at, shutter, rig_, close, planes_);
  }
  /// Returns true if the depth agrees well enough to support the pose.
  [[nodiscard]] bool supports_pose(const association& seen) const noexcept {
    return seen.consistent >= options_.min_points && seen.share() >= options_.min_share;
  }

  /// Aligns the frame, starting from the best of several poses; empty if the result is uncertain. The pose keeps its
  /// start value in directions that the surfaces do not constrain. Takes about a millisecond. @pre find_surfaces was
  /// called
  template <class Starts>
  [[nodiscard]] std::optional<depth_alignment> align(const Starts& starts, const camera::shutter& shutter) {
    found_.clear();
    for (const moving_pose& start : starts) {
      found_.push_back(descend(start, shutter, 4, 0.4, 12));
      found_.back().seen =
          associate<Camera>(samples_, 4, placed_, found_.back().at, shutter, rig_, {.distance = 0.06}, planes_);
    }
    const auto fits_less = [](const depth_alignment& a, const depth_alignment& b) {
      return a.seen.consistent < b.seen.consistent;
    };
    const auto best = std::max_element(found_.begin(), found_.end(), fits_less);
    if (best == found_.end()) return std::nullopt;
    depth_alignment result = descend(best->at, shutter, 1, 0.1, 6);
    result.seen = agreement(result.at, shutter);
    if (!supports_pose(result.seen)) return std::nullopt;
    constexpr double apart = 0.1;
    for (const depth_alignment& other : found_)
      if (surface_memory::distance(other.at.T_world_camera, best->at.T_world_camera) > apart &&
          static_cast<double>(other.seen.consistent) > 0.8 * static_cast<double>(best->seen.consistent))
        result.is_only = false;
    return result;
  }
  /// Returns true if an alignment is reliable enough without landmarks.
  [[nodiscard]] bool determines_pose(const depth_alignment& found) const noexcept {
    constexpr double share = 0.85, visible = 0.35, least = 0.003;
    return found.is_only && found.least >= least && found.seen.share() >= share &&
           static_cast<double>(found.seen.visible) >= visible * static_cast<double>(samples_.size());
  }

  /// Stores the surface of the current frame at `T_anchor_camera` relative to keyframe `anchor`.
  void keep(map_keyframe anchor, const se3& T_anchor_camera, const vec6& twist, const camera::shutter& shutter) {
    if (now_.empty()) return;
    if (!shutter.is_global()) move_to_frame_time(twist, shutter);
    memory_.keep(anchor, T_anchor_camera, now_);
    now_.cells.clear();
  }
  /// Returns true if the nearest surface is so far from a pose that a new one is needed there.
  template <feature_descriptor D>
  [[nodiscard]] bool needs_surface(const basic_atlas<D>& maps, const se3& T_world_camera) {
    constexpr double far = 0.5;
    if (now_.empty()) return false;
    memory_.around(maps, T_world_camera, 1, placed_);
    return placed_.empty() || surface_memory::distance(placed_.front().T_world_camera, T_world_camera) > far;
  }

 private:
  static constexpr alignment_gate close{.distance = 0.03, .deviations = 2.0, .cosine = 0.85};

  /// Aligns the frame iteratively, with a gate that starts at `distance` (metres) and shrinks.
  depth_alignment descend(const moving_pose& start, const camera::shutter& shutter, std::size_t stride, double distance,
                          int iterations) {
    depth_alignment a;
    a.at = start;
    for (int i = 0; i != iterations; ++i) {
      associate<Camera>(samples_, stride, placed_, a.at, shutter, rig_, {.distance = distance, .cosine = 0.7}, planes_);
      if (planes_.size() < 12) break;
      const depth_equations e = build_equations(planes_, a.at, options_.effective_points, options_.weakest);
      a.determined = e.determined;
      a.least = e.least;
      const vec6 step = solve_step(e);
      if (!all_finite(step)) break;
      a.at.T_world_camera = a.at.T_world_camera * se3::exp(-step);
      distance = std::max(0.05, 0.8 * distance);
      if (squared_norm(step) < 1e-8 && distance <= 0.05) break;
    }
    return a;
  }

  void move_to_frame_time(const vec6& twist, const camera::shutter& shutter) {
    const vec3 turning = tail<3>(twist);
    for (std::size_t i = 0; i != now_.cells.size(); ++i) {
      surface_cell& c = now_.cells[i];
      if (!c.is_there()) continue;
      const double t = shutter.depth_time(now_.pixel_row(i), rig_.camera().height());
      const vec3 p = moved_by(twist, t, c.point());
      const vec3 n = normalized(c.normal() + t * cross(turning, c.normal()));
      c.measured *= static_cast<float>(p.z()) / c.z;
      c.x = static_cast<float>(p.x()), c.y = static_cast<float>(p.y()), c.z = static_cast<float>(p.z());
      c.nx = static_cast<float>(n.x()), c.ny = static_cast<float>(n.y()), c.nz = static_cast<float>(n.z());
    }
  }

  const camera_rig<Camera>& rig_;
  const depth_term_options& options_;
  surface_builder<Camera> builder_;
  surface_sampler sampler_;
  surface_memory memory_;
  surface now_;  ///< surface of the current frame
  std::vector<surface_sample> samples_;
  std::vector<placed_surface> placed_;
  std::vector<plane_observation_of_row> planes_;
  std::vector<depth_alignment> found_;
};

}  // namespace orbis::slam::detail
