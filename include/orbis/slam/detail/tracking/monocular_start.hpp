// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The beginning of a map without depth: two frames from which the scene and the motion between them are certain.
#pragma once

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
  std::uint32_t first = 0, second = 0;  ///< keypoints of the two frames
  vec3 position = vec3::Zero();         ///< in the world
};

/// Two frames with poses, and the points that they share. The first camera is the world; the unit of length is the
/// median depth of the points in it.
template <feature_descriptor D>
struct monocular_start_result {
  basic_frame<D> first, second;
  std::vector<start_point> points;   ///< by ascending keypoints of the first frame
  double parallax = 0.0;             ///< median angle between the rays of a point, radians
  double rotation_deviation = 0.0;   ///< standard deviation of the rotation, radians ...
  double direction_deviation = 0.0;  ///< ... and of the direction of the translation, radians
};

/// Waits for two frames that a map can begin with. Keeps a frame as the first, follows its keypoints from frame to
/// frame, and reconstructs the scene once this is certain (`optimize::reconstruct_two_views`). Where too few keypoints
/// can be followed, the present frame becomes the first.
///
/// Source of the scheme: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular
/// SLAM system", T-RO 31 (2015), section IV.
template <camera::camera_model Camera, feature_descriptor D>
class monocular_start {
 public:
  monocular_start(const camera_rig<Camera>& rig, const start_options& options, std::uint64_t seed = 1)
      : rig_{rig}, options_{options}, seed_{seed} {}

  /// Takes the next frame; its pose does not matter. The beginning of a map, after which the first frame is forgotten,
  /// or nothing.
  [[nodiscard]] std::optional<monocular_start_result<D>> see(const basic_frame<D>& f);

  /// Forgets the first frame.
  void reset() {
    first_.reset();
    matches_.clear();
  }

  /// Why the last frame began no map.
  [[nodiscard]] const error& why() const noexcept { return why_; }
  /// The first frame, if there is one.
  [[nodiscard]] const std::optional<basic_frame<D>>& first() const noexcept { return first_; }
  /// Matches of the first frame (query) with the last one (train).
  [[nodiscard]] const std::vector<features::match>& matches() const noexcept { return matches_; }

 private:
  static constexpr auto chain(const start_options& o) {
    return features::windowed(distance_of_t<D>{}) | features::max_distance{o.distance} | features::ratio_test{o.ratio} |
           features::unique{} | features::rotation_consistency{};
  }

  /// Makes `f` the first frame if it has enough features.
  void begin_with(const basic_frame<D>& f) {
    reset();
    if (f.size() < options_.min_features) return;
    first_ = f;
    windows_.clear();
    for (const auto& k : f.features.keypoints)
      windows_.push_back({k.x, k.y, static_cast<float>(options_.radius), k.octave - 1, k.octave + 1});
  }

  const camera_rig<Camera>& rig_;
  const start_options& options_;
  std::uint64_t seed_;
  std::optional<basic_frame<D>> first_;
  std::vector<features::window> windows_;  // one for each keypoint of the first frame, where it was seen last
  std::vector<features::match> matches_;
  typename decltype(chain(start_options{}))::workspace memory_;
  error why_;
};

template <camera::camera_model Camera, feature_descriptor D>
std::optional<monocular_start_result<D>> monocular_start<Camera, D>::see(const basic_frame<D>& f) {
  constexpr const char* where = "start of a map";
  if (!first_) {
    begin_with(f);
    why_ = {errc::no_data, where, first_ ? "the first frame" : "too few features"};
    return std::nullopt;
  }
  chain(options_).match_into(matches_, memory_, first_->features, f.features,
                             std::span<const features::window>(windows_), f.grid);
  if (matches_.size() < options_.min_matches) {
    why_ = {errc::no_data, where, "too few matches: " + std::to_string(matches_.size())};
    begin_with(f);
    return std::nullopt;
  }
  std::vector<vec2> first, second;
  std::vector<double> deviations;
  for (const features::match& m : matches_) {
    first.push_back(first_->pixel(m.query));
    second.push_back(f.pixel(m.train));
    deviations.push_back(rig_.scales.scale(first_->features.keypoints[m.query].octave));
    windows_[m.query].x = f.features.keypoints[m.train].x;
    windows_[m.query].y = f.features.keypoints[m.train].y;
  }
  auto found =
      optimize::reconstruct_two_views(std::span<const vec2>(first), std::span<const vec2>(second), rig_.camera(),
                                      {.deviation = options_.deviation,
                                       .min_points = options_.min_points,
                                       .min_parallax = options_.min_parallax,
                                       .seed = seed_},
                                      deviations);
  if (!found) {
    why_ = std::move(found.error());
    return std::nullopt;
  }
  monocular_start_result<D> start{*std::move(first_),        f, {}, found->parallax, found->rotation_deviation,
                                  found->direction_deviation};
  start.first.T_world_camera = se3();
  start.second.T_world_camera = found->T_first_second;
  for (std::size_t i = 0; i != found->points.size(); ++i) {
    const features::match& m = matches_[found->matches[i]];
    start.points.push_back({m.query, m.train, found->points[i]});
  }
  reset();
  return start;
}

}  // namespace orbis::slam::detail
