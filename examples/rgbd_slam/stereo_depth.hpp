// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images of rectified stereo pairs, computed by semi-global matching.
#pragma once

#include <cstdint>

#include <orbis/camera/settings.hpp>
#include <orbis/core/image.hpp>

namespace app {

/// The depth image of the left camera, in units of 1 / depth_scale metres; 0 where depth is unknown: where the right
/// camera does not see the surface, on surfaces without texture, and nearer than about five baselines. @pre `camera`
/// has a baseline, and both images have its size
[[nodiscard]] orbis::image<std::uint16_t> stereo_depth(orbis::image_view<const orbis::rgb8> left,
                                                       orbis::image_view<const orbis::rgb8> right,
                                                       const orbis::camera::camera_settings& camera);

}  // namespace app
