// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finding known points again in a frame: where each should appear, and which keypoint there bow_vector
/// like it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// A point that a frame may show.
struct candidate_point {
  vec3 position = vec3::Zero();  ///< in the world, metres
  landmark_id landmark = no_id;  ///< or none, for a point that only the last frame's depth gave
};

/// Candidates with their descriptors and windows, index by index.
struct search_list {
  std::vector<candidate_point> points;
  std::vector<features::binary_descriptor<256>> descriptors;
  std::vector<features::keypoint> keypoints;  ///< where they were seen before; only the angle is of use
  std::vector<features::window> windows;

  void add(const candidate_point& p, const features::binary_descriptor<256>& d, const features::keypoint& k,
           const features::window& w) {
    points.push_back(p);
    descriptors.push_back(d);
    keypoints.push_back(k);
    windows.push_back(w);
  }
  [[nodiscard]] std::size_t size() const noexcept { return points.size(); }
};

/// What the pyramid of the extractor looks like.
class pyramid_scales {
 public:
  pyramid_scales() : pyramid_scales(8, 1.2) {}
  pyramid_scales(int levels, double factor) : levels_{levels}, factor_{factor} {
    for (int octave = 0; octave != tabled; ++octave)
      scales_[static_cast<std::size_t>(octave)] = std::pow(factor, octave);
  }

  [[nodiscard]] int levels() const noexcept { return levels_; }
  [[nodiscard]] double factor() const noexcept { return factor_; }
  [[nodiscard]] double scale(int octave) const {
    return octave >= 0 && octave < tabled ? scales_[static_cast<std::size_t>(octave)] : std::pow(factor_, octave);
  }
  /// 1 / sigma^2 of a keypoint's position, sigma being one pixel of its level.
  [[nodiscard]] double information(int octave) const { return 1.0 / (scale(octave) * scale(octave)); }

 private:
  static constexpr int tabled = 16;  // asked for with every observation
  int levels_;
  double factor_;
  std::array<double, tabled> scales_;
};

/// Landmarks are searched for within `radius` pixels of a keypoint's level.
[[nodiscard]] inline features::projection_rule rule_of(const pyramid_scales& scales, double radius) {
  return {.radius = static_cast<float>(radius),
          .levels = scales.levels(),
          .scale_factor = static_cast<float>(scales.factor())};
}

/// A window around the projection of what the last frame saw, if it projects into the image.
template <camera::camera_model Camera>
void add_seen_point(search_list& list, const features::camera_projection<Camera>& project, const pyramid_scales& scales,
                    const candidate_point& point, const features::binary_descriptor<256>& descriptor,
                    const features::keypoint& seen, double radius) {
  if (const auto at = project(point.position))
    list.add(point, descriptor, seen,
             {at->x, at->y, static_cast<float>(radius * scales.scale(seen.octave)), seen.octave - 1, seen.octave + 1});
}

/// A window around the projection of a landmark, if the frame should show it: inside the image, at a distance and
/// from a side from which `rule` says that its descriptor is of use. Returns whether it should.
template <camera::camera_model Camera>
bool add_landmark(search_list& list, const features::camera_projection<Camera>& project,
                  const features::projection_rule& rule, const landmark& l, landmark_id id) {
  const auto appears = project(l);
  if (!appears) return false;
  const features::window where = features::window_of(*appears, rule);
  if (where.radius < 0.0F) return false;
  list.add({l.position, id}, l.descriptor, {}, where);
  return true;
}

}  // namespace orbis::slam::detail
