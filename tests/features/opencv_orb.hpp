// SPDX-License-Identifier: BSD-3-Clause
//
// The features that OpenCV's ORB finds, as ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/interop/opencv.hpp>

namespace orbis::test {

inline features::features found_by_opencv(const image<std::uint8_t>& im) {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat rows;
  cv::ORB::create(1000, 1.2F, 8)->detectAndCompute(interop::mat_over(im.view()), {}, keypoints, rows);
  features::features f;
  f.keypoints = interop::from_cv(keypoints);
  f.descriptors.resize(keypoints.size());
  for (std::size_t i = 0; i != keypoints.size(); ++i)
    std::memcpy(f.descriptors[i].words.data(), rows.ptr(static_cast<int>(i)), sizeof f.descriptors[i]);
  return f;
}

}  // namespace orbis::test
