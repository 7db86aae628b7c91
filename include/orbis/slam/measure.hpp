// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Measurement of the features of a frame: their rays and, if available, their depths and the corresponding right
/// coordinates.
///
/// Tracking and adjustment compare right coordinates (`optimize::reprojection`), either in a second camera or in a
/// virtual one that models the depth sensor. To support another kind of sensor, pass a function that measures its
/// frames to `system::track_measured`.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/features/stereo.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam {

/// Motion of the camera during the capture of a frame.
struct frame_motion {
  camera::shutter shutter{};   ///< includes this frame's depth image delay
  vec6 twist = zeros<vec6>();  ///< twist of the camera in its own frame, per second, translation first
};

/// Sets the depths of keypoints as read by a rolling shutter, given the motion.
using row_reader = std::function<void(std::span<keypoint_as_read>, const frame_motion&)>;

/// An extractor that also accepts grey images.
template <class E>
concept grey_extractor = feature_extractor<E> && std::invocable<const E&, image_view<const std::uint8_t>>;

namespace detail {

/// Creates a frame from features and their rays, before depth is measured. Pixels without a ray get NaN.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] basic_frame<D> make_frame(const camera_rig<Camera>& rig, features::basic_features<D> features,
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
    f.rays[i] = rig.camera().unproject(vec2(k.x, k.y)).value_or(filled<vec3>(std::numeric_limits<double>::quiet_NaN()));
  }
  f.grid = features::keypoint_grid(f.features.keypoints);
  return f;
}

/// Converts a colour image to grey in `to`; returns a view of `to`.
[[nodiscard]] inline image_view<const std::uint8_t> to_grey(image_view<const rgb8> color, image<std::uint8_t>& to) {
  if (to.width() != color.width() || to.height() != color.height())
    to = image<std::uint8_t>(color.width(), color.height());
  features::luma(color, to.view());
  return std::as_const(to).view();
}

/// Returns the depth at a pixel, metres; 0 if it is unknown or outside the rig's range.
template <camera::camera_model Camera, camera::depth_source Depth>
[[nodiscard]] double usable_depth(const camera_rig<Camera>& rig, const Depth& depth, float x, float y) {
  const auto at = features::depth_at(depth, x, y);
  return at && at->z >= rig.min_depth && at->z <= rig.max_depth ? at->z : 0.0;
}

}  // namespace detail

/// Returns the number of points with which a frame can start a map: the number of its features with depth if lengths
/// are measured (`options::scale_is_measured`), otherwise the number of all its features; 0 if there are fewer than
/// `settings.min_start_points`.
template <feature_descriptor D>
[[nodiscard]] std::size_t start_points(const basic_frame<D>& f, const options& settings) {
  std::size_t points = 0;
  for (std::size_t i = 0; i < f.size(); ++i) points += !settings.scale_is_measured || f.has_depth(i);
  return points < settings.min_start_points ? 0 : points;
}

/// Working memory for the grey image of a frame and its pyramid.
struct image_memory {
  image<std::uint8_t> grey{};
  features::image_pyramid pyramid{};  ///< pyramid of the last image; empty if the extractor builds none

  /// Extracts the features of a colour image.
  template <feature_extractor Extractor>
  [[nodiscard]] auto extract_with(const Extractor& extract, image_view<const rgb8> color) {
    if constexpr (features::pyramid_extractor<Extractor>) {
      decltype(extract(color)) found;
      extract.into(found, pyramid, detail::to_grey(color, grey));
      return found;
    } else {
      return extract(color);
    }
  }
};

/// Extracts the features of a colour image and reads their depth from the registered depth image. Depth outside the
/// rig's range is not used. @pre all images have the size of the camera
template <camera::camera_model Camera, feature_extractor Extractor, camera::depth_source Depth>
[[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure_rgbd(const camera_rig<Camera>& rig,
                                                                   const Extractor& extract,
                                                                   image_view<const rgb8> color, const Depth& depth,
                                                                   image_memory& memory) {
  auto f = detail::make_frame(rig, memory.extract_with(extract, color), sensor_kind::rgbd);
  constexpr std::size_t ahead = 8;
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (i + ahead < f.size()) {
      const auto& later = f.features.keypoints[i + ahead];
      features::prefetch_depth(depth, later.x, later.y);
    }
    const auto& k = f.features.keypoints[i];
    if (!std::isnan(f.rays[i].x())) f.depth[i] = static_cast<float>(detail::usable_depth(rig, depth, k.x, k.y));
  }
  return f;
}
/// As above.
template <camera::camera_model Camera, feature_extractor Extractor, camera::depth_source Depth>
[[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure_rgbd(const camera_rig<Camera>& rig,
                                                                   const Extractor& extract,
                                                                   image_view<const rgb8> color, const Depth& depth) {
  image_memory memory;
  return measure_rgbd(rig, extract, color, depth, memory);
}

/// Sets `depth` of each keypoint to the depth at the time when its row of the colour image was read. The depth is that
/// of the pixel at which the moving camera sees the same point in the depth image. @pre all images have the size of the
/// camera
template <camera::camera_model Camera, camera::depth_source Depth>
void follow_rows(const camera_rig<Camera>& rig, const frame_motion& m, std::span<keypoint_as_read> keypoints,
                 const Depth& depth) {
  struct reading {
    keypoint_as_read* keypoint;
    double z;  // depth of the point at the time of the depth image, as stored
    std::optional<vec2> pixel;
  };
  std::array<reading, 32> block;  // all pixels of a block are fetched before the first is read
  while (!keypoints.empty()) {
    std::size_t count = 0, taken = 0;
    for (; taken != keypoints.size() && count != block.size(); ++taken) {
      keypoint_as_read& k = keypoints[taken];
      const double v = static_cast<double>(k.y);
      const double later = m.shutter.depth_time(v, depth.height()) - m.shutter.color_time(v, depth.height());
      if (later == 0.0 || !(k.stored_depth > 0.0F)) continue;
      const vec3 there =
          detail::moved_by(m.twist, -later, static_cast<double>(k.stored_depth) * vec3(k.ray_x, k.ray_y, 1.0));
      const auto pixel = there.z() > 0.0 ? rig.camera().project(there) : std::nullopt;
      if (pixel) features::prefetch_depth(depth, static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
      block[count++] = {&k, there.z(), pixel};
    }
    keypoints = keypoints.subspan(taken);
    for (std::size_t i = 0; i != count; ++i) {
      const auto& [k, z_there, pixel] = block[i];
      const auto read = pixel
                            ? features::depth_at(depth, static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                            : std::nullopt;
      // If the two readings are from different surfaces, neither is reliable.
      constexpr double same_surface = 0.1;
      const auto stored = static_cast<double>(k->stored_depth);
      const double change = read ? read->z - z_there : 0.0, z = stored + change;
      const bool usable = read && std::abs(change) < same_surface * stored && z >= rig.min_depth && z <= rig.max_depth;
      k->depth = usable ? static_cast<float>(z) : 0.0F;
    }
  }
}

/// Working memory of `measure_stereo`, for one call at a time.
struct stereo_memory {
  features::stereo_matcher<> match{};
  image<std::uint8_t> grey_left{}, grey_right{};
  features::image_pyramid pyramid_left{}, pyramid_right{};
  std::vector<float> columns{};
};

namespace detail {

/// Creates a frame from the features of the left image. `Pixels`: the images, or the pyramids that the extractor built
/// from them.
template <camera::camera_model Camera, feature_descriptor D, class Pixels>
[[nodiscard]] basic_frame<D> match_stereo(const camera_rig<Camera>& rig, stereo_memory& memory,
                                          features::basic_features<D> left, const Pixels& left_pixels,
                                          const features::basic_features<D>& right, const Pixels& right_pixels) {
  auto f = make_frame(rig, std::move(left), sensor_kind::stereo);
  const double bf = rig.model.bf;
  const std::vector<float>& columns = memory.columns;
  memory.match.into(memory.columns, f.features, left_pixels, right, right_pixels,
                    {.levels = rig.scales.levels(),
                     .scale_factor = static_cast<float>(rig.scales.factor()),
                     .min_disparity = static_cast<float>(bf / rig.max_depth),
                     .max_disparity = static_cast<float>(bf / rig.min_depth)});
  for (std::size_t i = 0; i != f.size(); ++i)
    if (!std::isnan(columns[i]) && !std::isnan(f.rays[i].x()))
      f.depth[i] =
          static_cast<float>(bf / (static_cast<double>(f.features.keypoints[i].x) - static_cast<double>(columns[i])));
  return f;
}

}  // namespace detail

/// Creates a frame from the left image of a rectified pair (`camera::rectify`). A feature has the right coordinate that
/// `features::stereo_matcher` finds for it, if any; its depth is `options::bf` divided by the disparity if that is
/// within the rig's range. Features without a right coordinate become landmarks once other keyframes observe them with
/// enough parallax. @pre both images have the size of the camera
template <camera::camera_model Camera, grey_extractor Extractor>
[[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure_stereo(const camera_rig<Camera>& rig,
                                                                     const Extractor& extract,
                                                                     image_view<const std::uint8_t> left,
                                                                     image_view<const std::uint8_t> right,
                                                                     stereo_memory& memory) {
  if constexpr (features::pyramid_extractor<Extractor>) {
    decltype(extract(left)) left_features, right_features;
    extract.into(left_features, memory.pyramid_left, left);
    extract.into(right_features, memory.pyramid_right, right);
    return detail::match_stereo(rig, memory, std::move(left_features), memory.pyramid_left, right_features,
                                memory.pyramid_right);
  } else {
    return detail::match_stereo(rig, memory, extract(left), left, extract(right), right);
  }
}
/// As above, for colour images.
template <camera::camera_model Camera, feature_extractor Extractor>
[[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure_stereo(const camera_rig<Camera>& rig,
                                                                     const Extractor& extract,
                                                                     image_view<const rgb8> left,
                                                                     image_view<const rgb8> right,
                                                                     stereo_memory& memory) {
  const auto grey_left = detail::to_grey(left, memory.grey_left),
             grey_right = detail::to_grey(right, memory.grey_right);
  if constexpr (grey_extractor<Extractor>)
    return measure_stereo(rig, extract, grey_left, grey_right, memory);
  else
    return detail::match_stereo(rig, memory, extract(left), grey_left, extract(right), grey_right);
}

/// Creates a frame from one image, in colour or grey, without depth. @pre the image has the size of the camera
template <camera::camera_model Camera, feature_extractor Extractor, class Pixel>
requires std::invocable<const Extractor&, image_view<const Pixel>>
[[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure_monocular(const camera_rig<Camera>& rig,
                                                                        const Extractor& extract,
                                                                        image_view<const Pixel> picture) {
  return detail::make_frame(rig, extract(picture), sensor_kind::monocular);
}

}  // namespace orbis::slam
