// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A camera that is refined by a recording: track, refine the camera by the map, and again with that camera.
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
  orbis::slam::calibration<orbis::camera::any_camera> last;   ///< the last round; what was held has the values given
  std::vector<orbis::slam::calibrated_parameter> parameters;  ///< over all rounds: `before` is what was given
  orbis::trajectory trajectory;                               ///< of the last round
  std::optional<lens_comparison> lens;                        ///< of the last round, if it was asked for
};

struct calibration_effort {
  int most_rounds = 5;
  double longest = std::numeric_limits<double>::infinity();  ///< of the recording, seconds
  bool compares_lens = false;                                ///< asks for `calibration_rounds::lens`
};

/// Rounds until nothing changes. Errors: frames that cannot be read, no_data if tracking never starts,
/// degenerate where the motion does not determine the camera.
[[nodiscard]] orbis::result<calibration_rounds> calibrate_by(const frame_source& source, const settings& s,
                                                             const orbis::camera::shutter& shutter,
                                                             const orbis::camera::any_camera& given,
                                                             const calibration_effort& effort, console& console);

/// Whether the round changed no parameter by more than so many deviations. Not every map has the same landmarks.
[[nodiscard]] bool is_settled(const orbis::slam::calibration<orbis::camera::any_camera>& round, double deviations);

}  // namespace app
