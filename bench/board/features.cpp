// SPDX-License-Identifier: BSD-3-Clause
//
// ORB features of a recording's images, by orbis and by OpenCV.
//
// usage: features RECORDING IMAGES FEATURES LEVELS
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/core/image.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/io/recording.hpp>

#include "marks.hpp"

int main(int argc, char** argv) {
  using namespace orbis;
  using bench::board::counted;
  if (argc != 5) return std::fputs("usage: features RECORDING IMAGES FEATURES LEVELS\n", stderr), 1;
  const auto recording = io::open_recording(argv[1]);
  if (!recording) return std::fprintf(stderr, "%s\n", recording.error().to_string().c_str()), 2;
  const auto wanted = static_cast<std::size_t>(std::atoi(argv[2]));
  const int count = std::atoi(argv[3]), levels = std::atoi(argv[4]);

  cv::setNumThreads(1);  // as ours have
  const features::orb_extractor ours{{.max_features = count, .levels = levels}};
  const auto theirs = cv::ORB::create(count, 1.2F, levels);
  std::size_t found_ours = 0, found_theirs = 0;
  for (std::size_t i = 0; i <= wanted; ++i) {  // the first fills the caches and the memory that is kept
    const auto frame = recording->frame(10 * i);
    if (!frame) return std::fprintf(stderr, "%s\n", frame.error().to_string().c_str()), 2;
    image<std::uint8_t> grey(frame->color.width(), frame->color.height());
    features::luma(frame->color, grey);
    features::features found;
    counted(i == 0 ? "first" : "orbis", [&] { ours.into(found, grey); });
    const cv::Mat mat(grey.height(), grey.width(), CV_8UC1, grey.data());
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    counted(i == 0 ? "first" : "opencv", [&] { theirs->detectAndCompute(mat, {}, keypoints, descriptors); });
    found_ours += found.size(), found_theirs += keypoints.size();
  }
  std::printf("features of an image: orbis %zu, OpenCV %zu\n", found_ours / (wanted + 1), found_theirs / (wanted + 1));
}
