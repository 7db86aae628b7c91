// SPDX-License-Identifier: BSD-3-Clause
#include "stereo_depth.hpp"

#include <algorithm>

#include <opencv2/calib3d.hpp>

#include <orbis/features/grey.hpp>
#include <orbis/interop/opencv.hpp>

namespace app {

orbis::image<std::uint16_t> stereo_depth(orbis::image_view<const orbis::rgb8> left,
                                         orbis::image_view<const orbis::rgb8> right,
                                         const orbis::camera::camera_settings& camera) {
  const auto grey = [](orbis::image_view<const orbis::rgb8> color) {
    orbis::image<std::uint8_t> out(color.width(), color.height());
    orbis::features::luma(color, out.view());
    return out;
  };
  const orbis::image<std::uint8_t> a = grey(left), b = grey(right);
  const double fx = camera.model.k().fx, bf = fx * camera.baseline.value();
  const int reach = std::min(static_cast<int>(fx / 5.0), left.width() / 2);
  constexpr int block = 5, uniqueness = 20;  // percentage of the cost; a lower value leaves more noise
  // The penalties that OpenCV's documentation recommends for a grey image.
  const auto matcher = cv::StereoSGBM::create(0, std::max(16, (reach + 15) / 16 * 16), block, 8 * block * block,
                                              32 * block * block, 1, 0, uniqueness, 100, 2, cv::StereoSGBM::MODE_SGBM);
  cv::Mat disparity;  // in units of 1/16 pixel
  matcher->compute(orbis::interop::mat_over(a.view()), orbis::interop::mat_over(b.view()), disparity);
  orbis::image<std::uint16_t> depth(left.width(), left.height());
  for (int y = 0; y != depth.height(); ++y) {
    const auto* const row = disparity.ptr<std::int16_t>(y);
    for (int x = 0; x != depth.width(); ++x) {
      const double stored = row[x] > 0 ? 16.0 * bf / row[x] * camera.depth_scale + 0.5 : 0.0;
      if (stored < 65535.0) depth(x, y) = static_cast<std::uint16_t>(stored);
    }
  }
  return depth;
}

}  // namespace app
