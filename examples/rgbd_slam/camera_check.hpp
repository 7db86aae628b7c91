// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Checks of the camera's focal length and lens against a recording.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace app {

/// Evidence that another focal length (in pixels) fits the images clearly better than the camera's focal length.
struct focal_doubt {
  double given, found;
  bool is_sure = true;  ///< false if a lens with distortion would fit the images slightly better
};

/// Adds distortion parameters with the value zero to a pinhole camera, so that they can be estimated; returns other
/// cameras unchanged.
[[nodiscard]] orbis::camera::any_camera with_lens(const orbis::camera::any_camera& camera);

/// Comparison of the fits of a pinhole camera and a camera with lens distortion.
struct lens_comparison {
  double pinhole_focal, lens_focal;  ///< fx of each camera, pixels
  double pinhole_rms, lens_rms;      ///< RMS reprojection error, in standard deviations
  bool is_determined;                ///< true if the motion determines the distortion
  /// Returns true if the images show distortion.
  [[nodiscard]] bool has_distortion() const;
};

/// Evidence in calibrated parameters that the camera's focal length is wrong; empty if the calibration is inconclusive,
/// for example because a parameter was held.
[[nodiscard]] std::optional<focal_doubt> find_doubt(std::span<const orbis::slam::calibrated_parameter> found);
/// Evidence in a map made with the camera that its focal length is wrong. A wrong focal length scales the distances
/// between poses by a few percent, but so does distortion that a pinhole camera does not model. Empty if distortion
/// fits the images clearly better, if the images are inconclusive, or if `go_on` cancels a calibration. Runs one or two
/// small self-calibrations, which take a few tenths of a second.
[[nodiscard]] std::optional<focal_doubt> find_doubt(const orbis::slam::map& map,
                                                    const orbis::camera::any_camera& camera,
                                                    const orbis::slam::options& options,
                                                    const orbis::progress& go_on = {});
/// Returns true if a calibration resulted in a clearly different focal length, even if other parameters were held.
[[nodiscard]] bool has_other_focal_length(std::span<const orbis::slam::calibrated_parameter> found);
/// Compares the calibration `as_pinhole`, which was run on `map` with the options `how`, with a calibration that
/// includes distortion. Empty if the camera is not a pinhole camera or the calibration fails. Runs one
/// self-calibration.
[[nodiscard]] std::optional<lens_comparison> compare_lens(const orbis::slam::map& map,
                                                          const orbis::camera::any_camera& camera,
                                                          const orbis::slam::calibration_summary& as_pinhole,
                                                          const orbis::slam::options& options,
                                                          const orbis::slam::calibration_options& how,
                                                          const orbis::progress& go_on = {});
/// The warning for the user about the focal length.
[[nodiscard]] std::string describe(const focal_doubt& doubt);
/// The warning for the user about distortion. @pre lens.has_distortion() or !lens.is_determined
[[nodiscard]] std::string describe(const lens_comparison& lens);

}  // namespace app
