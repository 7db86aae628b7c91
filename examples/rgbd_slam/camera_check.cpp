// SPDX-License-Identifier: BSD-3-Clause
#include "camera_check.hpp"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

#include <orbis/slam/calibration.hpp>

namespace app {

std::optional<std::string> doubt_focal_length(const orbis::slam::any_system& slam,
                                              const orbis::camera::any_camera& camera,
                                              const orbis::slam::options& options) {
  constexpr std::size_t few = 8;  // keyframes
  constexpr double least_change = 0.015, sigmas = 6.0;
  using calibration = orbis::slam::calibration<orbis::camera::any_camera>;
  const auto found = slam.inspect([&](const orbis::slam::atlas& maps) -> std::optional<calibration> {
    if (maps.active().keyframes().size() < few) return std::nullopt;
    auto refined = orbis::slam::calibrate(maps.active(), orbis::slam::make_rig(camera, options), {.max_keyframes = 60});
    return refined ? std::optional{*std::move(refined)} : std::nullopt;
  });
  if (!found) return std::nullopt;
  for (const auto& p : found->parameters) {
    if (p.name != "fx" || p.is_held) continue;
    const double change = p.after - p.before;
    if (!(std::abs(change) > sigmas * p.deviation && std::abs(change) > least_change * p.before)) return std::nullopt;
    char text[200];
    std::snprintf(text, sizeof text,
                  "the camera's focal length is doubtful: the images fit %.0f pixels better than %.0f (%+.1f %%); "
                  "rgbd_slam calibrate finds a camera for them",
                  p.after, p.before, 100.0 * change / p.before);
    return text;
  }
  return std::nullopt;
}

}  // namespace app
