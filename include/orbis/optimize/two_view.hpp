// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Two-view geometry: essential matrix and homography of two images from matched pixels, many of which may be wrong;
/// the corresponding relative poses; and the reconstruction of a scene from two images, or the reason for failure.
///
/// Sources: D. Nister, PAMI 26(6), 2004, for five points and the choice among four decompositions; P. Sampson, "Fitting
/// conic sections to very scattered data", CGIP 18 (1982), for the error; R. Hartley, A. Zisserman, "Multiple View
/// Geometry in Computer Vision", 2003, chapter 4; Y. Ma, S. Soatto, J. Kosecka, S. Sastry, "An Invitation to 3-D
/// Vision", 2003, section 5.3, for the decomposition of homographies.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct essential_options {
  double threshold = 1.5;  ///< maximum Sampson distance of an inlier, pixels
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 15;  ///< minimum number of inliers for success
  std::uint64_t seed = 1;
};

struct relative_pose_estimate {
  se3 T_first_second;                  ///< pose of the second camera in the frame of the first; unit translation
  mat3 essential;                      ///< `second^T E first = 0` for matching rays; norm sqrt(2)
  std::vector<std::uint32_t> inliers;  ///< indices of all matches within the threshold, ascending
  std::size_t in_front = 0;            ///< number of inliers whose rays intersect in front of both cameras
  double parallax = 0.0;               ///< median angle between the two rays of an inlier, radians
  double rmse = 0.0;                   ///< root mean square Sampson distance of the inliers, pixels
  std::size_t iterations = 0;
};

namespace detail {

/// Implements `estimate_essential` for the usable matches among `n` matches.
template <class Match>
[[nodiscard]] result<relative_pose_estimate> essential_of_matches(const std::vector<Match>& matches, std::size_t n,
                                                                  const essential_options& options);

}  // namespace detail

/// Estimates the essential matrix and the relative pose that agree with most matches: RANSAC with five points per
/// sample; each new best matrix is refined on its inliers. `first_pixels[i]` matches `second_pixels[i]`. Matches that
/// are not finite or cannot be unprojected are outliers. Deterministic for a given `options.seed`. Errors:
/// `invalid_argument` for spans of different lengths or options out of range; `no_data` for fewer than five matches;
/// `degenerate` if fewer than five are usable, no matrix has `min_inliers` inliers, or a rotation alone explains nearly
/// all inliers, so that the translation is not determined. The message gives the reason.
template <camera::camera_model Camera>
[[nodiscard]] result<relative_pose_estimate> estimate_essential(std::span<const vec2> first_pixels,
                                                                std::span<const vec2> second_pixels,
                                                                const Camera& camera,
                                                                const essential_options& options = {}) {
  constexpr const char* where = "essential matrix";
  const std::size_t n = first_pixels.size();
  if (n != second_pixels.size()) return fail(errc::invalid_argument, where, "the lists of pixels differ in length");
  const ransac_options asked = detail::ransac_part(options);
  if (const char* const fault = detail::find_fault(asked)) return fail(errc::invalid_argument, where, fault);
  if (n < 5) return fail(errc::no_data, where, "fewer than five matches");
  const std::vector<detail::image_match> matches =
      detail::read_matches(first_pixels, second_pixels, camera, options.seed);
  if (matches.size() < 5)
    return fail(errc::degenerate, where,
                "only " + std::to_string(matches.size()) + " of " + std::to_string(n) +
                    " matches are finite and in the camera's view; five are needed");
  return detail::essential_of_matches(matches, n, options);
}

struct homography_options {
  double threshold = 3.0;  ///< maximum error of an inlier, pixels: root mean square of the two transfer errors
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 8;  ///< minimum number of inliers for success
  std::uint64_t seed = 1;
};

struct homography_estimate {
  mat3 H_second_first;                 ///< `second ~ H * (first, 1)`, with H(2, 2) = 1 unless that is 0
  std::vector<std::uint32_t> inliers;  ///< indices of all matches within the threshold, ascending
  double rmse = 0.0;                   ///< root mean square error of the inliers, pixels
  std::size_t iterations = 0;
};

/// A decomposition of the homography of a plane: `H ~ rotation + translation * normal^T`. `normal` is the unit normal
/// of the plane in the first camera frame; it points from the camera to the plane (normal . p > 0). `translation` is
/// that of `T_second_first`, in units of the distance of the plane from the first camera.
struct plane_motion {
  so3 R_second_first;
  vec3 translation = zeros<vec3>();
  vec3 normal = vec3(0.0, 0.0, 1.0);
};

/// Estimates the homography that agrees with most matches: RANSAC with four points per sample; each new best homography
/// is refined on its inliers (least squares of the transfer errors in both images). `first[i]` matches `second[i]`, in
/// undistorted pixels. Matches that are not finite, or on the other side of the horizon than most (behind the camera),
/// are outliers. Deterministic for a given `options.seed`. Errors: `invalid_argument` for spans of different lengths or
/// options out of range; `no_data` for fewer than four matches; `degenerate` if fewer than four are finite, all points
/// of an image are collinear, or no homography has `min_inliers` inliers. The message gives the reason.
template <std::same_as<homography_options> Options = homography_options>
[[nodiscard]] result<homography_estimate> estimate_homography(std::span<const vec2> first, std::span<const vec2> second,
                                                              const Options& options = {});

/// Returns the motions that a homography between rays at z = 1 may represent, regardless of its scale and sign: two, or
/// one if there is no translation. (Two further solutions have the plane behind the first camera.) `ray` is any matched
/// ray of the first camera, with z > 0. Errors: `degenerate` if the homography is singular or not finite.
ORBIS_LAZY [[nodiscard]] result<std::vector<plane_motion>> decompose_homography(const mat3& homography,
                                                                                const vec3& ray = vec3(0.0, 0.0, 1.0));

struct two_view_options {
  double deviation = 1.0;            ///< standard deviation of a matched pixel, along each axis, pixels
  std::size_t min_points = 50;       ///< minimum number of points of a reconstruction
  double min_parallax = 0.02;        ///< minimum median parallax of the points, radians
  double max_rotation = 0.01;        ///< maximum standard deviation of the rotation, radians
  double max_direction = 0.035;      ///< maximum standard deviation of the direction of the translation, radians
  double max_depth = 0.3;            ///< maximum standard deviation of a point's depth, relative to the depth
  double confidence = 0.999;         ///< confidence of RANSAC
  std::size_t max_iterations = 500;  ///< maximum number of RANSAC iterations for either model
  std::uint64_t seed = 1;
};

/// A scene and the motion between two images of it. The unit of length is the median depth of `points`.
struct two_view_reconstruction {
  se3 T_first_second;                  ///< pose of the second camera in the frame of the first
  std::vector<vec3> points;            ///< in the first camera frame; their median z is 1
  std::vector<std::uint32_t> matches;  ///< index of the match of each point, ascending
  std::size_t inliers = 0;           ///< matches that agree with the motion, including distant ones that give no point
  double parallax = 0.0;             ///< median angle between the two rays to a point, radians
  double rmse = 0.0;                 ///< root mean square distance of the inliers from their epipolar lines, pixels
  double rotation_deviation = 0.0;   ///< standard deviation of the rotation, radians
  double direction_deviation = 0.0;  ///< standard deviation of the direction of the translation, radians
  bool from_homography = false;      ///< true if a homography explains the matches better than epipolar geometry
};

namespace detail {

/// Implements `reconstruct_two_views` for the usable matches among `n` matches.
template <class Match>
[[nodiscard]] result<two_view_reconstruction> reconstruction_of_matches(const std::vector<Match>& matches,
                                                                        std::size_t n, const two_view_options& options);

}  // namespace detail

/// Reconstructs the scene and the motion from matched pixels, or returns the reason for failure. `first_pixels[i]`
/// matches `second_pixels[i]`; many may be wrong. `deviations`: the standard deviation of each match relative to
/// `options.deviation`, for example the scale of the keypoint's pyramid level; if empty, all are equal. Ambiguous cases
/// are rejected so that a result is reliable; on failure, try again with the next image. Deterministic for a given
/// `options.seed`. Errors: `invalid_argument` for spans of different lengths or options out of range; `no_data` if
/// fewer than `min_points` matches are usable; `degenerate` if the motion is not determined: pure rotation, too little
/// parallax, two motions that explain the matches about equally well (as for a plane), too few points or too large
/// standard deviations. The message gives the reason.
template <camera::camera_model Camera>
[[nodiscard]] result<two_view_reconstruction> reconstruct_two_views(std::span<const vec2> first_pixels,
                                                                    std::span<const vec2> second_pixels,
                                                                    const Camera& camera,
                                                                    const two_view_options& options = {},
                                                                    std::span<const double> deviations = {}) {
  constexpr const char* where = "two views";
  const std::size_t n = first_pixels.size();
  if (n != second_pixels.size() || (!deviations.empty() && n != deviations.size()))
    return fail(errc::invalid_argument, where, "the lists of pixels differ in length");
  if (!(options.deviation > 0.0) || !std::isfinite(options.deviation))
    return fail(errc::invalid_argument, where, "the deviation must be positive and finite");
  if (!(options.confidence > 0.0 && options.confidence < 1.0))
    return fail(errc::invalid_argument, where, "the confidence must be between 0 and 1");
  std::vector<detail::image_match> matches = detail::read_matches(first_pixels, second_pixels, camera, options.seed);
  for (detail::image_match& m : matches) {
    const double deviation = options.deviation * (deviations.empty() ? 1.0 : deviations[m.original]);
    m.first.scale_metric(1.0 / deviation);
    m.second.scale_metric(1.0 / deviation);
  }
  return detail::reconstruction_of_matches(matches, n, options);
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/two_view-inl.hpp>
#endif
