// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Incremental counting, view by view, of rays that pass through the points of a cloud and rays that end at them; the
/// input of the decision in `ray_evidence.hpp`. Users of orbis::compiled must include ray_evidence_counter-inl.hpp.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <type_traits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/cloud/detail/rays/ray_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::cloud {

/// A depth image with the pose of its camera, such as a keyframe.
template <class V>
concept posed_depth = requires(const V& view) {
  requires camera::depth_source<std::remove_cvref_t<decltype(view.depth)>>;
  { view.T_world_camera } -> std::convertible_to<se3>;
};

/// A multi-pass range of views; elements may be computed on access.
template <class R>
concept posed_depth_range =
    std::ranges::forward_range<R> && std::ranges::sized_range<R> && posed_depth<std::ranges::range_value_t<R>>;

/// Options for counting rays and for the decision.
struct ray_evidence_options {
  int window = 1;                ///< radius in pixels of the window of depths around a pixel; >= 0
  float margin = 0.02F;          ///< constant part of the allowance for noise and small pose errors, metres
  float margin_growth = 0.005F;  ///< the allowance at depth z is margin + margin_growth z^2; 1 / metres
  float slant = 1.0F;      ///< fraction of the window's depth range added to the margin for rays that pass through
  float min_depth = 0.0F;  ///< points up to this depth get no evidence, metres
  float max_depth = std::numeric_limits<float>::max();  ///< points beyond this depth get no evidence, metres
  bool resolve_ghosts = true;     ///< true to read the views again and find parts that most other views contradict
  float ghost_reach = 0.3F;       ///< maximum distance of a contradicting surface in front of a measurement, metres
  std::uint16_t min_through = 2;  ///< minimum number of views that pass through an outlier
  double ratio = 1.0;             ///< an outlier has more than `ratio` views that pass through it per supporting view
};

/// Counts for one point: views whose rays pass through it, views that measured a surface at it, and views whose support
/// was refuted by the others. The remaining views do not see the point or see a surface in front of it. Counts saturate
/// at 65535.
struct ray_evidence {
  std::uint16_t through = 0;
  std::uint16_t supported = 0;
  std::uint16_t refuted = 0;
  friend bool operator==(const ray_evidence&, const ray_evidence&) = default;
};

/// Ray evidence counts for a cloud's points, updated view by view, for growing maps. Holds a copy of the finite points.
template <camera::camera_model Camera>
class ray_evidence_counter {
 public:
  /// Copies the points and `camera`. O(n).
  template <execution_policy Policy, point_range Points>
  ray_evidence_counter(const Policy& policy, const Points& points, const Camera& camera,
                       const ray_evidence_options& options = {})
      : ray_evidence_counter{policy, detail::viewed_points{points}.view(), camera, options} {}
  template <execution_policy Policy>
  ray_evidence_counter(const Policy& policy, const detail::point_view& points, const Camera& camera,
                       const ray_evidence_options& options);
  ray_evidence_counter(const ray_evidence_counter&) = delete;
  ray_evidence_counter& operator=(const ray_evidence_counter&) = delete;

  /// Counts a view as described for `ray_evidence_scores`; ignores a view with a non-finite pose. O(pixels + points in
  /// front of the camera). @pre the image has the camera's size
  template <execution_policy Policy, posed_depth View>
  void add(const Policy& policy, const View& view);
  /// Counts a view from the precomputed windows of its depth image, taken with this counter's options.
  template <execution_policy Policy>
  void add(const Policy& policy, const detail::depth_windows& windows, const se3& T_world_camera);
  /// Subtracts the counts of a view. O(pixels + points in front of the camera).
  /// @pre the view was added and has not been removed since; fewer than 65536 views were added; `review` has not been
  /// called
  template <execution_policy Policy, posed_depth View>
  void remove(const Policy& policy, const View& view);

  /// Finds the parts of a view that the other views contradict, and discards their counts. Call it once for each view
  /// after all views have been added. Parts are tiles of `tile_size` pixels a side. A tile is contradicted if its rays
  /// pass through points at most `ghost_reach` in front of the ends of the rays, and these points together have at
  /// least 1.5 times the support of the points that the tile itself supports (excluding its own support). The evidence
  /// of a contradicted tile no longer counts, and the points that it supports are refuted. O(pixels + points in front
  /// of the camera).
  template <execution_policy Policy, posed_depth View>
  void review(const Policy& policy, const View& view);
  /// Edge of a tile in pixels: 32 for a width of 640.
  [[nodiscard]] static constexpr int tile_size(int width) noexcept { return std::max(4, width / 20); }

  /// Returns the current counts of each point of the cloud; zero for non-finite points.
  [[nodiscard]] std::vector<ray_evidence> scores() const;

 private:
  /// Applies a kernel to the counts of all points for which the view has evidence.
  template <class Policy, class Kernel>
  void change(const Policy& policy, const detail::depth_windows& windows, const se3& pose, const Kernel& kernel);
  [[nodiscard]] detail::ray_view view_at(const se3& pose, const detail::depth_windows& windows) const;

  /// Difference of two counts, clamped to 0, because saturated counts cannot be subtracted exactly.
  [[nodiscard]] static std::uint16_t less(std::uint16_t a, std::uint16_t b) noexcept {
    return static_cast<std::uint16_t>(a > b ? a - b : 0);
  }

  /// Calls `f(first, seen, verdict)` for the blocks for which the view may have evidence; `first` is the position of
  /// the block's first point.
  template <execution_policy Policy, class F>
  void for_each_seen_block(const Policy& policy, const detail::ray_view& view, F&& f);

  Camera camera_;
  ray_evidence_options options_;
  std::size_t size_;
  detail::point_blocks blocks_;
  std::vector<std::uint16_t> through_;  ///< number of rays through each point, in the order of the points in `blocks_`
  std::vector<std::uint16_t> supported_;
  std::vector<std::uint16_t> through_dropped_;  ///< counts from contradicted parts; empty before the first review
  std::vector<std::uint16_t> refuted_;
  detail::depth_windows windows_;
  detail::block_test<Camera> test_;
};

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/ray_evidence_counter-inl.hpp>
#endif
