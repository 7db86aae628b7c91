// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether the camera's focal length, and its lens, fit what was recorded with it.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <orbis/camera/any.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace app {

/// That images fit another focal length clearly better than the camera's, pixels.
struct focal_doubt {
  double given, found;
  bool is_sure = true;  ///< false where a lens that bends would explain the images a little better
};

/// The camera; a pinhole with a lens without distortion, which can be estimated.
[[nodiscard]] orbis::camera::any_camera with_lens(const orbis::camera::any_camera& camera);

/// How a pinhole and a lens with distortion explain the images.
struct lens_comparison {
  double pinhole_focal, lens_focal;  ///< fx of each, pixels
  double pinhole_rms, lens_rms;      ///< of the images' errors, standard deviations
  bool is_determined;                ///< whether the motion determines the distortion
  /// Whether the images tell that there is some.
  [[nodiscard]] bool has_distortion() const;
};

/// Of the parameters that a calibration found; empty where it does not tell, as where one was held.
[[nodiscard]] std::optional<focal_doubt> find_doubt(std::span<const orbis::slam::calibrated_parameter> found);
/// Of a map made with the camera. Poses of a wrong camera are some percent too near to each other or too far apart, but
/// distortion that a pinhole does not model moves them as well: empty where that explains the images clearly better, or
/// where they do not tell. One or two small self-calibrations: some tenths of a second.
[[nodiscard]] std::optional<focal_doubt> find_doubt(const orbis::slam::map& map,
                                                    const orbis::camera::any_camera& camera,
                                                    const orbis::slam::options& options);
/// Whether a calibration found clearly another focal length, whatever of the rest was held.
[[nodiscard]] bool has_other_focal_length(std::span<const orbis::slam::calibrated_parameter> found);
/// Of a map made with the camera, and a calibration by that map, which was done as `how` says. Empty where the camera
/// is no pinhole, or the images tell nothing. One self-calibration.
[[nodiscard]] std::optional<lens_comparison> compare_lens(const orbis::slam::map& map,
                                                          const orbis::camera::any_camera& camera,
                                                          const orbis::slam::calibration_summary& as_pinhole,
                                                          const orbis::slam::options& options,
                                                          const orbis::slam::calibration_options& how);
/// What the user should know.
[[nodiscard]] std::string in_words(const focal_doubt& doubt);
/// @pre lens.has_distortion(), or it is not determined
[[nodiscard]] std::string in_words(const lens_comparison& lens);

}  // namespace app
