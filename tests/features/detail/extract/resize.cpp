// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/features/detail/extract/resize.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("resizing is OpenCV's exact bilinear, at every level") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  struct sizes {
    int from_width, from_height, to_width, to_height;
  };
  resize_workspace memory;  // the same for all: nothing may be left over from the one before
  for (const sizes& s : {sizes{640, 480, 533, 400},
                         {533, 400, 444, 333},
                         {640, 480, 320, 240},
                         {640, 480, 213, 160},
                         {641, 479, 380, 283},
                         {100, 90, 100, 90},
                         {100, 90, 99, 1},
                         {17, 5, 16, 4},
                         {15, 15, 12, 12},
                         {1, 1, 1, 1},
                         {3, 200, 2, 160},
                         {50, 40, 73, 91}}) {
    INFO(s.from_width << "x" << s.from_height << " to " << s.to_width << "x" << s.to_height);
    const auto im = test::noise(s.from_width, s.from_height, 1);
    cv::Mat expected;
    cv::resize(interop::mat_over(im.view()), expected, {s.to_width, s.to_height}, 0, 0, cv::INTER_LINEAR_EXACT);
    const test::embedded_image embedded{im};
    const std::ptrdiff_t stride = (s.to_width + 31) / 32 * 32;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(stride * s.to_height));
    const image_view<std::uint8_t> to{pixels.data(), s.to_width, s.to_height, stride};
    resize(embedded.view(), to, memory);
    int wrong = 0;
    for (int y = 0; y != s.to_height; ++y)
      for (int x = 0; x != s.to_width; ++x) wrong += to(x, y) != expected.at<std::uint8_t>(y, x) ? 1 : 0;
    CHECK(wrong == 0);
  }
}
