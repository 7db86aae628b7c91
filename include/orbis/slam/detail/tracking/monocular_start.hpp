// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Initialisation of a map without depth: two frames with an unambiguous reconstruction of the scene and their motion.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/optimize/two_view.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// A point that two frames observe.
struct start_point {
  std::uint32_t first = 0, second = 0;  ///< its keypoints in the two frames
  vec3 position = zeros<vec3>();        ///< position in the world frame
};

/// Two frames with poses, and their common points. The first camera frame is the world frame; the unit of length is the
/// median depth of the points in it.
template <feature_descriptor D>
struct monocular_start_result {
  basic_frame<D> first;              ///< its pose is the identity
  se3 T_first_second;                ///< pose of the second frame
  std::vector<start_point> points;   ///< in ascending order of the first frame's keypoints
  double parallax = 0.0;             ///< median angle between the two rays to a point, radians
  double rotation_deviation = 0.0;   ///< standard deviation of the rotation, radians
  double direction_deviation = 0.0;  ///< standard deviation of the direction of the translation, radians
};

/// Selects two frames from which a map can be started. Keeps several frames of different ages as candidates for the
/// first frame, tracks the keypoints of each from frame to frame, and reconstructs the scene as soon as the result is
/// reliable (`optimize::reconstruct_two_views`). A candidate is discarded when too few of its keypoints can be tracked;
/// newer candidates remain, so that the search does not restart. Each candidate takes about a millisecond per frame.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section IV, where only one candidate is kept.
template <camera::camera_model Camera, feature_descriptor D>
class monocular_start {
 public:
  /// A candidate for the first frame of a map.
  struct candidate {
    basic_frame<D> frame;
    std::vector<features::match> matches;   ///< from its keypoints (query) to those of the last frame (train)
    std::vector<features::window> windows;  ///< one per keypoint, around its last position
    std::size_t most = 0;                   ///< largest number of matches with a frame so far
  };

  monocular_start(const camera_rig<Camera>& rig, const start_options& options, std::uint64_t seed = 1)
      : rig_{rig}, options_{options}, seed_{seed} {}

  /// Processes the next frame; its pose is not used. If a map can be started, returns the result and forgets all
  /// frames; otherwise returns an empty value.
  [[nodiscard]] std::optional<monocular_start_result<D>> process(const basic_frame<D>& f) {
    why_ = {errc::no_data, "map initialisation", "no earlier frame has enough matches"};
    std::erase_if(candidates_, [&](candidate& c) { return !follow(c, f); });
    for (candidate& c : candidates_) {
      auto start = reconstruct(c, f);
      if (start) {
        reset();
        return *std::move(start);
      }
      if (&c == &candidates_.front()) why_ = std::move(start.error());
    }
    add(f);
    return std::nullopt;
  }

  /// Forgets all frames.
  void reset() { candidates_.clear(); }

  /// The reason why the last frame and the oldest candidate could not start a map.
  [[nodiscard]] const error& why() const noexcept { return why_; }
  /// The candidates for the first frame, the oldest first.
  [[nodiscard]] const std::vector<candidate>& candidates() const noexcept { return candidates_; }

 private:
  static constexpr auto chain(const start_options& o) {
    return features::windowed(distance_of_t<D>{}) | features::max_distance{o.distance} | features::ratio_test{o.ratio} |
           features::unique{} | features::rotation_consistency{};
  }

  /// Tracks the keypoints of a candidate into the next frame. Returns false if too few are left.
  bool follow(candidate& c, const basic_frame<D>& f) {
    chain(options_).match_into(c.matches, memory_, c.frame.features, f.features,
                               std::span<const features::window>(c.windows), f.grid);
    c.most = std::max(c.most, c.matches.size());
    for (const features::match& m : c.matches) {
      c.windows[m.query].x = f.features.keypoints[m.train].x;
      c.windows[m.query].y = f.features.keypoints[m.train].y;
    }
    return c.matches.size() >= options_.min_matches;
  }
  /// Makes `f` a candidate if it has enough features and differs from the newest candidate.
  void add(const basic_frame<D>& f) {
    constexpr double faded = 0.6;  // maximum share of its peak match count that the newest candidate retains
    if (f.size() < options_.min_features || candidates_.size() == options_.max_candidates) return;
    if (!candidates_.empty() &&
        static_cast<double>(candidates_.back().matches.size()) > faded * static_cast<double>(candidates_.back().most))
      return;
    candidates_.push_back({f, {}, {}, 0});
    for (const auto& k : f.features.keypoints)
      candidates_.back().windows.push_back({k.x, k.y, static_cast<float>(options_.radius), k.octave - 1, k.octave + 1});
  }
  /// Reconstructs the scene from a candidate and the next frame; on success, moves the candidate's frame to the result.
  [[nodiscard]] result<monocular_start_result<D>> reconstruct(candidate& c, const basic_frame<D>& f) const {
    std::vector<vec2> first, second;
    std::vector<double> deviations;
    for (const features::match& m : c.matches) {
      first.push_back(c.frame.pixel(m.query));
      second.push_back(f.pixel(m.train));
      deviations.push_back(rig_.scales.scale(c.frame.features.keypoints[m.query].octave));
    }
    const auto found =
        optimize::reconstruct_two_views(std::span<const vec2>(first), std::span<const vec2>(second), rig_.camera(),
                                        {.deviation = options_.deviation,
                                         .min_points = options_.min_points,
                                         .min_parallax = options_.min_parallax,
                                         .seed = seed_},
                                        deviations);
    if (!found) return fail(found.error());
    monocular_start_result<D> start{std::move(c.frame), found->T_first_second,     {},
                                    found->parallax,    found->rotation_deviation, found->direction_deviation};
    start.first.T_world_camera = se3();
    for (std::size_t i = 0; i != found->points.size(); ++i) {
      const features::match& m = c.matches[found->matches[i]];
      start.points.push_back({m.query, m.train, found->points[i]});
    }
    return start;
  }

  const camera_rig<Camera>& rig_;
  const start_options& options_;
  std::uint64_t seed_;
  std::vector<candidate> candidates_;
  typename decltype(chain(start_options{}))::workspace memory_;
  error why_;
};

}  // namespace orbis::slam::detail
