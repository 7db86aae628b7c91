// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/features/grey.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("luma is OpenCV's, at every level") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  for (const auto& [width, height] : {std::pair{256, 256}, {1, 1}, {5, 3}, {33, 2}, {34, 2}, {67, 9}}) {
    image<rgb8> color(width, height);
    random_bits random{7};
    for (rgb8& p : color.pixels()) {
      const auto bits = random();
      p = {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8U),
           static_cast<std::uint8_t>(bits >> 16U)};
    }
    color(0, 0) = {255, 255, 255};
    cv::Mat expected;
    cv::cvtColor(interop::mat_over(color.view()), expected, cv::COLOR_RGB2GRAY);
    image<std::uint8_t> grey(width, height);
    luma(color, grey);
    int wrong = 0;
    for (int y = 0; y != height; ++y)
      for (int x = 0; x != width; ++x) wrong += grey(x, y) != expected.at<std::uint8_t>(y, x) ? 1 : 0;
    CHECK(wrong == 0);
  }
}

TEST_CASE("16 bits become 8 between two given values") {
  image<std::uint16_t> deep(5, 1);
  deep(0, 0) = 0;
  deep(1, 0) = 1000;
  deep(2, 0) = 1500;
  deep(3, 0) = 2000;
  deep(4, 0) = 65535;
  image<std::uint8_t> grey(5, 1);
  narrow(deep, grey, 1000, 2000);
  CHECK((grey(0, 0) == 0 && grey(1, 0) == 0 && grey(2, 0) == 128 && grey(3, 0) == 255 && grey(4, 0) == 255));
  narrow(deep, grey, 0, 65535);
  CHECK((grey(0, 0) == 0 && grey(1, 0) == 4 && grey(4, 0) == 255));
}
