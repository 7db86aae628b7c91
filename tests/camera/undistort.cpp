// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <orbis/camera/any.hpp>
#include <orbis/camera/undistort.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::camera;

namespace {

const radial_tangential lens{{320, 240, 258.0, 257.0, 159.0, 127.0}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};

/// A smooth picture: what is seen along a ray through (x, y, 1), as grey from 0 to 250.
double scene(double x, double y) { return 125.0 + 60.0 * std::sin(4.0 * x) + 60.0 * std::cos(5.0 * y + x); }

template <class Camera>
image<std::uint8_t> picture(const Camera& camera) {
  image<std::uint8_t> out{camera.width(), camera.height()};
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x)
      if (const auto ray = camera.unproject({x, y}))
        out(x, y) = static_cast<std::uint8_t>(scene(ray->x(), ray->y()) + 0.5);
  return out;
}

}  // namespace

TEST_CASE("undistorted keypoints are those of OpenCV") {
  const auto& k = lens.k();
  const auto& d = lens.distortion();
  const cv::Matx33d K{k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1};
  std::vector<cv::Point2d> pixels, theirs;
  for (int y = 0; y < 240; y += 20)
    for (int x = 0; x < 320; x += 20) pixels.emplace_back(x, y);
  cv::undistortPoints(pixels, theirs, K, cv::Vec<double, 5>{d.k1, d.k2, d.p1, d.p2, d.k3}, cv::noArray(), K,
                      cv::TermCriteria{cv::TermCriteria::MAX_ITER | cv::TermCriteria::EPS, 1000, 1e-13});
  for (std::size_t i = 0; i != pixels.size(); ++i) {
    const auto ours = pinhole{k}.project(*lens.unproject({pixels[i].x, pixels[i].y}));
    REQUIRE(ours);
    CHECK((*ours - vec2{theirs[i].x, theirs[i].y}).norm() < 1e-5);
  }
}

TEST_CASE("an undistorted picture is the one an ideal camera takes") {
  const pinhole ideal{lens.k()};
  const undistortion straighten{lens};
  const auto distorted = picture(lens);
  const auto wanted = picture(ideal);
  const auto got = straighten.bilinear(distorted.view());
  REQUIRE((got.width() == 320 && got.height() == 240));
  int compared = 0, moved = 0;
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) {
      const vec2f at = straighten.source(x, y);
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() <= 319 && at.y() <= 239)) {
        CHECK(got(x, y) == 0);
        continue;
      }
      ++compared;
      moved += std::abs(distorted(x, y) - wanted(x, y)) > 3;
      REQUIRE(std::abs(got(x, y) - wanted(x, y)) <= 1);
    }
  CHECK(compared > 320 * 240 * 9 / 10);
  CHECK(moved > 1000);  // there was something to straighten
}

TEST_CASE("colours are interpolated each by itself and outside is as asked") {
  const undistortion straighten{lens};
  const auto grey = picture(lens);
  image<rgb8> colour{320, 240};
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) colour(x, y) = {grey(x, y), 100, static_cast<std::uint8_t>(255 - grey(x, y))};
  const auto out = straighten.bilinear(colour.view(), rgb8{1, 2, 3});
  const auto expected = straighten.bilinear(grey.view(), std::uint8_t{1});
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) {
      REQUIRE(out(x, y).r == expected(x, y));
      REQUIRE((out(x, y).g == 100 || out(x, y) == rgb8{1, 2, 3}));
    }
}

TEST_CASE("depth is taken from the nearest pixel and never mixed") {
  const undistortion straighten{lens};
  image<std::uint16_t> depth{320, 240};
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) depth(x, y) = static_cast<std::uint16_t>(1 + y * 256 + x % 256);
  const auto out = straighten.nearest(depth.view());
  int filled = 0;
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) {
      if (out(x, y) == 0) continue;
      ++filled;
      const vec2f at = straighten.source(x, y);
      REQUIRE(out(x, y) == depth(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))));
    }
  CHECK(filled > 320 * 240 * 9 / 10);
}

TEST_CASE("a camera without distortion keeps its picture") {
  const pinhole ideal{64, 48, 50.0, 51.0, 31.3, 24.7};
  const undistortion nothing{ideal};
  const auto p = picture(ideal);
  const auto again = nothing.bilinear(p.view());
  int wrong = 0;
  for (int y = 1; y != 47; ++y)
    for (int x = 1; x != 63; ++x) wrong += again(x, y) != p(x, y);
  CHECK(wrong == 0);
  CHECK(nothing.bilinear(image_view<const std::uint8_t>{p.data(), 64, 48}).width() == 64);
}
