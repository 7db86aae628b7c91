// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration of a camera with a recording: alternates between tracking and calibration with the resulting map.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/slam/calibration.hpp>

#include "camera_check.hpp"
#include "console.hpp"
#include "settings.hpp"
#include "source.hpp"

namespace app {

struct calibration_rounds {
  orbis::slam::calibration<orbis::camera::any_camera> last;  ///< result of the last round; held parameters are as given
  std::vector<orbis::slam::calibrated_parameter> parameters;  ///< change over all rounds: `before` is the given value
  orbis::trajectory trajectory;                               ///< trajectory of the last round
  std::optional<lens_comparison> lens;                        ///< comparison in the last round, if requested
};

struct calibration_limits {
  int most_rounds = 5;
  double longest = std::numeric_limits<double>::infinity();  ///< maximum duration of the frames to use, seconds
  bool compares_lens = false;                                ///< computes `calibration_rounds::lens`
};

/// Runs rounds until the parameters no longer change. Errors: unreadable frames, no_data if tracking never starts,
/// degenerate if the motion does not determine the camera, cancelled if the user interrupts a run.
[[nodiscard]] orbis::result<calibration_rounds> calibrate_by(const frame_source& source, const settings& s,
                                                             const orbis::camera::shutter& shutter,
                                                             const orbis::camera::any_camera& given,
                                                             const calibration_limits& limits, console& console);

/// Returns true if the round changed no parameter by more than `deviations` standard deviations. Exact equality is not
/// expected, because the maps of two rounds have different landmarks.
[[nodiscard]] bool is_settled(const orbis::slam::calibration<orbis::camera::any_camera>& round, double deviations);

}  // namespace app
