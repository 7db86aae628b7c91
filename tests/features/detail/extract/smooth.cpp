// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/features/detail/extract/smooth.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("the Gaussian is OpenCV's, at every level and for every part of the rows") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  for (const auto& [width, height] : {std::pair{320, 240}, {4, 4}, {4, 90}, {90, 4}, {31, 33}, {32, 8}, {65, 40}})
    for (const auto& im : {test::noise(width, height, 1), image<std::uint8_t>(width, height, 255)}) {
      INFO(width << "x" << height);
      cv::Mat expected;
      cv::GaussianBlur(interop::mat_over(im.view()), expected, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
      const std::ptrdiff_t stride = (width + 63) / 64 * 64;
      const test::embedded_image embedded{im};
      smooth_workspace memory;
      for (const auto& [first, last] : {std::pair{0, height}, {1, height - 1}, {height / 2, height / 2 + 1}, {2, 2}}) {
        std::vector<std::uint8_t> pixels(static_cast<std::size_t>(stride * height), 99);
        const image_view<std::uint8_t> to{pixels.data(), width, height, stride};
        smooth(embedded.view(), to, first, last, memory);
        int wrong = 0;
        for (int y = 0; y != height; ++y)
          for (int x = 0; x != width; ++x)
            wrong += to(x, y) != (y >= first && y < last ? expected.at<std::uint8_t>(y, x) : 99) ? 1 : 0;
        CHECK(wrong == 0);
      }
    }
}
