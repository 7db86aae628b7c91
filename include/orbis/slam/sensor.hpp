// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sensors: what a frame measures for each feature, and when a map can begin.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam {

/// Where the scale of a sensor's maps comes from.
enum class scale_source : std::uint8_t {
  sensor,  ///< depth, or a baseline, is measured
  free,    ///< nothing tells it
  options  ///< the sensor is known at run time only: `options::scale_is_measured` tells
};

/// A kind of sensor, as a compile-time policy of the SLAM system, which holds one that is made by default (it may keep
/// working memory). With `s` a const one,
///  - `s.measure(rig, extract, images...)`: a frame with its features, their rays, and what the sensor measures for
///  each
///    besides its pixel: a right coordinate or none, as the depth that belongs to it (0 where there is none);
///    `images...` are those that the sensor takes at one moment. What tracking and adjustments compare is the right
///    coordinate
///    (`optimize::reprojection`): that of a second camera, or of a virtual one that stands for the depth sensor;
///  - `S::begins_map(frame, options)`: the number of points with which this frame can begin a map; 0 if it cannot;
///  - `S::scale`: whether lengths are measured. Without, a map begins with two frames that `begins_map` lets through
///  and
///    enough parallax between them, lengths are in a unit of the map's own, and their drift is corrected at loops.
template <class S, class D>
concept sensor = feature_descriptor<D> && std::default_initializable<S> &&
    requires(const basic_frame<D>& f, const options& settings) {
  { S::begins_map(f, settings) } -> std::convertible_to<std::size_t>;
  { S::scale } -> std::convertible_to<scale_source>;
};

/// Whether a sensor measures lengths, with these options.
template <class S>
[[nodiscard]] bool measures_scale(const options& settings) {
  return S::scale == scale_source::sensor || (S::scale == scale_source::options && settings.scale_is_measured);
}

/// Whether a sensor makes frames of these images.
template <class S, class Camera, class Extractor, class... Images>
concept measures = requires(const S& s, const camera_rig<Camera>& rig, const Extractor& extract,
                            const Images&... images) {
  { s.measure(rig, extract, images...) } -> std::same_as<basic_frame<descriptor_of_t<Extractor>>>;
};

/// How the camera moves while a frame is taken.
struct frame_motion {
  camera::shutter shutter{};  ///< the delay of the depth image is that of this frame
  vec6 twist = zeros<vec6>();  ///< of the camera in its own frame, per second, translation first
};

/// Whether a sensor brings what it measures to the times of a rolling shutter's rows, once the motion is known:
/// `S::follow_rows(rig, motion, frame, images...)` sets `depth` of `frame.as_read`.
template <class S, class D, class Camera, class... Images>
concept follows_rows = requires(const camera_rig<Camera>& rig, const frame_motion& m, basic_frame<D>& f,
                                const Images&... images) {
  S::follow_rows(rig, m, f, images...);
};

/// Whether a sensor's images hold a depth image: `S::depth_image(images...)`, of which frames keep surfaces
/// (`options::depth_term`).
template <class S, class... Images>
concept has_depth_image = requires(const Images&... images) {
  { S::depth_image(images...) } -> camera::depth_source;
};

/// A colour image with a registered depth image. The first frame with enough depth begins a map.
struct rgbd {
  static constexpr scale_source scale = scale_source::sensor;

  /// Extracts features and reads their depth. Depth outside of the rig's range is not used. @pre all images have the
  /// size of the camera
  template <camera::camera_model Camera, feature_extractor Extractor, camera::depth_source Depth>
  [[nodiscard]] static basic_frame<descriptor_of_t<Extractor>> measure(const camera_rig<Camera>& rig,
                                                                       const Extractor& extract,
                                                                       image_view<const rgb8> color,
                                                                       const Depth& depth);

  /// The depth that each keypoint's row of the colour image would have measured at its own time: it is read where the
  /// camera, which moves on, sees the same point in the depth image. @pre all images have the size of the camera
  template <camera::camera_model Camera, feature_descriptor D, camera::depth_source Depth>
  static void follow_rows(const camera_rig<Camera>& rig, const frame_motion& m, basic_frame<D>& f,
                          image_view<const rgb8> color, const Depth& depth);

  template <camera::depth_source Depth>
  [[nodiscard]] static const Depth& depth_image(image_view<const rgb8>, const Depth& depth) {
    return depth;
  }

  /// The number of features with depth, if there are `settings.min_start_points` or more, otherwise 0.
  template <feature_descriptor D>
  [[nodiscard]] static std::size_t begins_map(const basic_frame<D>& f, const options& settings) {
    std::size_t with_depth = 0;
    for (std::size_t i = 0; i < f.size(); ++i) with_depth += f.has_depth(i);
    return with_depth < settings.min_start_points ? 0 : with_depth;
  }
};

namespace detail {

/// A frame of features, with rays, before their depth is measured. Features whose pixel has no ray get NaN.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] basic_frame<D> frame_of(const camera_rig<Camera>& rig, features::basic_features<D> features,
                                      sensor_kind sensor) {
  basic_frame<D> f;
  f.sensor = sensor;
  f.features = std::move(features);
  const std::size_t n = f.features.size();
  f.depth.resize(n);
  f.rays.resize(n);
  f.landmarks.assign(n, no_id);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& k = f.features.keypoints[i];
    f.rays[i] =
        rig.camera().unproject(vec2(k.x, k.y)).value_or(filled<vec3>(std::numeric_limits<double>::quiet_NaN()));
  }
  f.grid = features::keypoint_grid(f.features.keypoints);
  return f;
}

}  // namespace detail

template <camera::camera_model Camera, feature_extractor Extractor, camera::depth_source Depth>
basic_frame<descriptor_of_t<Extractor>> rgbd::measure(const camera_rig<Camera>& rig, const Extractor& extract,
                                                      image_view<const rgb8> color, const Depth& depth) {
  const auto usable = [&](double z) { return z >= rig.min_depth && z <= rig.max_depth; };
  auto f = detail::frame_of(rig, extract(color), sensor_kind::rgbd);
  for (std::size_t i = 0; i < f.size(); ++i) {
    const auto& k = f.features.keypoints[i];
    const auto z = std::isnan(f.rays[i].x()) ? std::nullopt : features::depth_at(depth, k.x, k.y);
    f.depth[i] = z && usable(z->z) ? static_cast<float>(z->z) : 0.0F;
  }
  return f;
}

template <camera::camera_model Camera, feature_descriptor D, camera::depth_source Depth>
void rgbd::follow_rows(const camera_rig<Camera>& rig, const frame_motion& m, basic_frame<D>& f, image_view<const rgb8>,
                       const Depth& depth) {
  for (keypoint_as_read& k : f.as_read) {
    const double v = static_cast<double>(k.y);
    const double later = m.shutter.depth_time(v, depth.height()) - m.shutter.color_time(v, depth.height());
    if (later == 0.0 || !(k.stored_depth > 0.0F)) continue;
    const auto stored = static_cast<double>(k.stored_depth);
    const vec3 there = detail::moved_by(m.twist, -later, stored * vec3(k.ray_x, k.ray_y, 1.0));
    const auto pixel = there.z() > 0.0 ? rig.camera().project(there) : std::nullopt;
    const auto read = pixel ? features::depth_at(depth, static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                            : std::nullopt;
    // Where the two readings lie on different surfaces, neither can be trusted.
    constexpr double same_surface = 0.1;
    const double change = read ? read->z - there.z() : 0.0, z = stored + change;
    const bool usable = read && std::abs(change) < same_surface * stored && z >= rig.min_depth && z <= rig.max_depth;
    k.depth = usable ? static_cast<float>(z) : 0.0F;
  }
}

}  // namespace orbis::slam
