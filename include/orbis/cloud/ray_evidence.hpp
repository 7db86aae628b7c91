// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ray evidence: a point that other views' depth rays pass through is not there.
///
/// What a moving object, a wrong pose or a stray measurement leaves behind can be as dense and as
/// smooth as any surface; no filter that looks at the points alone sees it. The depth images do: a
/// measurement says that there is a surface where it ends, and nothing before that. The same idea
/// carves space in occupancy grids (A. Elfes, 1989) and checks multi-view stereo for violations of
/// free space (P. Merrell et al., "Real-time visibility-based fusion of depth maps", ICCV 2007).
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/depth_windows.hpp>
#include <orbis/cloud/point_blocks.hpp>
#include <orbis/cloud/ray_evidence_kernels.hpp>
#include <orbis/cloud/ray_evidence_simd.hpp>
#include <orbis/cloud/ray_view.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>

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

/// When a view counts, and when its count decides.
struct ray_evidence_options {
  int window = 2;                ///< the depths up to so many pixels away are looked at; >= 0
  float margin = 0.02F;          ///< metres; with `margin_growth` what noise and poses are good for:
  float margin_growth = 0.005F;  ///< margin + margin_growth z^2 at depth z; 1 / metres
  float slant = 1.0F;            ///< times the window's depth range is added for rays passing through
  float min_depth = 0.0F;        ///< points not beyond it are not judged by a view, metres
  float max_depth = std::numeric_limits<float>::max();  ///< nor are those beyond this
  std::uint16_t min_through = 2;                        ///< an outlier is passed through by at least so many views,
  double ratio = 0.5;                                   ///< and by more than so many times those that support it
};

/// For one point: how many views' rays pass through it, and how many measured a surface where it is.
/// The rest see nothing of it, or something before it. Both stay at 65535 from there on.
struct ray_evidence {
  std::uint16_t through = 0;
  std::uint16_t supported = 0;
  friend bool operator==(const ray_evidence&, const ray_evidence&) = default;
};

/// The counts view by view, for maps that grow. Holds a copy of the finite points, in blocks.
template <camera::camera_model Camera>
class ray_evidence_counter {
 public:
  /// O(n). `camera` is copied. `level`: the best instructions that may be used.
  template <execution_policy Policy, point_range Points>
  ray_evidence_counter(const Policy& policy, const Points& points, const Camera& camera,
                       const ray_evidence_options& options = {}, simd::level level = simd::detected())
      : camera_{camera},
        options_{options},
        size_{std::ranges::size(points)},
        blocks_{make_point_blocks(policy, points)},
        kernels_{detail::ray_kernels_at(level)},
        through_(blocks_.axis[0].size(), 0),
        supported_(blocks_.axis[0].size(), 0),
        test_{camera_} {
    assert(options.window >= 0 && options.margin >= 0 && options.margin_growth >= 0 && options.slant >= 0);
  }
  ray_evidence_counter(const ray_evidence_counter&) = delete;
  ray_evidence_counter& operator=(const ray_evidence_counter&) = delete;

  /// Counts a view; one whose pose is not finite says nothing. O(pixels + points before the camera).
  /// @pre the image has the camera's size
  template <execution_policy Policy, posed_depth View>
  void add(const Policy& policy, const View& view) {
    assert(view.depth.width() == camera_.width() && view.depth.height() == camera_.height());
    const se3 pose = view.T_world_camera;
    if (!pose.to_matrix().allFinite() || blocks_.index.empty()) return;
    windows_.take(policy, view.depth, options_.window);
    const detail::ray_view placed = view_at(pose);
    test_.place(pose, placed, windows_);
    for_each_index(policy, blocks_.groups.size(), 2, [&](std::size_t group) {
      if (test_.says_nothing(blocks_.groups[group])) return;
      const std::size_t first = group * point_blocks::group_size;
      for (std::size_t b = first; b != std::min(blocks_.blocks.size(), first + point_blocks::group_size); ++b) {
        if (!test_.says_nothing(blocks_.blocks[b])) count(placed, b);
      }
    });
  }

  /// The counts so far, for each point of the cloud; none for those that are not finite.
  [[nodiscard]] std::vector<ray_evidence> scores() const {
    std::vector<ray_evidence> out(size_);
    for (std::size_t i = 0; i != blocks_.index.size(); ++i) out[blocks_.index[i]] = {through_[i], supported_[i]};
    return out;
  }

 private:
  [[nodiscard]] detail::ray_view view_at(const se3& pose) const {
    detail::ray_view view{.width = windows_.width(),
                          .height = windows_.height(),
                          .min_depth = std::max(0.0F, options_.min_depth),
                          .max_depth = options_.max_depth,
                          .margin = options_.margin,
                          .margin_growth = options_.margin_growth,
                          .slant = options_.slant,
                          .nearest = windows_.nearest(),
                          .farthest = windows_.farthest(),
                          .middle = windows_.middle()};
    detail::place(view, pose);
    if constexpr (std::same_as<Camera, camera::pinhole>) {
      view.fx = static_cast<float>(camera_.k().fx);
      view.fy = static_cast<float>(camera_.k().fy);
      view.cx = static_cast<float>(camera_.k().cx + 0.5);
      view.cy = static_cast<float>(camera_.k().cy + 0.5);
    }
    return view;
  }

  void count(const detail::ray_view& view, std::size_t block) {
    const std::size_t first = block * point_blocks::block_size;
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
    kernels_.count(verdict.through, through_.data() + first);
    kernels_.count(verdict.supported, supported_.data() + first);
  }

  Camera camera_;
  ray_evidence_options options_;
  std::size_t size_;
  point_blocks blocks_;
  detail::ray_kernels kernels_;
  std::vector<std::uint16_t> through_;  ///< in the order of the blocks
  std::vector<std::uint16_t> supported_;
  depth_windows windows_;
  detail::block_test<Camera> test_;
};

/// How many views pass through each point, and how many support it.
///
/// For a point at depth z in a view, with m = margin + margin_growth z^2, and the depths measured in
/// the window around its pixel: the view passes *through* if every pixel of the window has a depth
/// and the nearest exceeds z by more than m + slant (farthest - nearest); it *supports* the point if
/// the nearest, the farthest or the middle one is within m of z. Otherwise it says nothing. A point's
/// own view, if among `views`, supports it.
///
/// Points that are not finite get no counts, views with a pose that is not finite give none. The same
/// counts under every policy. If `on_progress`, which is called after each view, cancels, the counts
/// are those of the views until then.
/// O(views (pixels + points in the frustum)); 28 bytes for each point.
/// @pre views' images have the camera's size; fewer than 2^32 points
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<ray_evidence> ray_evidence_scores(const Policy& policy, const Points& points,
                                                            const Views& views, const Camera& camera,
                                                            const ray_evidence_options& options = {},
                                                            progress on_progress = {}) {
  if constexpr (requires { camera.visit([](const auto&) {}); }) {  // a camera of a kind known at run time
    return camera.visit(
        [&](const auto& model) { return ray_evidence_scores(policy, points, views, model, options, on_progress); });
  } else {
    ray_evidence_counter<Camera> counter{policy, points, camera, options};
    std::size_t done = 0;
    for (const auto& view : views) {
      counter.add(policy, view);
      if (!on_progress(++done, std::ranges::size(views))) break;
    }
    return counter.scores();
  }
}

/// The filter's decision, and what it is based on.
struct ray_evidence_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<ray_evidence> scores;    ///< per point
  std::size_t seen = 0;                ///< points of which some view says something
};

/// Whether a point with these counts is not there.
[[nodiscard]] constexpr bool is_passed_through(const ray_evidence& e, const ray_evidence_options& options) noexcept {
  return e.through >= options.min_through && e.through > options.ratio * e.supported;
}

/// Decides on counts that are known already. Points without any are inliers. O(n).
[[nodiscard]] inline ray_evidence_result ray_evidence_decision(std::vector<ray_evidence> scores,
                                                               const ray_evidence_options& options = {}) {
  ray_evidence_result out;
  for (std::size_t i = 0; i != scores.size(); ++i) {
    if (!is_passed_through(scores[i], options)) out.inliers.push_back(static_cast<std::uint32_t>(i));
    out.seen += scores[i].through != 0 || scores[i].supported != 0 ? 1 : 0;
  }
  out.scores = std::move(scores);
  return out;
}

/// The indices, ascending, of the finite points that rays do not pass through: see
/// `ray_evidence_scores`.
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<std::uint32_t> ray_evidence_inliers(const Policy& policy, const Points& points,
                                                              const Views& views, const Camera& camera,
                                                              const ray_evidence_options& options = {}) {
  auto decided = ray_evidence_decision(ray_evidence_scores(policy, points, views, camera, options), options);
  const auto first = std::ranges::begin(points);
  std::erase_if(decided.inliers, [&](std::uint32_t i) {
    return !is_finite(coordinates<float>(first[static_cast<std::ranges::range_difference_t<const Points>>(i)]));
  });
  return std::move(decided.inliers);
}

}  // namespace orbis::cloud
