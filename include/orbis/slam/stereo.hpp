// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The stereo sensor: two rectified images that are taken at the same time, and the options that suit it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/features/stereo.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/sensor.hpp>

namespace orbis::slam {

/// The left and the right image of a rectified pair (`camera::rectify`), in colour or, if the extractor takes them, in
/// grey. A feature of the left image has the right coordinate that `features::stereo_matcher` finds for it, or none;
/// its depth is `options::bf` over the disparity, where that lies within the rig's range. Features without a right
/// coordinate are observed by their pixel alone and become landmarks once other keyframes see them under enough
/// parallax. The first frame with enough depth begins a map. It keeps working memory: one call at a time, and no
/// copies.
class stereo {
 public:
  static constexpr scale_source scale = scale_source::sensor;

  /// @pre both images have the size of the camera
  template <camera::camera_model Camera, feature_extractor Extractor>
  [[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure(const camera_rig<Camera>& rig, const Extractor& extract,
                                                                image_view<const rgb8> left,
                                                                image_view<const rgb8> right) const {
    const auto grey_of = [](image_view<const rgb8> color, image<std::uint8_t>& to) {
      if (to.width() != color.width() || to.height() != color.height())
        to = image<std::uint8_t>(color.width(), color.height());
      features::luma(color, to.view());
      return std::as_const(to).view();
    };
    const auto grey_left = grey_of(left, memory_.grey_left), grey_right = grey_of(right, memory_.grey_right);
    if constexpr (std::invocable<const Extractor&, image_view<const std::uint8_t>>)
      return measure(rig, extract, grey_left, grey_right);
    else
      return match(rig, extract(left), grey_left, extract(right), grey_right);
  }
  template <camera::camera_model Camera, feature_extractor Extractor>
  requires std::invocable<const Extractor&, image_view<const std::uint8_t>>
  [[nodiscard]] basic_frame<descriptor_of_t<Extractor>> measure(const camera_rig<Camera>& rig, const Extractor& extract,
                                                                image_view<const std::uint8_t> left,
                                                                image_view<const std::uint8_t> right) const {
    if constexpr (features::pyramid_extractor<Extractor>) {
      decltype(extract(left)) left_features, right_features;
      extract.into(left_features, memory_.pyramid_left, left);
      extract.into(right_features, memory_.pyramid_right, right);
      return match(rig, std::move(left_features), memory_.pyramid_left, right_features, memory_.pyramid_right);
    } else {
      return match(rig, extract(left), left, extract(right), right);
    }
  }

  /// The number of features with depth, if there are `settings.min_start_points` or more, otherwise 0.
  template <feature_descriptor D>
  [[nodiscard]] static std::size_t begins_map(const basic_frame<D>& f, const options& settings) {
    return rgbd::begins_map(f, settings);
  }

 private:
  struct workspace {
    image<std::uint8_t> grey_left, grey_right;
    features::image_pyramid pyramid_left, pyramid_right;
    std::vector<float> columns;
  };

  /// A frame of the left features. `Pixels`: the images, or the pyramids that the extractor has made of them.
  template <camera::camera_model Camera, feature_descriptor D, class Pixels>
  [[nodiscard]] basic_frame<D> match(const camera_rig<Camera>& rig, features::basic_features<D> left,
                                     const Pixels& left_pixels, const features::basic_features<D>& right,
                                     const Pixels& right_pixels) const {
    auto f = detail::frame_of(rig, std::move(left), sensor_kind::stereo);
    const double bf = rig.model.bf;
    const std::vector<float>& columns = memory_.columns;
    match_.into(memory_.columns, f.features, left_pixels, right, right_pixels,
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

  features::stereo_matcher<> match_;
  mutable workspace memory_;
};

/// The settings of a rectified stereo camera of focal length `focal` (pixels) and `baseline` (metres), on top of
/// others: `bf`, the range of depth from a baseline to a disparity of a pixel, and points as close as 40 baselines,
/// whose depth a single pair tells well enough (R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section
/// III.A). Points farther than these become landmarks by parallax. @pre focal > 0, baseline > 0
[[nodiscard]] inline options stereo_options(double focal, double baseline, options settings = {}) {
  assert(focal > 0.0 && baseline > 0.0);
  settings.bf = focal * baseline;
  settings.min_depth = baseline;
  settings.max_depth = settings.bf;
  settings.close_depth = std::min(40.0 * baseline, settings.max_depth);
  return settings;
}

}  // namespace orbis::slam
