// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counts, view by view, whose rays pass through the points of a cloud and whose end there: what
/// `ray_evidence.hpp` decides on.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
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
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/cloud/detail/rays/ray_kernels.hpp>
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
      : camera_{camera},
        options_{options},
        size_{std::ranges::size(points)},
        blocks_{detail::make_point_blocks(policy, points)},
        through_(blocks_.axis[0].size(), 0),
        supported_(blocks_.axis[0].size(), 0),
        test_{camera_} {
    assert(options.window >= 0 && options.margin >= 0 && options.margin_growth >= 0 && options.slant >= 0);
  }
  ray_evidence_counter(const ray_evidence_counter&) = delete;
  ray_evidence_counter& operator=(const ray_evidence_counter&) = delete;

  /// Counts a view as `ray_evidence_scores` says; one whose pose is not finite says nothing.
  /// O(pixels + points before the camera). @pre the image has the camera's size
  template <execution_policy Policy, posed_depth View>
  void add(const Policy& policy, const View& view) {
    assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
    if (blocks_.index.empty()) return;
    windows_.take(policy, view.depth, options_.window);
    add(policy, windows_, view.T_world_camera);
  }
  /// The same with the windows of the view's depth image, of this counter's options, taken already.
  template <execution_policy Policy>
  void add(const Policy& policy, const detail::depth_windows& windows, const se3& T_world_camera) {
    change(policy, windows, T_world_camera, kernels_.count);
  }
  /// Takes a view back. O(pixels + points before the camera).
  /// @pre it was added, and not taken back since; fewer than 65536 views were added; there was no review
  template <execution_policy Policy, posed_depth View>
  void remove(const Policy& policy, const View& view) {
    assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
    assert(refuted_.empty());
    if (blocks_.index.empty()) return;
    windows_.take(policy, view.depth, options_.window);
    change(policy, windows_, view.T_world_camera, kernels_.take_back);
  }

  /// To be called for the views once more when all were added: finds the parts of a view, tiles of
  /// `tile_size` pixels a side, that the others contradict. Those are the tiles whose rays pass through
  /// points, at most `ghost_reach` before where they end, that together have half as many supports again
  /// as the points which the tile itself supports (its own support not counted). What such a tile says
  /// no longer counts, and what it supports is refuted. O(pixels + points before the camera).
  template <execution_policy Policy, posed_depth View>
  void review(const Policy& policy, const View& view) {
    assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
    const se3 pose = view.T_world_camera;
    if (!all_finite(pose.to_matrix()) || blocks_.index.empty()) return;
    for (auto* counters : {&through_dropped_, &refuted_}) counters->resize(through_.size(), 0);
    windows_.take(policy, view.depth, options_.window);
    const detail::ray_view placed = view_at(pose, windows_);
    test_.place(pose, placed, windows_);

    const int tile = tile_size(placed.width);
    const int across = (placed.width + tile - 1) / tile;
    const int down = (placed.height + tile - 1) / tile;
    const auto tile_of = [&](std::int32_t pixel) {
      return static_cast<std::size_t>(pixel / placed.width / tile * across + pixel % placed.width / tile);
    };
    std::vector<std::atomic<std::int64_t>> balance(static_cast<std::size_t>(across * down));
    const auto weigh = [&](std::size_t first, const detail::seen_block& seen, const detail::block_verdict& verdict) {
      verdict.for_each([&](std::size_t i, bool supported) {
        const std::int64_t views = supported_[first + i];
        const float before = placed.nearest[seen.pixel[i]] - seen.depth[i];
        if (!supported && before > options_.ghost_reach) return;
        balance[tile_of(seen.pixel[i])].fetch_add(supported ? 3 * (views - 1) : -2 * views, std::memory_order_relaxed);
      });
    };
    for_each_seen_block(policy, placed, weigh);
    if (std::ranges::none_of(balance, [](const auto& b) { return b < 0; })) return;
    const auto refute = [&](std::size_t first, const detail::seen_block& seen, const detail::block_verdict& verdict) {
      verdict.for_each([&](std::size_t i, bool supported) {
        if (balance[tile_of(seen.pixel[i])] >= 0) return;
        std::uint16_t& counter = (supported ? refuted_ : through_dropped_)[first + i];
        if (counter != std::numeric_limits<std::uint16_t>::max()) ++counter;
      });
    };
    for_each_seen_block(policy, placed, refute);
  }
  /// 32 pixels of 640.
  [[nodiscard]] static constexpr int tile_size(int width) noexcept { return std::max(4, width / 20); }

  /// The counts so far, for each point of the cloud; none for those that are not finite.
  [[nodiscard]] std::vector<ray_evidence> scores() const {
    std::vector<ray_evidence> out(size_);
    for (std::size_t i = 0; i != blocks_.index.size(); ++i) {
      ray_evidence& e = out[blocks_.index[i]];
      e = {through_[i], supported_[i]};
      if (refuted_.empty()) continue;
      e.refuted = refuted_[i];
      e.through = less(e.through, through_dropped_[i]);
      e.supported = less(e.supported, refuted_[i]);
    }
    return out;
  }

 private:
  /// Lets a kernel change the counts of all points of which the view says something.
  template <class Policy, class Kernel>
  void change(const Policy& policy, const detail::depth_windows& windows, const se3& pose, const Kernel& kernel) {
    assert(windows.width() == camera_.width() && windows.height() == camera_.height());
    if (!all_finite(pose.to_matrix()) || blocks_.index.empty()) return;
    const detail::ray_view placed = view_at(pose, windows);
    test_.place(pose, placed, windows);
    for_each_seen_block(policy, placed, [&](std::size_t first, const auto&, const detail::block_verdict& verdict) {
      kernel(verdict.through, through_.data() + first);
      kernel(verdict.supported, supported_.data() + first);
    });
  }
  [[nodiscard]] detail::ray_view view_at(const se3& pose, const detail::depth_windows& windows) const {
    detail::ray_view view{.width = windows.width(),
                          .height = windows.height(),
                          .min_depth = std::max(0.0F, options_.min_depth),
                          .max_depth = options_.max_depth,
                          .margin = options_.margin,
                          .margin_growth = options_.margin_growth,
                          .slant = options_.slant,
                          .nearest = windows.nearest(),
                          .farthest = windows.farthest(),
                          .middle = windows.middle()};
    detail::place(view, pose);
    if constexpr (std::same_as<Camera, camera::pinhole>) {
      view.fx = static_cast<float>(camera_.k().fx);
      view.fy = static_cast<float>(camera_.k().fy);
      view.cx = static_cast<float>(camera_.k().cx + 0.5);
      view.cy = static_cast<float>(camera_.k().cy + 0.5);
    }
    return view;
  }

  /// Not below 0, which a count that has come to its end would be.
  [[nodiscard]] static std::uint16_t less(std::uint16_t a, std::uint16_t b) noexcept {
    return static_cast<std::uint16_t>(a > b ? a - b : 0);
  }

  /// `f(first, seen, verdict)` for the blocks of which the view may say something; `first` is the place
  /// of the block's first point.
  template <execution_policy Policy, class F>
  void for_each_seen_block(const Policy& policy, const detail::ray_view& view, F&& f) {
    for_each_index(policy, blocks_.groups.size(), 2, [&](std::size_t group) {
      if (test_.says_nothing(blocks_.groups[group])) return;
      const std::size_t begin = group * detail::point_blocks::group_size;
      for (std::size_t b = begin; b != std::min(blocks_.blocks.size(), begin + detail::point_blocks::group_size); ++b) {
        if (test_.says_nothing(blocks_.blocks[b])) continue;
        const std::size_t first = b * detail::point_blocks::block_size;
        const detail::block_axes points{blocks_.axis[0].data() + first, blocks_.axis[1].data() + first,
                                        blocks_.axis[2].data() + first};
        detail::seen_block seen;
        if constexpr (std::same_as<Camera, camera::pinhole>) {
          kernels_.locate(view, points, seen);
        } else {
          detail::locate_by(camera_, view, points, seen);
        }
        detail::block_verdict verdict;
        kernels_.judge(view, seen, verdict);
        f(first, seen, verdict);
      }
    });
  }

  Camera camera_;
  ray_evidence_options options_;
  std::size_t size_;
  detail::point_blocks blocks_;
  detail::ray_kernels kernels_;
  std::vector<std::uint16_t> through_;  ///< in the order of the blocks
  std::vector<std::uint16_t> supported_;
  std::vector<std::uint16_t> through_dropped_;  ///< by parts of views that are contradicted; empty before any review
  std::vector<std::uint16_t> refuted_;
  detail::depth_windows windows_;
  detail::block_test<Camera> test_;
};

}  // namespace orbis::cloud
