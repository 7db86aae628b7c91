// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Views of OpenCV images and points as orbis types, and vice versa, without copies; conversion of keypoints and colour
/// order.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <opencv2/core.hpp>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/interop/strided_points.hpp>

namespace orbis::interop {

/// A colour pixel in OpenCV's usual order.
struct bgr8 {
  std::uint8_t b = 0, g = 0, r = 0;
  friend bool operator==(const bgr8&, const bgr8&) = default;
};
static_assert(sizeof(bgr8) == 3);

/// Pixel types that a `cv::Mat` and an `image_view` can share.
template <class T>
concept shared_pixel = std::same_as<T, std::uint8_t> || std::same_as<T, rgb8> || std::same_as<T, bgr8> ||
    std::same_as<T, std::uint16_t> || std::same_as<T, float> || std::same_as<T, vec3f> || std::same_as<T, vec3>;

/// OpenCV's type number for a pixel: CV_8UC1, CV_8UC3, CV_16UC1, CV_32FC1, and CV_32FC3 or CV_64FC3 for
/// organised points.
template <shared_pixel T>
inline constexpr int cv_type = std::same_as<T, std::uint8_t>    ? CV_8UC1
                               : std::same_as<T, std::uint16_t> ? CV_16UC1
                               : std::same_as<T, float>         ? CV_32FC1
                               : std::same_as<T, vec3f>         ? CV_32FC3
                               : std::same_as<T, vec3>          ? CV_64FC3
                                                                : CV_8UC3;

/// A view of the pixels of `mat`; `mat` (or another header for its data) must outlive the view. The caller chooses
/// `bgr8` or `rgb8` for three-byte pixels, because OpenCV does not record the order. Errors: unsupported, if the type
/// differs, if there are more than two dimensions, or if the row stride is not a multiple of the pixel size. An empty
/// matrix gives an empty view.
template <shared_pixel T>
[[nodiscard]] result<image_view<const T>> view_as(const cv::Mat& mat) {
  if (mat.empty()) return image_view<const T>{};
  if (mat.dims != 2)
    return fail(errc::unsupported, "cv::Mat", "has " + std::to_string(mat.dims) + " dimensions, not 2");
  if (mat.type() != cv_type<T>)
    return fail(errc::unsupported, "cv::Mat",
                "has type " + cv::typeToString(mat.type()) + ", not " + cv::typeToString(cv_type<T>));
  const std::size_t step = mat.step[0];
  if (mat.rows > 1 && step % sizeof(T) != 0)
    return fail(errc::unsupported, "cv::Mat", "has a row stride that is not a multiple of the pixel size");
  const std::ptrdiff_t stride = mat.rows > 1 ? static_cast<std::ptrdiff_t>(step / sizeof(T)) : mat.cols;
  return image_view<const T>{mat.ptr<T>(), mat.cols, mat.rows, stride};
}

/// A view of the points in `mat`, row by row. S = float: CV_32FC3 of any shape (an organised cloud, a row, a column) or
/// CV_32FC1 with three columns and one point per row; S = double: CV_64FC3 or CV_64FC1. `mat` (or another header for
/// its data) must outlive the points. If rows contain more numbers than x, y and z, pass `mat.colRange(0, 3)`. An empty
/// matrix has no points. Errors: unsupported, if the type or the shape differs.
template <std::floating_point S>
requires(sizeof(S) == 4 || sizeof(S) == 8) [[nodiscard]] result<strided_points<S>> points_in(const cv::Mat& mat) {
  constexpr int depth = sizeof(S) == 4 ? CV_32F : CV_64F;
  if (mat.empty()) return strided_points<S>{};
  if (mat.dims != 2)
    return fail(errc::unsupported, "cv::Mat", "has " + std::to_string(mat.dims) + " dimensions, not 2");
  if (mat.depth() != depth || (mat.channels() != 3 && mat.channels() != 1))
    return fail(errc::unsupported, "cv::Mat",
                "has type " + cv::typeToString(mat.type()) + ", not " + cv::typeToString(CV_MAKETYPE(depth, 3)) +
                    " or " + cv::typeToString(CV_MAKETYPE(depth, 1)));
  if (mat.channels() == 1 && mat.cols != 3)
    return fail(errc::unsupported, "cv::Mat", "has " + std::to_string(mat.cols) + " columns; must have 3 (x, y, z)");
  const auto step = static_cast<std::ptrdiff_t>(mat.step[0] / sizeof(S));
  const auto rows = static_cast<std::size_t>(mat.rows);
  const auto cols = static_cast<std::size_t>(mat.cols);
  if (mat.channels() == 1) return strided_points<S>{mat.ptr<S>(), rows, {.point_stride = step}};
  if (mat.isContinuous()) return strided_points<S>{mat.ptr<S>(), rows * cols};
  if (cols == 1) return strided_points<S>{mat.ptr<S>(), rows, {.point_stride = step}};
  return strided_points<S>{mat.ptr<S>(), rows * cols, {.row_length = cols, .row_stride = step}};
}

/// A `cv::Mat` header over the pixels of a view; the pixels must outlive it.
template <shared_pixel T>
[[nodiscard]] cv::Mat mat_over(image_view<T> view) {
  if (view.empty()) return {};
  return {view.height(), view.width(), cv_type<T>, view.data(), static_cast<std::size_t>(view.stride()) * sizeof(T)};
}

/// A `cv::Mat` header over constant pixels; the pixels must outlive it. `cv::Mat` cannot be read-only: do not write to
/// the matrix.
template <shared_pixel T>
[[nodiscard]] const cv::Mat mat_over(image_view<const T> view) {  // NOLINT(readability-const-return-type)
  if (view.empty()) return {};
  return {view.height(), view.width(), cv_type<T>, const_cast<T*>(view.data()),
          static_cast<std::size_t>(view.stride()) * sizeof(T)};
}

/// Copies `bgr8` pixels to an `rgb8` image.
[[nodiscard]] inline image<rgb8> to_rgb(image_view<const bgr8> view) {
  image<rgb8> rgb(view.width(), view.height());
  for (int y = 0; y != view.height(); ++y)
    for (int x = 0; x != view.width(); ++x) rgb(x, y) = {view(x, y).r, view(x, y).g, view(x, y).b};
  return rgb;
}

/// Copies the pixels to a CV_8UC3 matrix in OpenCV's usual order.
[[nodiscard]] inline cv::Mat to_bgr(image_view<const rgb8> view) {
  cv::Mat mat(view.height(), view.width(), CV_8UC3);
  for (int y = 0; y != view.height(); ++y)
    for (int x = 0; x != view.width(); ++x)
      mat.at<cv::Vec3b>(y, x) = cv::Vec3b(view(x, y).b, view(x, y).g, view(x, y).r);
  return mat;
}

/// Converts an OpenCV keypoint. Angles are in degrees in OpenCV (-1: no angle) and in radians in orbis (no angle
/// becomes 0).
[[nodiscard]] inline features::keypoint from_cv(const cv::KeyPoint& k) {
  constexpr float radians = std::numbers::pi_v<float> / 180.0F;
  return {k.pt.x, k.pt.y, k.size, k.angle < 0.0F ? 0.0F : k.angle * radians, k.response, k.octave};
}
[[nodiscard]] inline cv::KeyPoint to_cv(const features::keypoint& k) {
  constexpr float degrees = 180.0F / std::numbers::pi_v<float>;
  return {k.x, k.y, k.size, k.angle * degrees, k.response, k.octave};
}
[[nodiscard]] inline std::vector<features::keypoint> from_cv(std::span<const cv::KeyPoint> keypoints) {
  std::vector<features::keypoint> converted;
  converted.reserve(keypoints.size());
  for (const cv::KeyPoint& k : keypoints) converted.push_back(from_cv(k));
  return converted;
}
[[nodiscard]] inline std::vector<cv::KeyPoint> to_cv(std::span<const features::keypoint> keypoints) {
  std::vector<cv::KeyPoint> converted;
  converted.reserve(keypoints.size());
  for (const features::keypoint& k : keypoints) converted.push_back(to_cv(k));
  return converted;
}

/// A read-only view of descriptors as the rows of a CV_8UC1 matrix. @pre little-endian byte order
template <std::size_t Bits>
[[nodiscard]] const cv::Mat mat_over(  // NOLINT(readability-const-return-type)
    std::span<const features::binary_descriptor<Bits>> descriptors) {
  if (descriptors.empty()) return {};
  return {static_cast<int>(descriptors.size()), static_cast<int>(Bits / 8), CV_8UC1,
          const_cast<features::binary_descriptor<Bits>*>(descriptors.data())};
}

}  // namespace orbis::interop
