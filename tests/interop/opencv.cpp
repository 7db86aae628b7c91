// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/core/point.hpp>
#include <orbis/interop/opencv.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::interop;

TEST_CASE("a matrix of every shared type is seen in place") {
  cv::Mat grey(4, 6, CV_8UC1, cv::Scalar(7)), color(4, 6, CV_8UC3, cv::Scalar(1, 2, 3)),
      depth(4, 6, CV_16UC1, cv::Scalar(900)), metres(4, 6, CV_32FC1, cv::Scalar(1.5));
  grey.at<std::uint8_t>(2, 5) = 9;
  const auto g = view_as<std::uint8_t>(grey).value();
  CHECK((g.width() == 6 && g.height() == 4 && g.data() == grey.data));
  CHECK(g(5, 2) == 9);
  CHECK(view_as<bgr8>(color).value()(1, 1) == bgr8{1, 2, 3});
  CHECK(view_as<rgb8>(color).value()(1, 1) == rgb8{1, 2, 3});
  CHECK(view_as<std::uint16_t>(depth).value()(0, 3) == 900);
  CHECK(view_as<float>(metres).value()(5, 3) == 1.5F);
}

TEST_CASE("a part of a matrix keeps its stride") {
  cv::Mat whole(10, 12, CV_8UC3, cv::Scalar(0, 0, 0));
  whole.at<cv::Vec3b>(4, 6) = {4, 5, 6};
  const cv::Mat part = whole(cv::Rect(5, 3, 4, 4));
  const auto view = view_as<bgr8>(part).value();
  CHECK(view.stride() == 12);
  CHECK(view(1, 1) == bgr8{4, 5, 6});
  const cv::Mat column = whole(cv::Rect(6, 4, 1, 1));
  CHECK(view_as<bgr8>(column).value()(0, 0) == bgr8{4, 5, 6});
}

TEST_CASE("a matrix of another type or shape is refused with a reason") {
  const auto wrong = view_as<std::uint8_t>(cv::Mat(2, 2, CV_8UC3));
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().code == errc::unsupported);
  CHECK(wrong.error().message == "has type CV_8UC3, not CV_8UC1");
  CHECK_FALSE(view_as<float>(cv::Mat(2, 2, CV_64FC1)));
  CHECK_FALSE(view_as<std::uint16_t>(cv::Mat(2, 2, CV_16SC1)));
  const int sizes[] = {2, 2, 2};
  CHECK_FALSE(view_as<float>(cv::Mat(3, sizes, CV_32FC1)));
  std::vector<std::uint8_t> bytes(40);
  CHECK_FALSE(view_as<rgb8>(cv::Mat(2, 2, CV_8UC3, bytes.data(), 10)));  // 10 bytes are no whole pixels
  CHECK(view_as<rgb8>(cv::Mat{}).value().empty());
}

TEST_CASE("a matrix over a view shares its pixels") {
  image<std::uint16_t> depth(5, 3, 40);
  const image_view<std::uint16_t> part{depth.data() + 6, 3, 2, 5};
  cv::Mat mat = mat_over(part);
  CHECK((mat.cols == 3 && mat.rows == 2 && mat.type() == CV_16UC1));
  mat.at<std::uint16_t>(1, 2) = 77;
  CHECK(depth(3, 2) == 77);
  const image<float> constant(2, 2, 1.0F);
  CHECK(mat_over(constant.view()).ptr<float>() == constant.data());
  CHECK(mat_over(image_view<const rgb8>{}).empty());
}

TEST_CASE("colours go to BGR and back") {
  image<rgb8> color(3, 2);
  color(1, 1) = {10, 20, 30};
  const cv::Mat bgr = to_bgr(color);
  CHECK(bgr.at<cv::Vec3b>(1, 1) == cv::Vec3b(30, 20, 10));
  CHECK(to_rgb(view_as<bgr8>(bgr).value()) == color);
  CHECK(to_bgr({}).empty());
}

TEST_CASE("keypoints and descriptors go to OpenCV and back") {
  const features::keypoint k{3.5F, 4.25F, 31.0F, std::numbers::pi_v<float> / 2.0F, 55.0F, 3};
  const cv::KeyPoint c = to_cv(k);
  CHECK(c.angle == Approx(90.0));
  CHECK((c.pt.x == 3.5F && c.pt.y == 4.25F && c.octave == 3 && c.response == 55.0F));
  const auto back = from_cv(std::vector<cv::KeyPoint>{c});
  REQUIRE(back.size() == 1);
  CHECK(back[0].angle == Approx(k.angle));
  CHECK(from_cv(cv::KeyPoint(1.0F, 2.0F, 3.0F)).angle == 0.0F);
  CHECK(to_cv(back)[0].size == 31.0F);

  std::vector<features::binary_descriptor<256>> d(2);
  d[1].words[0] = 0x0102;
  const cv::Mat rows = mat_over(std::span<const features::binary_descriptor<256>>{d});
  CHECK((rows.rows == 2 && rows.cols == 32 && rows.at<std::uint8_t>(1, 0) == 2 && rows.at<std::uint8_t>(1, 1) == 1));
}

namespace {

/// What the filters keep of the points in the matrix.
template <class S>
[[nodiscard]] std::vector<std::vector<std::uint32_t>> kept_of(const cv::Mat& mat) {
  const auto points = points_in<S>(mat).value();
  return {cloud::statistical_inliers(par, points, {.neighbors = 12}),
          cloud::radius_inliers(par, points, {.radius = 0.1, .min_neighbors = 8}),
          cloud::filter_automatically(par, points).inliers};
}

}  // namespace

TEST_CASE("points in a matrix of every shape go through every filter where they are") {
  auto ours = test::uniform_cloud(2400, 53);
  ours[100].x() = std::numeric_limits<float>::quiet_NaN();
  const std::vector expected{cloud::statistical_inliers(par, ours, {.neighbors = 12}),
                             cloud::radius_inliers(par, ours, {.radius = 0.1, .min_neighbors = 8}),
                             cloud::filter_automatically(par, ours).inliers};
  CHECK(expected[0].size() < ours.size());

  const cv::Mat column(2400, 1, CV_32FC3, ours.data());
  CHECK(points_in<float>(column)->begin()[7] == std::array{ours[7].x(), ours[7].y(), ours[7].z()});
  CHECK(kept_of<float>(column) == expected);
  CHECK(kept_of<float>(column.reshape(3, 40)) == expected);  // organised, 60 x 40
  CHECK(kept_of<float>(column.reshape(3, 1)) == expected);   // one row
  CHECK(kept_of<float>(column.reshape(1)) == expected);      // CV_32FC1, 2400 x 3
  cv::Mat doubles;
  column.convertTo(doubles, CV_64F);
  CHECK(kept_of<double>(doubles) == expected);
  CHECK(kept_of<double>(doubles.reshape(1)) == expected);

  // Parts of larger matrices: rows that are farther apart than they are long.
  cv::Mat frame(44, 70, CV_32FC3, cv::Scalar(-9, -9, -9));
  column.reshape(3, 40).copyTo(frame(cv::Rect(5, 2, 60, 40)));
  CHECK(kept_of<float>(frame(cv::Rect(5, 2, 60, 40))) == expected);
  cv::Mat records(2400, 7, CV_32FC1, cv::Scalar(5));  // x, y, z among other fields
  column.reshape(1).copyTo(records.colRange(2, 5));
  CHECK(kept_of<float>(records.colRange(2, 5)) == expected);
  cv::Mat narrow(2400, 3, CV_32FC3, cv::Scalar(-9, -9, -9));
  column.copyTo(narrow.col(1));
  CHECK(kept_of<float>(narrow.col(1)) == expected);
}

TEST_CASE("points in a matrix are the matrix's own") {
  cv::Mat mat(4, 5, CV_32FC3, cv::Scalar(1, 2, 3));
  const auto points = points_in<float>(mat).value();
  mat.at<cv::Vec3f>(2, 3) = {7, 8, 9};
  CHECK(points[13] == std::array{7.0F, 8.0F, 9.0F});
  const auto image = view_as<vec3f>(mat).value();  // organised, as pixels
  CHECK(image(3, 2) == vec3f{7, 8, 9});
  CHECK(image.data()->data() == mat.ptr<float>());
  CHECK(view_as<vec3>(cv::Mat(2, 2, CV_64FC3, cv::Scalar(1, 2, 3))).value()(1, 1) == vec3{1, 2, 3});
}

TEST_CASE("what holds no points is refused with a reason") {
  const auto message = [](const cv::Mat& mat) {
    const auto points = points_in<float>(mat);
    return points ? std::string{} : points.error().message;
  };
  CHECK(message(cv::Mat(4, 3, CV_64FC1)) == "has type CV_64FC1, not CV_32FC3 or CV_32FC1");
  CHECK(message(cv::Mat(4, 3, CV_32FC2)) == "has type CV_32FC2, not CV_32FC3 or CV_32FC1");
  CHECK(message(cv::Mat(4, 4, CV_32FC1)) == "has 4 columns; must have 3 (x, y, z)");
  const int sizes[] = {2, 2, 3};
  CHECK(message(cv::Mat(3, sizes, CV_32FC1)) == "has 3 dimensions, not 2");
  CHECK(points_in<float>(cv::Mat{})->empty());
}
