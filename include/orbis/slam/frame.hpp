// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the system remembers of an image: features, their depth, and the landmarks they show.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam {

/// Finds features in a colour image.
template <class E>
concept feature_extractor = requires(const E& extract, image_view<const rgb8> image) {
  { extract(image) } -> std::same_as<features::features>;
};

struct frame {
  double timestamp = 0.0;
  std::size_t index = 0;  ///< of the frame in the recording, from 0
  se3 T_world_camera;
  features::features features;
  std::vector<float> depth;            ///< metres at each keypoint, 0 where there is none
  std::vector<vec3> rays;              ///< through each keypoint, scaled to z = 1; NaN where there is none
  std::vector<landmark_id> landmarks;  ///< that each keypoint shows, or `no_id`
  features::keypoint_grid grid;

  [[nodiscard]] std::size_t size() const noexcept { return features.size(); }
  [[nodiscard]] bool has_depth(std::size_t i) const noexcept { return depth[i] > 0.0F; }
  /// The point that keypoint `i` shows, in the camera frame. @pre has_depth(i)
  [[nodiscard]] vec3 point_camera(std::size_t i) const { return static_cast<double>(depth[i]) * rays[i]; }
  [[nodiscard]] vec3 point_world(std::size_t i) const { return T_world_camera * point_camera(i); }
  [[nodiscard]] vec2 pixel(std::size_t i) const { return {features.keypoints[i].x, features.keypoints[i].y}; }
};

/// A frame that the map keeps. `landmarks` of the frame are its observations.
struct keyframe : frame {
  keyframe_id id = no_id;
};

/// Extracts features and reads their depth.
template <camera::camera_model Camera, feature_extractor Extractor, camera::depth_source Depth>
[[nodiscard]] frame make_frame(const Camera& camera, const Extractor& extract, image_view<const rgb8> color,
                               const Depth& depth, const options& settings) {
  const auto usable = [&](double z) { return z >= settings.min_depth && z <= settings.max_depth; };
  frame f;
  f.features = extract(color);
  const std::size_t n = f.features.size();
  f.depth.resize(n);
  f.rays.resize(n);
  f.landmarks.assign(n, no_id);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& k = f.features.keypoints[i];
    const auto ray = camera.unproject(vec2(k.x, k.y));
    f.rays[i] = ray.value_or(vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
    const auto z = ray ? features::depth_at(depth, k.x, k.y) : std::nullopt;
    f.depth[i] = z && usable(z->z) ? static_cast<float>(z->z) : 0.0F;
  }
  f.grid = features::keypoint_grid(f.features.keypoints);
  return f;
}

}  // namespace orbis::slam
