// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counts, view by view, whose rays pass through the points of a cloud and whose end there: what
/// `ray_evidence.hpp` decides on. Users of orbis::compiled include ray_evidence_counter-inl.hpp.
#pragma once

#include <algorithm>
#include <array>
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

/// A depth image and where its camera was: what a keyframe is.
template <class V>
concept posed_depth = requires(const V& view) {
  requires camera::depth_source<std::remove_cvref_t<decltype(view.depth)>>;
  { view.T_world_camera } -> std::convertible_to<se3>;
};

/// Views that can be gone through more than once; each may be made when its turn comes.
template <class R>
concept posed_depth_range =
    std::ranges::forward_range<R> && std::ranges::sized_range<R> && posed_depth<std::ranges::range_value_t<R>>;

/// When a view counts, and when the counts decide.
struct ray_evidence_options {
  int window = 1;                ///< the depths up to so many pixels away are looked at; >= 0
  float margin = 0.02F;          ///< what noise and small errors of poses are good for, metres:
  float margin_growth = 0.005F;  ///< margin + margin_growth z^2 at depth z; 1 / metres
  float slant = 1.0F;            ///< so many times the window's depth range is added for rays that pass through
  float min_depth = 0.0F;        ///< points not beyond it are not judged by a view, metres
  float max_depth = std::numeric_limits<float>::max();  ///< nor are those beyond this
  bool resolve_ghosts = true;     ///< look at the views once more for parts of them that most others contradict
  float ghost_reach = 0.3F;       ///< how far before a measurement a surface may be that contradicts it, metres
  std::uint16_t min_through = 2;  ///< an outlier has at least so much against it,
  double ratio = 1.0;             ///< and more than so many times the views that support it
};

/// For one point: how many views' rays pass through it, how many measured a surface where it is, and
/// how many would have, had the others not contradicted them. The rest see nothing of it, or something
/// before it. Counts end at 65535.
struct ray_evidence {
  std::uint16_t through = 0;
  std::uint16_t supported = 0;
  std::uint16_t refuted = 0;
  friend bool operator==(const ray_evidence&, const ray_evidence&) = default;
};

/// The counts view by view, for maps that grow. Holds a copy of the finite points, in blocks.
template <camera::camera_model Camera>
class ray_evidence_counter {
 public:
  /// O(n). `camera` is copied.
  template <execution_policy Policy, point_range Points>
  ray_evidence_counter(const Policy& policy, const Points& points, const Camera& camera,
                       const ray_evidence_options& options = {})
      : ray_evidence_counter{policy, detail::viewed_points{points}.view(), camera, options} {}
  template <execution_policy Policy>
  ray_evidence_counter(const Policy& policy, const detail::point_view& points, const Camera& camera,
                       const ray_evidence_options& options);
  ray_evidence_counter(const ray_evidence_counter&) = delete;
  ray_evidence_counter& operator=(const ray_evidence_counter&) = delete;

  /// Counts a view as `ray_evidence_scores` says; one whose pose is not finite says nothing.
  /// O(pixels + points before the camera). @pre the image has the camera's size
  template <execution_policy Policy, posed_depth View>
  void add(const Policy& policy, const View& view);
  /// The same with the windows of the view's depth image, of this counter's options, taken already.
  template <execution_policy Policy>
  void add(const Policy& policy, const detail::depth_windows& windows, const se3& T_world_camera);
  /// Takes a view back. O(pixels + points before the camera).
  /// @pre it was added, and not taken back since; fewer than 65536 views were added; there was no review
  template <execution_policy Policy, posed_depth View>
  void remove(const Policy& policy, const View& view);

  /// To be called for the views once more when all were added: finds the parts of a view, tiles of
  /// `tile_size` pixels a side, that the others contradict. Those are the tiles whose rays pass through
  /// points, at most `ghost_reach` before where they end, that together have half as many supports again
  /// as the points which the tile itself supports (its own support not counted). What such a tile says
  /// no longer counts, and what it supports is refuted. O(pixels + points before the camera).
  template <execution_policy Policy, posed_depth View>
  void review(const Policy& policy, const View& view);
  /// 32 pixels of 640.
  [[nodiscard]] static constexpr int tile_size(int width) noexcept { return std::max(4, width / 20); }

  /// The counts so far, for each point of the cloud; none for those that are not finite.
  [[nodiscard]] std::vector<ray_evidence> scores() const;

 private:
  /// Lets a kernel change the counts of all points of which the view says something.
  template <class Policy, class Kernel>
  void change(const Policy& policy, const detail::depth_windows& windows, const se3& pose, const Kernel& kernel);
  [[nodiscard]] detail::ray_view view_at(const se3& pose, const detail::depth_windows& windows) const;

  /// Not below 0, which a count that has come to its end would be.
  [[nodiscard]] static std::uint16_t less(std::uint16_t a, std::uint16_t b) noexcept {
    return static_cast<std::uint16_t>(a > b ? a - b : 0);
  }

  /// `f(first, seen, verdict)` for the blocks of which the view may say something; `first` is the place
  /// of the block's first point.
  template <execution_policy Policy, class F>
  void for_each_seen_block(const Policy& policy, const detail::ray_view& view, F&& f);

  Camera camera_;
  ray_evidence_options options_;
  std::size_t size_;
  detail::point_blocks blocks_;
  std::vector<std::uint16_t> through_;  ///< in the order of the blocks
  std::vector<std::uint16_t> supported_;
  std::vector<std::uint16_t> through_dropped_;  ///< by parts of views that are contradicted; empty before any review
  std::vector<std::uint16_t> refuted_;
  detail::depth_windows windows_;
  detail::block_test<Camera> test_;
};

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/ray_evidence_counter-inl.hpp>
#endif
