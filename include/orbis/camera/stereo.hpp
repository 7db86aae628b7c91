// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Stereo rigs and their rectification.
///
/// @code
///   const stereo_rig rig{left_camera, right_camera, T_left_right};
///   const rectification straight = rectify(rig).value();
///   const auto left = straight.left().bilinear(left_image.view());
///   const auto right = straight.right().bilinear(right_image.view());
/// @endcode
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/undistort.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Two rigidly connected cameras that capture images at the same time.
template <camera_model Left, camera_model Right = Left>
struct stereo_rig {
  Left left;
  Right right;
  se3 T_left_right;  ///< transforms from the right camera's frame to the left one's, metres

  /// The distance between the two camera centres, metres.
  [[nodiscard]] double baseline() const { return norm(T_left_right.translation()); }
};

template <class Left, class Right>
stereo_rig(Left, Right, se3) -> stereo_rig<Left, Right>;

/// Options of `rectify`.
struct rectify_options {
  int width = 0;                   ///< width of the rectified images, pixels; 0: width of the left camera
  int height = 0;                  ///< height of the rectified images, pixels; 0: height of the left camera
  std::optional<double> focal{};   ///< focal length of the rectified camera, pixels; default: see `rectify`
  double max_magnification = 1.5;  ///< maximum ratio of the default focal length to that at the image centres
};

/// Maps the images of a stereo rig to images of two identical pinhole cameras at the same positions, with parallel
/// optical axes and x along the baseline. A point is on the same row in both images; its column in the right image is
/// its column in the left image minus `camera().k().fx * baseline() / depth`. Build it once (`rectify`) and apply it to
/// each pair: `left().bilinear(image)`. 16 bytes per pixel.
class rectification {
 public:
  /// Creates the identity mapping, for images that are already rectified.
  rectification(const pinhole& camera, double baseline) : camera_{camera}, baseline_{baseline} {}
  /// @pre both maps have the size of `camera`; `R_left_rectified` rotates rays from the rectified cameras' frame to the
  /// left camera's frame
  rectification(const pinhole& camera, double baseline, const so3& R_left_rectified, undistortion left,
                undistortion right)
      : camera_{camera}, baseline_{baseline}, R_left_rectified_{R_left_rectified} {
    maps_.emplace(std::move(left), std::move(right));
  }

  /// The camera of both rectified images.
  [[nodiscard]] const pinhole& camera() const noexcept { return camera_; }
  /// Distance between the camera centres, metres.
  [[nodiscard]] double baseline() const noexcept { return baseline_; }
  /// Rotation from the rectified left camera's frame to the original left camera's frame, which has the same origin.
  [[nodiscard]] const so3& R_left_rectified() const noexcept { return R_left_rectified_; }
  /// Returns true if the images are already rectified and need no remapping.
  [[nodiscard]] bool is_identity() const noexcept { return !maps_; }
  /// The map from images of the left (right) camera to rectified images. @pre !is_identity()
  [[nodiscard]] const undistortion& left() const { return maps_.value().first; }
  [[nodiscard]] const undistortion& right() const { return maps_.value().second; }

 private:
  pinhole camera_;
  double baseline_ = 0.0;
  so3 R_left_rectified_;
  std::optional<std::pair<undistortion, undistortion>> maps_;
};

namespace detail {

/// The axes of the rectified cameras as columns, in the left camera's frame: x along the baseline, z as close as
/// possible to the mean of both optical axes. Empty if the cameras are not side by side, or do not look in the same
/// direction.
[[nodiscard]] inline std::optional<mat3> rectified_axes(const se3& T_left_right) {
  const vec3 x = normalized(T_left_right.translation());
  const vec3 left = vec3(0.0, 0.0, 1.0), right = T_left_right.rotation() * left;
  const vec3 y = cross(left + right, x);
  if (!all_finite(x) || !(x.x() > 0.5) || !(norm(y) > 0.1)) return std::nullopt;
  const mat3 axes = columns(x, normalized(y), cross(x, normalized(y)));
  const vec3 z = column_of(axes, 2), upright = T_left_right.rotation() * vec3(0.0, 1.0, 0.0);
  if (dot(z, left) < 0.5 || dot(z, right) < 0.5 || !(dot(column_of(axes, 1), upright) > 0.5)) return std::nullopt;
  return axes;
}

/// The geometric mean of the focal lengths along x and y at the image centre, pixels; empty if there is no ray.
template <camera_model Camera>
[[nodiscard]] std::optional<double> middle_focal(const Camera& camera) {
  const auto ray = camera.unproject({0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1)});
  matrix<2, 3> j;
  if (!ray || !camera.project(*ray, j)) return std::nullopt;
  const double area = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0);
  return area > 0.0 ? std::optional{std::sqrt(area)} : std::nullopt;
}

/// Returns true if `camera` sees everything that `ideal`, rotated by `R_camera_ideal`, sees along the edge of its
/// image.
template <camera_model Camera>
[[nodiscard]] bool sees_edge(const Camera& camera, const pinhole& ideal, const mat3& R_camera_ideal) {
  const auto sees = [&](double x, double y) {
    const auto pixel = camera.project(R_camera_ideal * *ideal.unproject({x, y}));
    return pixel && pixel->x() >= 0.0 && pixel->y() >= 0.0 && pixel->x() <= camera.width() - 1.0 &&
           pixel->y() <= camera.height() - 1.0;
  };
  const int right = ideal.width() - 1, bottom = ideal.height() - 1;
  for (int x = 0; x <= right; ++x)
    if (!sees(x, 0) || !sees(x, bottom)) return false;
  for (int y = 0; y <= bottom; ++y)
    if (!sees(0, y) || !sees(right, y)) return false;
  return true;
}

/// Returns true if images of the rig's cameras are already rectified.
template <camera_model Left, camera_model Right>
[[nodiscard]] bool is_rectified(const stereo_rig<Left, Right>& rig) {
  constexpr double tiny = 1e-9;
  const vec3& t = rig.T_left_right.translation();
  if (!(rig.T_left_right.rotation().angle() < tiny) || !(t.x() > 0.0) || std::hypot(t.y(), t.z()) > tiny * t.x())
    return false;
  const int w = rig.left.width(), h = rig.left.height();
  if (rig.right.width() != w || rig.right.height() != h || w == 0 || h == 0) return false;
  // The rays of a pinhole camera depend linearly on the pixel, so testing a few pixels suffices, regardless of the
  // camera's static type.
  const auto like = [&](const auto& camera, const pinhole& k) {
    for (const double v : {0.0, 0.3, 1.0})
      for (const double u : {0.0, 0.6, 1.0}) {
        const vec2 pixel{u * (w - 1), v * (h - 1)};
        const auto ray = camera.unproject(pixel);
        if (!ray || !(norm(*k.project(*ray) - pixel) < 1e-6)) return false;
      }
    return true;
  };
  const auto k = [&]() -> std::optional<pinhole> {
    if constexpr (has_intrinsics<Left>) return pinhole{rig.left.k()};
    return std::nullopt;
  }();
  return k && like(rig.left, *k) && like(rig.right, *k);
}

}  // namespace detail

/// Computes the rectification of a rig with any two camera models. Both cameras are rotated as little as possible: x
/// along the baseline, z close to the mean of both axes. The new camera has one focal length: the smaller of the two
/// cameras' focal lengths at their image centres, increased by a factor of up to `max_magnification` if rectified
/// pixels would otherwise have no source. The image centres are preserved. For rigs that are already rectified, the
/// result is the identity. O(pixels) projections.
///
/// After A. Fusiello, E. Trucco, A. Verri, "A compact algorithm for rectification of stereo pairs", Machine Vision and
/// Applications 12 (2000), which keeps one axis of the left camera instead of the mean of both. Errors:
/// invalid_argument if the right camera is not to the right of the left one, the cameras do not look in the same
/// direction, or one has no ray at its image centre.
template <camera_model Left, camera_model Right>
[[nodiscard]] result<rectification> rectify(const stereo_rig<Left, Right>& rig, const rectify_options& options = {}) {
  const auto reject = [](const char* why) { return fail(errc::invalid_argument, "stereo rig", why); };
  if constexpr (has_intrinsics<Left>) {
    const bool as_is = (options.width == 0 || options.width == rig.left.width()) &&
                       (options.height == 0 || options.height == rig.left.height()) && !options.focal;
    if (as_is && detail::is_rectified(rig)) return rectification{pinhole{rig.left.k()}, rig.baseline()};
  }
  const auto axes = detail::rectified_axes(rig.T_left_right);
  if (!axes) return reject("the right camera must be to the right of the left one and look in the same direction");
  const mat3 left = *axes, right = rig.T_left_right.rotation().inverse().rotation_matrix() * *axes;
  const auto left_focal = detail::middle_focal(rig.left), right_focal = detail::middle_focal(rig.right);
  if (!left_focal || !right_focal) return reject("a camera has no ray at its image centre");

  const int width = options.width > 0 ? options.width : rig.left.width();
  const int height = options.height > 0 ? options.height : rig.left.height();
  vec2 middle = zeros<vec2>();  // mean direction of both cameras, on the plane z = 1
  const auto add_middle = [&](const auto& camera, const mat3& R_camera_ideal) {
    const auto ray = camera.unproject({0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1)});
    const vec3 seen = transposed(R_camera_ideal) * *ray;
    if (!(seen.z() > 0.1 * norm(seen))) return false;
    middle += 0.5 * head<2>(seen) / seen.z();
    return true;
  };
  if (!add_middle(rig.left, left) || !add_middle(rig.right, right))
    return reject("the cameras do not look in the same direction");
  const auto with_focal = [&](double f) {
    return pinhole{width, height, f, f, 0.5 * (width - 1) - f * middle.x(), 0.5 * (height - 1) - f * middle.y()};
  };
  const double least = options.focal.value_or(std::min(*left_focal, *right_focal));
  const double most = options.focal ? least : least * std::max(1.0, options.max_magnification);
  double focal = least;
  const auto is_filled = [&](double f) {
    const pinhole k = with_focal(f);
    return detail::sees_edge(rig.left, k, left) && detail::sees_edge(rig.right, k, right);
  };
  if (most > least && !is_filled(least)) {
    double f = least;
    while (f < most && !is_filled(f)) f *= 1.01;
    if (f < most) focal = f;
  }
  const pinhole camera = with_focal(focal);
  return rectification{camera, rig.baseline(), so3{left}, undistortion{rig.left, camera, left},
                       undistortion{rig.right, camera, right}};
}

}  // namespace orbis::camera
