// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of images read by OpenCV.
#pragma once

#include <string>

#include <opencv2/core.hpp>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace app {

/// Converts an 8-bit image, BGR or grey. Errors: unsupported.
[[nodiscard]] inline orbis::result<orbis::image<orbis::rgb8>> to_rgb(const cv::Mat& image, const std::string& where) {
  if (image.empty() || image.depth() != CV_8U || (image.channels() != 3 && image.channels() != 1))
    return orbis::fail(orbis::errc::unsupported, where, "an image is neither 8-bit colour nor 8-bit grey");
  orbis::image<orbis::rgb8> out(image.cols, image.rows);
  for (int y = 0; y != image.rows; ++y) {
    const auto* from = image.ptr<unsigned char>(y);
    for (int x = 0; x != image.cols; ++x, from += image.channels())
      out(x, y) = image.channels() == 3 ? orbis::rgb8{from[2], from[1], from[0]} : orbis::rgb8{*from, *from, *from};
  }
  return out;
}

}  // namespace app
