// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <orbis/features/pyramid.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("each level of a pyramid is made of the one before it") {
  image_pyramid pyramid;
  for (const auto level : simd::available_levels())
    for (const auto& [width, height] : {std::pair{320, 240}, {61, 200}, {320, 240}}) {
      const simd::level_limit limit{level};
      const auto im = test::noise(width, height, 1);
      pyramid.build(im, 8, 1.2, 39);
      cv::Mat expected = interop::mat_over(im.view()).clone();
      double scale = 1.0;
      for (std::size_t i = 0; i != pyramid.size(); ++i, scale *= 1.2) {
        if (i != 0)
          cv::resize(expected.clone(), expected, {cvRound(width / scale), cvRound(height / scale)}, 0, 0,
                     cv::INTER_LINEAR_EXACT);
        REQUIRE((pyramid[i].width() == expected.cols && pyramid[i].height() == expected.rows));
        CHECK(cv::norm(interop::mat_over(pyramid[i]), expected, cv::NORM_INF) == 0.0);
      }
      CHECK(pyramid.size() == (width == 61 ? 3U : 8U));  // 61, 51, 42, then 35
      CHECK(pyramid[0].data() == im.data());
    }
}

TEST_CASE("a pyramid leaves out what is too small") {
  image_pyramid pyramid;
  pyramid.build(image<std::uint8_t>(30, 500, 1), 8, 1.2, 39);
  CHECK(pyramid.size() == 0);
  pyramid.build(image<std::uint8_t>(100, 100, 1), 0, 1.2, 1);
  CHECK(pyramid.size() == 0);
  const image<std::uint8_t> im(100, 100, 1);
  pyramid.build(im, 100, 2.0, 1);
  CHECK(pyramid.size() == 8);  // 100, 50, 25, 13, 6, 3, 2, 1: the next would be 0
}

TEST_CASE("coordinates of levels keep pixel areas where they are") {
  CHECK(image_pyramid::full_coordinate(0, 320, 640) == Approx(0.5));  // between the two pixels it is made of
  CHECK(image_pyramid::full_coordinate(319, 320, 640) == Approx(638.5));
  CHECK(image_pyramid::full_coordinate(17, 640, 640) == Approx(17.0));
}
